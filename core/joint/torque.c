#include "torque.h"

#include <math.h>

#include "bounds.h"

/* Derived. */
static const float friction_slip = 1.0f * 0.017453292f; /* rad of the wheel, until the column's friction is full */

/* Numerical. */
static const float acceleration_max = 20.0f; /* m/s^2, mean of a second; above it the covariance is inexact */
static const float slow_max = 100.0f; /* m/s^2, as signals.c */
static const float term_max = 1e4f; /* N m, N m per m/s^2 */
static const float error_max_share = 0.5f; /* m/s^2, of a second: above it the cause is not the column */

/* Tuned, in tuned.toml: torque */
static const float friction = 0.15f; /* m/s^2: prior of the column's friction f, 0.3 N m */
static const float friction_sd = 0.1f; /* m/s^2: its sd, 0.2 N m */
static const float second_sd = 0.15f; /* m/s^2: error of a second's mean: king pins, gaps; correlated */
static const float torque_memory_s = 600.0f; /* s: memory of the terms */
static const float zero_memory_s = 120.0f; /* s: memory of the slow part, with an accelerometer */
static const float slow_road = 20.0f; /* m/s: maximum speed of learning without an accelerometer */
/* m/s^2: sd of the slow part, by the column's friction, and of the bank that a torque leaves open */
static const float slow_sd = 0.03f;
static const float slope_known = 0.05f; /* sd of g, over its prior, below which the slope is identified */
static const float trusted_share = 0.2f; /* minimum of g over its prior; below, the torque is not used */
/* end */

void oc_torque_setup(oc_torque_design *design, double slope, double zero_sd, double rate_hz, double speed_min,
                     double accelerometer_sd, bool has_accelerometer) {
    *design = (oc_torque_design){
        .slope = (float)slope,
        .zero_sd = (float)zero_sd,
        .constant_sd = (float)accelerometer_sd,
        .tick_s = (float)(1.0 / rate_hz),
        .memory_s = has_accelerometer ? zero_memory_s : 1.0f, /* a second of a bank */
        .speed_min = (float)speed_min,
        .speed_max = has_accelerometer ? 1e6f : slow_road,
        .ticks_per_second = (int32_t)(rate_hz + 0.5),
    };
}

bool oc_torque_is_trusted(const oc_torque *t, const oc_torque_design *design) {
    return t->started && t->terms[1] > trusted_share * design->slope;
}

static float prior_variance(const oc_torque_design *design, float sd) {
    return sd * sd * design->slope * design->slope;
}

float oc_torque_zero_information(const oc_torque *t, const oc_torque_design *design) {
    if (!oc_torque_is_trusted(t, design)) {
        return 0.0f;
    }
    const float zero_sd = design->zero_sd / t->terms[1];
    return 1.0f / (zero_sd * zero_sd + slow_sd * slow_sd);
}

float oc_torque_bank_sd(const oc_torque *t, const oc_torque_design *design, float otherwise) {
    return t->covariance[2] < prior_variance(design, slope_known) ? slow_sd : otherwise;
}

static void start_torque(oc_torque *t, const oc_torque_design *design) {
    *t = (oc_torque){
        .started = 1,
        .terms = {0.0f, design->slope, friction * design->slope},
        .covariance = {prior_variance(design, design->constant_sd), 0.0f, prior_variance(design, 0.5f), 0.0f, 0.0f,
                       prior_variance(design, friction_sd)},
    };
}

/* Dahl's friction opposes each turn of the wheel. */
static void follow_wheel(oc_torque *t, float angle) {
    const float turned = t->has_angle ? angle - t->angle : 0.0f;
    t->has_angle = 1;
    t->angle = angle;
    t->place = oc_clamp_size(t->place + turned / friction_slip, 1.0f);
}

static void collect_torque(oc_torque *t, const oc_torque_design *design, float torque, float acceleration) {
    if (t->due) {
        return;
    }
    t->filling.torque += torque;
    t->filling.acceleration += acceleration;
    t->filling.place += t->place;
    ++t->filling.ticks;
    t->due = t->filling.ticks >= design->ticks_per_second;
}

double oc_torque_update(oc_torque *t, const oc_torque_design *design, const oc_torque_tick *tick) {
    if (tick->has_torque) {
        if (!t->started) {
            start_torque(t, design);
        }
        const float torque = (float)tick->torque, acceleration = (float)tick->acceleration, speed = (float)tick->speed;
        follow_wheel(t, (float)tick->angle);
        if (speed >= design->speed_min && oc_torque_is_trusted(t, design)) {
            const float by_torque = (torque - t->terms[2] * t->place) / t->terms[1];
            t->slow_s = oc_min(t->slow_s + design->tick_s, design->memory_s);
            const float difference = oc_clamp_size(acceleration - by_torque, slow_max);
            t->slow += (difference - t->slow) * design->tick_s / t->slow_s;
        }
        if (speed >= design->speed_min && speed < design->speed_max) {
            collect_torque(t, design, torque, acceleration);
        }
    }
    return oc_torque_is_trusted(t, design) ? tick->acceleration - (double)t->slow : tick->acceleration;
}

/* Kalman update of the terms; older seconds count less. */
void oc_torque_work(oc_torque *t, const oc_torque_design *design) {
    if (!(fabsf(t->filling.acceleration) <= acceleration_max * (float)t->filling.ticks)) {
        t->filling = (oc_torque_second){0};
        t->due = 0;
        return;
    }
    const float share = 1.0f / (float)t->filling.ticks;
    const float by[OC_TORQUE_TERMS] = {1.0f, share * t->filling.acceleration, share * t->filling.place};
    const float torque = share * t->filling.torque;
    float *p = t->covariance;
    const float across[OC_TORQUE_TERMS] = {
        p[0] + p[1] * by[1] + p[3] * by[2],
        p[1] + p[2] * by[1] + p[4] * by[2],
        p[3] + p[4] * by[1] + p[5] * by[2],
    };
    /* a restored covariance need not be one */
    const float variance = oc_max(across[0] + across[1] * by[1] + across[2] * by[2], 0.0f) +
                           prior_variance(design, second_sd);
    const float predicted = t->terms[0] + t->terms[1] * by[1] + t->terms[2] * by[2];
    const float error = oc_clamp_size(torque - predicted, error_max_share * design->slope);
    const float grow = 1.0f + 1.0f / torque_memory_s;
    const float sd[OC_TORQUE_TERMS] = {design->constant_sd, 0.5f, friction_sd}; /* g within half of its prior */
    float *cell = p;
    for (int32_t row = 0; row < OC_TORQUE_TERMS; ++row) {
        t->terms[row] = oc_clamp_size(t->terms[row] + across[row] / variance * error, term_max);
        for (int32_t column = 0; column <= row; ++column, ++cell) {
            *cell -= across[row] * across[column] / variance;
            *cell *= row == column && *cell < prior_variance(design, sd[row]) ? grow : 1.0f;
        }
    }
    t->terms[2] = oc_max(t->terms[2], 0.0f);
    t->filling = (oc_torque_second){0};
    t->due = 0;
}

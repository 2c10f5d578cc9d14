#include "assignment.h"

#include <math.h>

#include "bounds.h"

enum { SWA, YAW, VXS, AYS }; /* the watched signals */
enum { LEVEL_STEPS = OC_STEPS_PER_SECOND / 2 }; /* in the mean of a level: half a second */

/* Tuned, in tuned.toml: assignment */
static const float compared_speed = 2.0f; /* m/s: minimum speed of the comparison */
static const float slow_speed = 14.0f; /* m/s: maximum speed of the comparison of sizes */
static const float with_slip_speed = 8.0f; /* m/s: minimum speed at which side slip hardly moves the accelerometer */
/* memory of the angle straight ahead, in steps, and their number from which the angle has a side */
static const float straight_steps_min = 100.0f;
static const float reverse_speed_max = 4.0f; /* m/s: maximum speed at which a truck may reverse */
/* rad/s: minimum turn against the angle of a truck that may reverse */
static const float reverse_yaw_rate_min = 0.008f;
/* of the signal: minimum of a jump in a tick: angle, yaw rate, speed, lateral acceleration */
static const float jump_min[OC_WATCHED] = {0.009f, 0.015f, 1.0f, 0.4f};
/* of the signal: minimum of a jump in a tick that no truck makes */
static const float impossible_jump[OC_WATCHED] = {0.3f, 0.04f, 1.0f, 5.0f};
/* of the signal: minimum change that a stuck signal misses */
static const float missed_min[OC_WATCHED] = {0.12f, 0.02f, 0.7f, 0.6f};
/* end */

static const int32_t first_of[OC_PAIRS] = {OC_BY_ANGLE, OC_BY_YAW_RATE, OC_BY_ANGLE, OC_BY_YAW_RATE};
static const int32_t second_of[OC_PAIRS] = {OC_BY_YAW_RATE, OC_BY_ACCELERATION, OC_BY_ACCELERATION, OC_BY_WHEELS};

float oc_assignment_speed(void) {
    return compared_speed;
}

float oc_signal_jump_min(int32_t k) {
    return jump_min[k];
}

float oc_signal_impossible_jump(int32_t k) {
    return impossible_jump[k];
}

float oc_signal_missed_min(int32_t k) {
    return missed_min[k];
}

void oc_assignment_setup(oc_assignment_design *design, double ratio_times_wheelbase, float product_doubt, double track,
                         double rate_hz) {
    const double default_track = 1.9; /* m, as gyro_bias.c */
    const int32_t ticks = (int32_t)(rate_hz / (double)OC_STEPS_PER_SECOND + 0.5);
    *design = (oc_assignment_design){
        .ratio_times_wheelbase = (float)ratio_times_wheelbase,
        .per_ratio_times_wheelbase = (float)(1.0 / ratio_times_wheelbase),
        .product_doubt = product_doubt,
        .per_track = (float)(1.0 / (track > 0.0 ? track : default_track)),
        .tick_s = (float)(1.0 / rate_hz),
        .step_s = (float)(ticks / rate_hz),
        .ticks_per_step = ticks,
    };
}

static void watch_signal(oc_assignment *a, int32_t k, uint32_t bit, float value) {
    if (((uint32_t)a->started & bit) == 0) {
        a->started = (int32_t)((uint32_t)a->started | bit);
        oc_signal_watch_begin(&a->watches[k], value, jump_min[k]);
    } else {
        oc_signal_watch_update(&a->watches[k], value, impossible_jump[k]);
    }
    a->sums[k] += value;
    ++a->valid_ticks[k];
}

static void add_wheels(oc_assignment *a, const oc_signals *tick) {
    const uint32_t rear = OC_HAS_WHEEL_SPEED_REAR_LEFT | OC_HAS_WHEEL_SPEED_REAR_RIGHT;
    if ((tick->valid & rear) == rear) {
        const float left = (float)tick->wheel_speed_rear_left, right = (float)tick->wheel_speed_rear_right;
        a->wheel_difference += right - left;
        a->wheel_mean += 0.5f * (left + right);
        ++a->wheel_ticks;
    }
}

/* The means of a step's ticks, where all of them have the signal. */
typedef struct {
    float of[OC_WATCHED], wheel_difference, wheel_mean;
    bool has[OC_WATCHED], has_wheels;
} step_means;

static void take_means(oc_assignment *a, const oc_assignment_design *d, step_means *step) {
    const float ticks = (float)a->ticks;
    for (int32_t k = 0; k < OC_WATCHED; ++k) {
        const float valid = (float)a->valid_ticks[k];
        step->has[k] = a->valid_ticks[k] == a->ticks;
        step->of[k] = step->has[k] ? a->sums[k] / ticks : 0.0f;
        if (valid > 0.0f) {
            oc_signal_watch_end_step(&a->watches[k], jump_min[k], valid, valid * d->tick_s);
        }
        a->sums[k] = 0.0f;
        a->valid_ticks[k] = 0;
    }
    step->has_wheels = a->wheel_ticks == a->ticks;
    step->wheel_difference = a->wheel_difference / ticks;
    step->wheel_mean = a->wheel_mean / ticks;
    a->wheel_difference = a->wheel_mean = 0.0f;
    a->ticks = a->wheel_ticks = 0;
}

/* Each signal as the others predict it. */
static void follow_levels(oc_assignment *a, const oc_assignment_design *d, const step_means *step) {
    const float *mean = step->of;
    const float v = mean[VXS];
    const bool fast = step->has[VXS] && v > compared_speed;
    const float predictions[OC_WATCHED] = {fast ? mean[YAW] * d->ratio_times_wheelbase / v : 0.0f,
                                           mean[SWA] * v * d->per_ratio_times_wheelbase, step->wheel_mean,
                                           mean[YAW] * v};
    const bool has[OC_WATCHED] = {fast && step->has[YAW], fast && step->has[SWA],
                                  fast && step->has_wheels, fast && step->has[YAW]};
    a->level_steps += 1;
    const bool mean_ends = a->level_steps >= LEVEL_STEPS;
    for (int32_t k = 0; k < OC_WATCHED; ++k) {
        oc_signal_level_follow(&a->levels[k], &a->watches[k], (float)a->watches[k].held_ticks * d->tick_s, d->step_s,
                               has[k], predictions[k], missed_min[k]);
        a->level_sums[k] += mean[k];
        if (mean_ends) {
            oc_signal_level_add(&a->levels[k], a->level_sums[k] / (float)LEVEL_STEPS);
            a->level_sums[k] = 0.0f;
        }
    }
    a->level_steps = mean_ends ? 0 : a->level_steps;
}

/* Where the angle ends, and for how long it is there. */
static void follow_range(oc_assignment *a, const oc_assignment_design *d, const step_means *step) {
    const float angle = a->watches[SWA].last;
    if (!step->has[SWA] || !step->has[VXS] || step->of[VXS] < compared_speed) {
        return;
    }
    a->at_low_s = angle < a->range_low ? 0.0f : angle > a->range_low ? a->at_low_s : a->at_low_s + d->step_s;
    a->at_high_s = angle > a->range_high ? 0.0f : angle < a->range_high ? a->at_high_s : a->at_high_s + d->step_s;
    a->range_low = oc_min(angle, a->range_low);
    a->range_high = oc_max(angle, a->range_high);
}

/* The angle while the truck hardly turns: by another zero the speed's changes would look like steering. */
static float follow_straight_angle(oc_assignment *a, float angle, bool has, float lateral) {
    if (has && fabsf(lateral) < oc_signal_side()) {
        a->straight_steps = oc_min(a->straight_steps + 1.0f, straight_steps_min);
        a->straight_angle += (angle - a->straight_angle) / a->straight_steps;
    }
    return a->straight_angle;
}

/* Whether it has changed recently: a signal that is slow, coarse or stuck shows no motion. */
static bool shows_motion(const oc_assignment *a, const oc_assignment_design *d, const step_means *step, int32_t k) {
    return step->has[k] && (float)a->watches[k].held_ticks * d->tick_s < 0.5f;
}

/* Whether the truck yaws against its angle at low speed: it may reverse with an unsigned speed. `by_angle`: rad/s. */
static bool may_reverse(oc_assignment *a, float v, float by_angle, float yaw_rate) {
    const bool known = a->straight_steps >= straight_steps_min;
    const bool turns = known && oc_min(fabsf(by_angle), fabsf(yaw_rate)) > reverse_yaw_rate_min;
    const bool slow = v < reverse_speed_max;
    const bool against = by_angle * yaw_rate < 0.0f;
    a->against_steps = !slow || (turns && !against) ? 0 : a->against_steps + (turns ? 1 : 0);
    return a->against_steps >= OC_STEPS_PER_SECOND;
}

/* The lateral acceleration by each signal; of none where the truck may reverse. */
static void compare_motion(oc_assignment *a, const oc_assignment_design *d, const step_means *step) {
    const float *mean = step->of;
    const float v = mean[VXS], by_yaw_rate = mean[YAW] * v;
    const float by_turned = (mean[SWA] - a->straight_angle) * v * d->per_ratio_times_wheelbase; /* rad/s; 0: no angle */
    const bool backward = may_reverse(a, v, step->has[SWA] ? by_turned : 0.0f, mean[YAW]);
    const bool rolls = step->has[VXS] && v > compared_speed && !backward;
    const bool steers = rolls && shows_motion(a, d, step, SWA), turns = rolls && shows_motion(a, d, step, YAW);
    const bool leans = rolls && shows_motion(a, d, step, AYS);
    const float turned = mean[SWA] - follow_straight_angle(a, mean[SWA], steers && turns, by_yaw_rate);
    const float by_angle = turned * v * v * d->per_ratio_times_wheelbase;
    const float by_wheels = step->wheel_difference * v * d->per_track;
    oc_witness *w = a->witnesses;
    oc_witness_add(&w[OC_BY_ANGLE], a->place, steers && a->straight_steps > 0.0f, mean[SWA], by_angle, d->step_s);
    oc_witness_add(&w[OC_BY_YAW_RATE], a->place, turns, mean[YAW], by_yaw_rate, d->step_s);
    oc_witness_add(&w[OC_BY_ACCELERATION], a->place, leans, mean[AYS], mean[AYS], d->step_s);
    oc_witness_add(&w[OC_BY_WHEELS], a->place, rolls && step->has_wheels, by_wheels, by_wheels, d->step_s);
    for (int32_t p = 0; p < OC_PAIRS; ++p) {
        const bool with_acceleration = second_of[p] == OC_BY_ACCELERATION;
        const bool slow = v < slow_speed && (!with_acceleration || v > with_slip_speed);
        oc_signal_pair_add(&a->pairs[p], &w[first_of[p]], &w[second_of[p]], a->place, slow);
    }
    a->place = (a->place + 1) & (OC_MEAN_RING - 1);
}

void oc_assignment_compare(oc_pair_comparison *comparison, const oc_assignment *a, int32_t p, float step_s) {
    oc_signal_pair_compare(comparison, &a->pairs[p], &a->witnesses[first_of[p]], &a->witnesses[second_of[p]], step_s);
}

/* A fault that nothing shows any more ends. */
static void recover(oc_assignment *a, float step_s) {
    a->recovering_s -= step_s;
    if (!(a->recovering_s > 0.0f)) {
        a->fault = OC_SIGNAL_FAULT_NONE;
        a->at_fault = 0;
    }
}

static void end_assignment_step(oc_assignment *a, const oc_assignment_design *d) {
    step_means step;
    take_means(a, d, &step);
    follow_levels(a, d, &step);
    follow_range(a, d, &step);
    compare_motion(a, d, &step);
    recover(a, d->step_s);
    if (--a->steps_to_judge <= 0) {
        a->steps_to_judge = OC_STEPS_PER_SECOND;
        oc_assignment_judge(a, d);
    }
}

void oc_assignment_update(oc_assignment *a, const oc_assignment_design *d, const oc_signals *tick, uint32_t sent) {
    const float values[OC_WATCHED] = {(float)tick->steering_wheel_angle, (float)tick->yaw_rate,
                                      (float)tick->vehicle_speed, (float)tick->lateral_acceleration};
    for (int32_t k = 0; k < OC_WATCHED; ++k) {
        const uint32_t bit = 1u << (uint32_t)k; /* of oc_signals.valid: the watched signals are its first */
        if ((tick->valid & bit) != 0) {
            watch_signal(a, k, bit, values[k]);
        } else if ((sent & bit) != 0 && fabsf(values[k]) > 1.0f) { /* a number, not NaN */
            a->watches[k].impossible_s += d->tick_s;
        }
    }
    add_wheels(a, tick);
    if (++a->ticks >= d->ticks_per_step) {
        end_assignment_step(a, d);
    }
}

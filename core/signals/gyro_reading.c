#include "gyro_reading.h"

#include <math.h>

#include "bounds.h"

/* Numerical. */
static const double noise_min = 1e-12;         /* (rad/s)^2, against signals without noise, whose limit would stay 0 */
static const double noise_max = 1.0;           /* (rad/s)^2, of signals decoded from wrong bits */

/* Tuned, in tuned.toml: gyro_reading */
static const double wheel_speed_min = 3.0; /* m/s: minimum speed of an axle; pole wheels miss pulses below */
static const double slip_share = 0.05; /* speed difference beyond the turn's that is slip, as a share of the speed */
static const double slip_speed = 0.15; /* m/s: the same, in addition: 3 deg/s of bias, and noise */
static const double slip_turn = 0.2; /* the same, in addition, as a share of the turn's speed difference */
static const double noise_initial = 0.0017; /* rad/s: initial noise of a block, 0.1 deg/s */
static const double noise_blocks = 60.0; /* memory of that noise, in blocks */
static const double model_noise = 0.0002; /* rad/s: sd of a block that no difference shows: tyres on an uneven road */
static const double lag_share = 0.05; /* lag between gyro and wheel speeds, as a share of a block of 1 s */
static const double correlated_blocks = 6.0; /* blocks over which a rounding error of the wheel speeds persists */
/* 1/m: a block at it has the weight of the prior of the bank's slope */
static const double straights_curvature = 0.001;
static const double straights_blocks = 200.0; /* memory of the straights' mean bank, in blocks */
/* end */

static double square(double value) {
    return value * value;
}

void oc_gyro_reading_init(oc_gyro_reading *a) {
    a->noise = square(noise_initial);
}

void oc_gyro_reading_begin(oc_gyro_reading *a) {
    a->weight = a->difference = a->speed = a->yaw_rate = a->acceleration = a->flat = 0.0;
}

/* A speed difference that is constant over a tick is at a quantisation level. */
static void watch_quantum(oc_gyro_reading *a, double difference) {
    if (fabs(difference - a->last_difference) < 1e-6) {
        const double step = fabs(difference - a->plateau);
        if (step > 1e-6) {
            a->quantum = a->quantum > 0.0 && a->quantum < step ? a->quantum : step;
            a->held = 0.0;
        }
        a->plateau = difference;
        a->flat += 1.0;
    }
    a->last_difference = difference;
}

void oc_gyro_reading_add(oc_gyro_reading *a, double track, double left, double right, double yaw_rate,
                         double acceleration) {
    const double difference = right - left;
    const double speed = 0.5 * (left + right);
    const double turn = track * yaw_rate;
    if (!(speed >= wheel_speed_min) ||
        !(fabs(difference - turn) <= slip_share * speed + slip_speed + slip_turn * fabs(turn))) {
        return;
    }
    watch_quantum(a, difference);
    a->weight += 1.0;
    a->difference += difference;
    a->speed += speed;
    a->yaw_rate += yaw_rate;
    a->acceleration += acceleration;
}

/* Rounding error of a speed difference that seldom changes: it persists for longer than a block. Under noise it
 * averages out and is part of the block's noise. `flat`: share of the ticks without a change. */
static double rounding_variance(const oc_gyro_reading *a, double per_track, double flat) {
    return correlated_blocks / 12.0 * square(a->quantum * per_track * flat) * (1.0 + a->held);
}

/* Noise of a block, from the difference of two successive ones less its part explained by the state. */
static void learn_noise(oc_gyro_reading *a, double unexplained) {
    const double memory = a->blocks + 5.0 < noise_blocks ? a->blocks + 5.0 : noise_blocks;
    const double measured = 0.5 * unexplained * unexplained;
    const double outlying = OC_OUTLIER_SDS * OC_OUTLIER_SDS * (a->noise > noise_min ? a->noise : noise_min);
    const double limit = outlying < noise_max ? outlying : noise_max;
    a->noise += ((measured < limit ? measured : limit) - a->noise) / memory;
}

/* The intercept of a line over curvature whose slope has a prior about 0. */
double oc_mean_bank_of(const oc_mean_bank *straights) {
    const double squares = straights->squares + square(straights_curvature);
    const double apart = straights->blocks * squares - square(straights->curvature);
    return apart > 0.0 ? (straights->bank * squares - straights->product * straights->curvature) / apart : 0.0;
}

/* m/s^2, less the straights' bank, so that a drift of the accelerometer's zero changes no radius. */
static double without_mean_bank(oc_mean_bank *straights, double acceleration, double speed, double yaw_rate) {
    const double curvature = yaw_rate / speed, bank = acceleration - yaw_rate * speed;
    const double keep = 1.0 - 1.0 / straights_blocks;
    straights->blocks = keep * straights->blocks + 1.0;
    straights->curvature = keep * straights->curvature + curvature;
    straights->squares = keep * straights->squares + curvature * curvature;
    straights->bank = keep * straights->bank + bank;
    straights->product = keep * straights->product + bank * curvature;
    return acceleration - oc_mean_bank_of(straights);
}

void oc_gyro_reading_end(oc_gyro_reading *a, oc_mean_bank *straights, double per_track, double ticks_per_block,
                         double bias, const double *states) {
    a->innovation = 0.0;
    a->has_update = a->weight >= 0.5 * ticks_per_block;
    if (!a->has_update) {
        return;
    }
    const double per_tick = 1.0 / a->weight;
    const double v = a->speed * per_tick;
    const double r = a->yaw_rate * per_tick;
    const double reading = r - a->difference * per_tick * per_track;
    const double load = v * without_mean_bank(straights, a->acceleration * per_tick, v, r - bias);
    double late = 0.0;
    if (a->blocks > 0.0) {
        late = lag_share * (r - a->last_yaw_rate);
        const double explained = -(v - a->last_speed) * per_track * states[OC_READING_MISMATCH] -
                                 (load - a->last_load) * per_track * states[OC_READING_LOAD] -
                                 (r - a->last_yaw_rate) * states[OC_READING_SCALE];
        learn_noise(a, reading - a->last_reading - explained);
    }
    a->last_reading = reading;
    a->last_speed = v;
    a->last_load = load;
    a->last_yaw_rate = r;
    a->blocks += 1.0;
    a->held += 1.0;
    a->variance = a->noise + square(model_noise) + square(late) + rounding_variance(a, per_track, a->flat * per_tick);
}

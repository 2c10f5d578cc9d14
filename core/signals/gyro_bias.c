#include "gyro_bias.h"

#include <math.h>

#include "bounds.h"

enum { BIAS, DRIFT, FIRST_OF_AXLE };

/* Derived. */
static const double root_half = 0.70710678118654752440; /* sqrt(1/2), 1 over the sd of two innovations' difference */
static const float half_shift = 0.5f; /* sd: slack of a CUSUM that is to find a shift of one sd */
static const double alarm_drift = 1.5e-4;               /* rad/s^2: 0.5 deg/s/min, the drift of Figure 17 */

/* Numerical. */
static const double state_max = 10.0; /* rad/s, as signals.c; all other states are far smaller */
static const double prediction_s_max = 3600.0; /* against unbounded variances after a long gap */

/* Tuned, in tuned.toml: gyro_bias */
static const double track_default = 1.9; /* m: track width where the vehicle file has none */
static const double track_default_sd = 0.1; /* sd of that width, as a share */
static const double signal_lost_s = 60.0; /* s: without lateral acceleration until r v plus the mean bank replaces it */
static const double standstill_blocks_max = 10.0; /* the k-th block of a standstill has the weight 1/k, up to this k */
static const double standstill_spread_max = 0.01; /* rad/s: maximum spread of a block */
static const double model_share = 0.02; /* sd of a block's reading, as a share of the turn */
static const float cusum_limit = 8.0f; /* sd: sum that raises an alarm */
static const double alarm_bias = 0.0035; /* rad/s: sd that an alarm adds to the bias, 0.2 deg/s */
static const double alarm_mismatch = 0.0005; /* sd that an alarm adds to the mismatch of the radii */
/* change of one axle's mismatch against the other's that a leaking tyre causes */
static const double leak_min = 0.0006;
static const double leak_wander = 0.0005; /* random walk of a leaking axle's mismatch in a minute */
static const double identified_s = 60.0; /* s: wheel speeds until then */
static const double alarm_radii_share = 0.1; /* of bias and drift, where the radii changed */
static const double alarm_s_min = 15.0; /* s: minimum length of an alarm */
/* end */

bool oc_gyro_bias_alarmed(const oc_gyro_bias *state) {
    return state->alarm_blocks > 0.0;
}

static int state_of(int32_t axle, int which) {
    return FIRST_OF_AXLE + OC_READING_STATES * axle + which;
}

/* A block is a second. The filter processes it step by step, one between two ticks, to limit the peak load. */
enum { NOTHING_DUE, CONCLUSION_DUE, FRONT_DUE, REAR_DUE, PREDICTION_DUE = OC_GYRO_BIAS_PIECES };

static double squared(double value) {
    return value * value;
}

void oc_gyro_bias_setup(oc_gyro_bias_design *design, const oc_vehicle *vehicle, const oc_params *params,
                        double rate_hz) {
    const double tracks[OC_AXLE_COUNT] = {vehicle->track_width_rear, vehicle->track_width_front};
    *design = (oc_gyro_bias_design){
        .tick_s = 1.0 / rate_hz,
        .ticks_per_block = rate_hz,
        .settling_ticks = (int32_t)(params->standstill_settling_s * rate_hz + 0.5),
        .lost_ticks = (int32_t)(signal_lost_s * rate_hz),
        .standing_ticks = params->standstill_time_min_s * rate_hz,
    };
    for (int32_t axle = 0; axle < OC_AXLE_COUNT; ++axle) {
        const bool has_width = tracks[axle] > 0.0;
        design->track[axle] = has_width ? tracks[axle] : track_default;
        design->per_track[axle] = 1.0 / design->track[axle];
        design->track_sd[axle] = has_width ? params->track_width_sd_1 : track_default_sd;
    }
}

void oc_gyro_bias_restart(oc_gyro_bias *state, double off_s) {
    state->running = 0;
    state->off_s = off_s > 0.0 ? state->off_s + off_s : state->off_s;
}

static void reset_block(oc_gyro_bias *state) {
    state->block_ticks = 0.0;
    state->due = NOTHING_DUE;
    for (int32_t axle = 0; axle < OC_AXLE_COUNT; ++axle) {
        oc_gyro_reading_begin(&state->axles[axle]);
    }
}

/* A new drive: bias and radii may have changed. Their covariances stay, so that a radius that has changed does not look
 * like a bias. */
static void change_bias_and_radii(oc_gyro_bias *state, const oc_params *p) {
    const float off_s = (float)state->off_s;
    state->P[BIAS][BIAS] += squared(p->gyro_bias_ignition_sd_rad_s) +
                            (double)oc_variance_between_drives(OC_BETWEEN_YAW_RATE_BIAS, off_s);
    for (int32_t axle = 0; axle < OC_AXLE_COUNT; ++axle) { /* a mismatch has the changes of two wheels */
        const int m = state_of(axle, OC_READING_MISMATCH);
        state->P[m][m] += 2.0 * (double)oc_variance_between_drives(OC_BETWEEN_WHEEL_RADIUS, off_s);
    }
    for (int k = 0; k < OC_GYRO_BIAS_STATES; ++k) {
        state->P[DRIFT][k] = state->P[k][DRIFT] = 0.0;
    }
    state->past.covariance[DRIFT] = 0.0f;
    state->x[DRIFT] = 0.0;
}

/* The first tick since power-on sets the priors, the first since an ignition adds variance. */
static void begin(oc_gyro_bias *state, const oc_gyro_bias_design *design, const oc_params *p, double time) {
    if (!state->started) {
        state->started = 1;
        const bool is_known = p->known_yaw_rate_bias_sd_rad_s > 0.0;
        state->x[BIAS] = is_known ? p->known_yaw_rate_bias_rad_s : 0.0;
        state->P[BIAS][BIAS] = squared(is_known ? p->known_yaw_rate_bias_sd_rad_s : p->gyro_bias_sd_rad_s);
        for (int32_t axle = 0; axle < OC_AXLE_COUNT; ++axle) {
            const int m = state_of(axle, OC_READING_MISMATCH), l = state_of(axle, OC_READING_LOAD);
            const int s = state_of(axle, OC_READING_SCALE);
            state->P[m][m] = squared(p->wheel_radius_mismatch_sd_1);
            state->P[l][l] = squared(p->wheel_radius_load_sd_s2_m);
            state->P[s][s] = squared(design->track_sd[axle]);
            oc_gyro_reading_init(&state->axles[axle]);
        }
    } else {
        change_bias_and_radii(state, p);
    }
    state->off_s = 0.0;
    state->sd = sqrt(state->P[BIAS][BIAS]);
    state->P[DRIFT][DRIFT] = squared(p->gyro_bias_drift_standing_sd_rad_s2);
    state->has_wheels = state->has_mismatch = state->leaking = 0;
    state->leaked[OC_AXLE_REAR] = state->leaked[OC_AXLE_FRONT] = 0.0;
    state->lost_ticks = design->lost_ticks;
    state->running = 1;
    state->time = time;
    state->still_ticks = 0;
    state->still_blocks = 0.0;
    reset_block(state);
    state->still = (oc_still_mean){0};
}

/* Without wheel speeds a drift is observable only at the next standstill, so a large prior would leave the bias
 * unobservable. */
static double drift_sd(const oc_gyro_bias *state, const oc_params *p) {
    return state->has_wheels ? p->gyro_bias_drift_sd_rad_s2 : p->gyro_bias_drift_standing_sd_rad_s2;
}

/* Prediction to this time: the drift moves the bias and decays, random walks add variance. */
static void predict(oc_gyro_bias *state, const oc_params *p, double time) {
    const double passed = time - state->time;
    const double t = passed > 0.0 ? (passed < prediction_s_max ? passed : prediction_s_max) : 0.0;
    const double kept = 1.0 / (1.0 + t / p->gyro_bias_drift_time_s);
    oc_past_bias *past = &state->past;
    oc_past_bias_grow(past, state->P[BIAS]);
    past->covariance[BIAS] += (float)t * past->covariance[DRIFT];
    past->covariance[DRIFT] *= (float)kept;
    state->time = time;
    state->x[BIAS] = oc_clamp_size_double(state->x[BIAS] + t * state->x[DRIFT], state_max);
    state->x[DRIFT] *= kept;
    for (int k = 0; k < OC_GYRO_BIAS_STATES; ++k) {
        state->P[BIAS][k] += t * state->P[DRIFT][k];
        state->P[DRIFT][k] *= kept;
    }
    for (int k = 0; k < OC_GYRO_BIAS_STATES; ++k) {
        state->P[k][BIAS] += t * state->P[k][DRIFT];
        state->P[k][DRIFT] *= kept;
    }
    state->P[BIAS][BIAS] += squared(p->gyro_bias_wander_sd_rad_s) * t / 60.0;
    state->P[DRIFT][DRIFT] += squared(drift_sd(state, p)) * (1.0 - kept * kept);
    for (int32_t axle = 0; axle < OC_AXLE_COUNT; ++axle) {
        const int m = state_of(axle, OC_READING_MISMATCH);
        state->P[m][m] += squared(p->wheel_radius_wander_sd_1) * t / 3600.0;
        state->P[m][m] += state->leaking == axle + 1 ? squared(leak_wander) * t / 60.0 : 0.0;
    }
}

/* By the innovation of a reading: `Ph`, `past_covariance`: its covariances with the states and with the past error. */
static void update(oc_gyro_bias *state, const double *Ph, float past_covariance, double innovation,
                   double per_variance) {
    for (int j = 0; j < OC_GYRO_BIAS_STATES; ++j) {
        const double gain = Ph[j] * per_variance;
        state->x[j] = oc_clamp_size_double(state->x[j] + gain * innovation, state_max);
        for (int k = 0; k <= j; ++k) {
            state->P[j][k] -= gain * Ph[k];
            state->P[k][j] = state->P[j][k];
        }
    }
    oc_past_bias_correct(&state->past, past_covariance, Ph, (float)innovation, (float)per_variance);
}

/* Measurement update by a reading of h'x with variance R. Returns the innovation over its predicted sd. Beyond
 * OC_OUTLIER_SDS the innovation's square replaces its variance. `h` has an axle's states; the bias has h = 1. */
static double correct(oc_gyro_bias *state, int32_t axle, const double *h, double reading, double R) {
    const int first = state_of(axle, 0);
    double Ph[OC_GYRO_BIAS_STATES];
    float past_covariance = state->past.covariance[BIAS];
    for (int j = 0; j < OC_GYRO_BIAS_STATES; ++j) {
        Ph[j] = state->P[j][BIAS];
        for (int k = 0; k < OC_READING_STATES; ++k) {
            Ph[j] += state->P[j][first + k] * h[k];
        }
    }
    double hPh = Ph[BIAS], expected = state->x[BIAS];
    for (int k = 0; k < OC_READING_STATES; ++k) {
        hPh += h[k] * Ph[first + k];
        past_covariance += (float)h[k] * state->past.covariance[first + k];
        expected += h[k] * state->x[first + k];
    }
    const double innovation = reading - expected;
    const double S = hPh + R;
    const double beyond = squared(innovation * (1.0 / OC_OUTLIER_SDS));
    update(state, Ph, past_covariance, innovation, 1.0 / (beyond > S ? beyond : S));
    return innovation / sqrt(S);
}

static void update_status(oc_gyro_bias *state, const oc_params *p) {
    const double sd = state->sd = sqrt(state->P[BIAS][BIAS]);
    if (!(state->evidence > 0.0) || sd > 0.5 * p->gyro_bias_sd_rad_s) {
        state->status = OC_UNOBSERVABLE;
        return;
    }
    state->status = oc_gyro_bias_alarmed(state)
                        ? OC_INVALID
                        : oc_status_next(state->status, sd, p->gyro_bias_half_width_max_rad_s);
}

/* At standstill a block's mean is the bias; a state far from it has changed. The blocks of a standstill share the error
 * oc_standstill_shared_variance, so the k-th has the weight 1/k. The limit of k lets the filter follow a drift. */
static void learn_from_standstill(oc_gyro_bias *state, const oc_params *p, double time, double tick_s) {
    static const double none[OC_READING_STATES] = {0.0};
    const double n = state->still.weight;
    if (state->still.squares <= squared(standstill_spread_max) * n) {
        predict(state, p, time);
        state->still_blocks += state->still_blocks < standstill_blocks_max ? 1.0 : 0.0;
        const double R = oc_standstill_shared_variance(state->creep) * state->still_blocks +
                         oc_still_mean_variance(&state->still);
        const double innovation = state->still.mean - state->x[BIAS];
        const double S = state->P[BIAS][BIAS] + R;
        if (innovation * innovation > OC_OUTLIER_SDS * OC_OUTLIER_SDS * S) {
            state->P[BIAS][BIAS] += innovation * innovation;
        }
        (void)correct(state, OC_AXLE_REAR, none, state->still.mean, R);
        state->alarm_blocks = 0.0;
        state->evidence += n * tick_s;
        update_status(state, p);
    }
    state->still = (oc_still_mean){0};
    state->creep = 0.0;
}

static bool has_rolling_wheels(const oc_signals *tick, double speed_max) {
    const uint32_t left = tick->valid & OC_HAS_WHEEL_SPEED_REAR_LEFT;
    const uint32_t right = tick->valid & OC_HAS_WHEEL_SPEED_REAR_RIGHT;
    return (left && fabs(tick->wheel_speed_rear_left) > speed_max) ||
           (right && fabs(tick->wheel_speed_rear_right) > speed_max);
}

static void watch_standstill(oc_gyro_bias *state, const oc_gyro_bias_design *design, const oc_params *p,
                             const oc_signals *tick, double creep) {
    if (!(tick->valid & OC_HAS_VEHICLE_SPEED) || !(fabs(tick->vehicle_speed) <= p->standstill_speed_max_m_s) ||
        has_rolling_wheels(tick, p->standstill_speed_max_m_s)) {
        if (state->still_ticks > 0) {
            state->still_ticks = 0;
            state->still_blocks = 0.0;
            state->still = (oc_still_mean){0};
            state->creep = 0.0;
        }
        return;
    }
    if (state->still_ticks < design->settling_ticks) {
        ++state->still_ticks;
        return;
    }
    state->still_ticks = design->settling_ticks + 1;
    oc_still_mean_add(&state->still, tick->yaw_rate, 1.0);
    state->creep = creep > state->creep ? creep : state->creep;
    if (state->still.weight >= design->standing_ticks) {
        learn_from_standstill(state, p, tick->time, design->tick_s);
    }
}

/* Two-sided. True when a sum exceeds the limit, which resets both. */
static bool cusum(oc_gyro_bias_cusum *sums, double innovation) {
    const float s = (float)oc_clamp_size_double(innovation, 0.5 * (double)cusum_limit); /* one alone raises no alarm */
    const float up = sums->up + s - half_shift, down = sums->down - s - half_shift;
    const bool exceeds = up > cusum_limit || down > cusum_limit;
    sums->up = up > 0.0f && !exceeds ? up : 0.0f;
    sums->down = down > 0.0f && !exceeds ? down : 0.0f;
    return exceeds;
}

/* Adds variance to bias and drift; `share` of a full alarm's sd. */
static void raise_alarm(oc_gyro_bias *state, double share) {
    if (!(state->alarm_blocks > 0.0)) {
        state->alarm_variance = state->P[BIAS][BIAS];
    }
    state->alarm_blocks = 1.0;
    state->P[BIAS][BIAS] += squared(share * alarm_bias);
    state->P[DRIFT][DRIFT] += squared(share * alarm_drift);
}

static void inflate_mismatch(oc_gyro_bias *state, int32_t axle) {
    const int m = state_of(axle, OC_READING_MISMATCH);
    state->P[m][m] += squared(alarm_mismatch);
}

/* Common innovation: the bias changed, or the radii of the axle with the larger innovation. The other axle separates
 * both cases. */
static void watch_bias(oc_gyro_bias *state, double rear, double front, double axles) {
    if (cusum(&state->common, (rear + front) / sqrt(axles))) {
        raise_alarm(state, 1.0);
        inflate_mismatch(state, fabs(rear) >= fabs(front) ? OC_AXLE_REAR : OC_AXLE_FRONT);
    }
}

/* Opposite innovations: a tyre loses air or warms up, and the bias is between both axles' readings. */
static void watch_radii(oc_gyro_bias *state, double rear, double front) {
    if (cusum(&state->opposite, (rear - front) * root_half)) {
        raise_alarm(state, alarm_radii_share);
        inflate_mismatch(state, OC_AXLE_REAR);
        inflate_mismatch(state, OC_AXLE_FRONT);
    }
}

static double moved_mismatch(const oc_gyro_bias *state, int32_t axle) {
    return state->x[state_of(axle, OC_READING_MISMATCH)] - state->mismatch_before[axle];
}

/* Measurement update: the axle's mismatch is still the one before. */
static void take_as_unchanged(oc_gyro_bias *state, int32_t axle) {
    const int m = state_of(axle, OC_READING_MISMATCH);
    double Ph[OC_GYRO_BIAS_STATES];
    for (int j = 0; j < OC_GYRO_BIAS_STATES; ++j) {
        Ph[j] = state->P[j][m];
    }
    const double variance = Ph[m] + squared(leak_min / OC_OUTLIER_SDS);
    update(state, Ph, state->past.covariance[m], -moved_mismatch(state, axle), 1.0 / variance);
}

static void keep_mismatches(oc_gyro_bias *state) {
    for (int32_t axle = 0; axle < OC_AXLE_COUNT; ++axle) {
        state->mismatch_before[axle] = state->x[state_of(axle, OC_READING_MISMATCH)];
    }
    state->bias_before = state->x[BIAS];
}

/* rad/s, change of the bias if the axle's mismatch is the one before. */
static double bias_change_with(const oc_gyro_bias *state, int32_t axle) {
    const int m = state_of(axle, OC_READING_MISMATCH);
    return state->x[BIAS] - state->bias_before - state->P[BIAS][m] / state->P[m][m] * moved_mismatch(state, axle);
}

/* The other axle leaves the bias where it was. */
static int32_t leaking_axle(const oc_gyro_bias *state) {
    const double by_rear = fabs(bias_change_with(state, OC_AXLE_REAR));
    const double by_front = fabs(bias_change_with(state, OC_AXLE_FRONT));
    return state->leaking != 0 ? state->leaking - 1 : by_rear < by_front ? OC_AXLE_FRONT : OC_AXLE_REAR;
}

/* Both axles' mismatches change alike with the bias, so their difference shows a radius alone. */
static void watch_leak(oc_gyro_bias *state) {
    const int rear = state_of(OC_AXLE_REAR, OC_READING_MISMATCH), front = state_of(OC_AXLE_FRONT, OC_READING_MISMATCH);
    if (!state->has_mismatch) {
        const double variance = state->P[rear][rear] + state->P[front][front] - 2.0 * state->P[rear][front];
        state->has_mismatch = state->wheel_evidence > identified_s && variance < squared(leak_min / OC_OUTLIER_SDS);
        keep_mismatches(state);
        return;
    }
    const double moved = moved_mismatch(state, OC_AXLE_REAR) - moved_mismatch(state, OC_AXLE_FRONT);
    if (fabs(moved) < leak_min) {
        return;
    }
    const int32_t leaks = leaking_axle(state);
    take_as_unchanged(state, leaks == OC_AXLE_REAR ? OC_AXLE_FRONT : OC_AXLE_REAR);
    state->leaking = leaks + 1;
    state->leaked[leaks] += leaks == OC_AXLE_REAR ? moved : -moved;
    keep_mismatches(state);
}

/* An alarm ends when no CUSUM has exceeded its limit for alarm_s_min and the bias is about as certain as before. */
static void watch_alarm(oc_gyro_bias *state, const oc_params *p) {
    const double narrow = squared(p->gyro_bias_half_width_max_rad_s / 1.96);
    const double again = 2.0 * state->alarm_variance;
    if (!(state->alarm_blocks > 0.0)) {
        return;
    }
    state->alarm_blocks += 1.0;
    state->alarm_time += 1.0;
    if (state->alarm_blocks > alarm_s_min && state->P[BIAS][BIAS] <= (again > narrow ? again : narrow)) {
        state->alarm_blocks = 0.0;
    }
}

static void learn_axle(oc_gyro_bias *state, const oc_gyro_bias_design *design, int32_t axle) {
    oc_gyro_reading *a = &state->axles[axle];
    if (!a->has_update) {
        return;
    }
    const double per_track = design->per_track[axle];
    const double turn = a->last_yaw_rate - state->x[BIAS];
    const double h[OC_READING_STATES] = {
        [OC_READING_MISMATCH] = -a->last_speed * per_track,
        [OC_READING_LOAD] = -a->last_load * per_track,
        [OC_READING_SCALE] = -turn,
    };
    a->innovation = correct(state, axle, h, a->last_reading, a->variance + squared(model_share * turn));
}

static void conclude_block(oc_gyro_bias *state, const oc_params *p) {
    const oc_gyro_reading *rear = &state->axles[OC_AXLE_REAR], *front = &state->axles[OC_AXLE_FRONT];
    const int32_t axles = rear->has_update + front->has_update;
    if (axles > 0) {
        state->evidence += 1.0;
        state->wheel_evidence += 1.0;
        watch_bias(state, rear->innovation, front->innovation, (double)axles);
    }
    if (axles == OC_AXLE_COUNT) {
        watch_radii(state, rear->innovation, front->innovation);
        watch_leak(state);
    }
    watch_alarm(state, p);
    update_status(state, p);
}

static void end_block(oc_gyro_bias *state, const oc_gyro_bias_design *design, double time) {
    for (int32_t axle = 0; axle < OC_AXLE_COUNT; ++axle) {
        oc_gyro_reading_end(&state->axles[axle], &state->straights, design->per_track[axle], design->ticks_per_block,
                            state->x[BIAS], &state->x[state_of(axle, 0)]);
    }
    reset_block(state);
    state->block_time = time;
    state->due = PREDICTION_DUE;
}

void oc_gyro_bias_work(oc_gyro_bias *state, const oc_gyro_bias_design *design, const oc_params *p) {
    switch (state->due--) {
    case PREDICTION_DUE: predict(state, p, state->block_time); break;
    case REAR_DUE: learn_axle(state, design, OC_AXLE_REAR); break;
    case FRONT_DUE: learn_axle(state, design, OC_AXLE_FRONT); break;
    default: conclude_block(state, p); break;
    }
}

/* Whether the load transfer is available. In a short gap of the accelerometer it is not, since the bank there may
 * differ from the mean. */
static bool has_load(oc_gyro_bias *state, const oc_gyro_bias_design *design, bool has_acceleration) {
    if (has_acceleration) {
        state->lost_ticks = 0;
        return true;
    }
    if (state->lost_ticks < design->lost_ticks) {
        ++state->lost_ticks;
        return false;
    }
    return true;
}

static const uint32_t wheels[OC_AXLE_COUNT] = {
    [OC_AXLE_REAR] = OC_HAS_WHEEL_SPEED_REAR_LEFT | OC_HAS_WHEEL_SPEED_REAR_RIGHT,
    [OC_AXLE_FRONT] = OC_HAS_WHEEL_SPEED_FRONT_LEFT | OC_HAS_WHEEL_SPEED_FRONT_RIGHT,
};

static void add_readings(oc_gyro_bias *state, const oc_gyro_bias_design *design, const oc_signals *tick) {
    for (int32_t axle = 0; axle < OC_AXLE_COUNT; ++axle) {
        const double *left = axle == OC_AXLE_REAR ? &tick->wheel_speed_rear_left : &tick->wheel_speed_front_left;
        if ((tick->valid & wheels[axle]) == wheels[axle]) {
            oc_gyro_reading_add(&state->axles[axle], design->track[axle], left[0], left[1], tick->yaw_rate,
                                tick->lateral_acceleration);
        }
    }
}

void oc_gyro_bias_update(oc_gyro_bias *state, const oc_gyro_bias_design *design, const oc_params *params,
                         const oc_signals *tick, double creep) {
    if (!(tick->valid & OC_HAS_YAW_RATE)) {
        return;
    }
    if (!state->running) {
        begin(state, design, params, tick->time);
    }
    const bool has_wheels = (tick->valid & (wheels[OC_AXLE_REAR] | wheels[OC_AXLE_FRONT])) != 0;
    if (has_wheels && !state->has_wheels) {
        state->has_wheels = 1;
        state->P[DRIFT][DRIFT] += squared(params->gyro_bias_drift_first_sd_rad_s2);
    }
    watch_standstill(state, design, params, tick, creep);
    const bool has_acceleration = params->use_accelerometer != 0 && (tick->valid & OC_HAS_LATERAL_ACCELERATION) != 0;
    if (has_load(state, design, has_acceleration) && has_wheels) {
        add_readings(state, design, tick);
    }
    state->block_ticks += 1.0;
    if (state->block_ticks >= design->ticks_per_block) {
        end_block(state, design, tick->time);
    }
}

oc_estimate oc_gyro_bias_get(const oc_gyro_bias *state, const oc_params *params) {
    if (!state->started) {
        return (oc_estimate){.standard_deviation = params->gyro_bias_sd_rad_s};
    }
    return (oc_estimate){
        .value = state->x[BIAS],
        .standard_deviation = state->sd,
        .evidence = state->evidence,
        .status = state->status,
    };
}

double oc_gyro_bias_leaked(const oc_gyro_bias *state, int32_t axle) {
    return state->leaked[axle];
}

oc_estimate oc_gyro_bias_mismatch(const oc_gyro_bias *state, const oc_params *params, int32_t axle) {
    const int m = state_of(axle, OC_READING_MISMATCH);
    const double prior = params->wheel_radius_mismatch_sd_1;
    if (!state->started || !(state->axles[axle].blocks > 0.0)) {
        return (oc_estimate){.standard_deviation = prior};
    }
    const double sd = sqrt(state->P[m][m]);
    return (oc_estimate){
        .value = state->x[m] - state->x[state_of(axle, OC_READING_LOAD)] * oc_mean_bank_of(&state->straights),
        .standard_deviation = sd,
        .evidence = state->axles[axle].blocks,
        .status = sd > 0.5 * prior ? OC_UNOBSERVABLE : OC_VALID,
    };
}

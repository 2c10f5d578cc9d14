#include "gyro_bias.h"

#include <math.h>

enum { BIAS, DRIFT, FIRST_OF_AXLE };
enum { MISMATCH, LOAD, SCALE, STATES_OF_AXLE };

/* Ours, from simulated and real drives. */
static const double block_s = 1.0;
static const double usual_track = 1.9;         /* m, where the vehicle file has none */
static const double usual_track_sd = 0.1;      /* of it */
static const double wheel_speed_min = 3.0;     /* m/s; slower, pole wheels miss pulses */
static const double longest_prediction = 3600.0; /* s; a longer hole tells no more */
static const double silent_s = 60.0;           /* of an accelerometer, or from the first tick on: what is usual tells */
static const double slip_share = 0.05;         /* of the speed: more between two wheels is no radius, but slip */
static const double slip_speed = 0.15;         /* m/s, besides: 3 deg/s of bias, and noise */
static const double slip_turn = 0.2;           /* of the turn's own difference, besides */
static const double standing_floor = 3.5e-4;   /* rad/s, 0.02 deg/s: what no standing averages away */
static const double standing_alike = 10.0;     /* neighbouring ticks that say the same thing again */
static const double standing_blocks = 10.0;    /* after which a block of one standstill adds no less */
static const double standing_spread = 0.01;    /* rad/s; more is a truck that rolls or is shaken */
static const double rolling_speed = 0.3;       /* m/s of a wheel while the truck is said to stand */
static const double first_noise = 0.0017;      /* rad/s of a block, 0.1 deg/s */
static const double least_noise = 1e-12;       /* (rad/s)^2, that one grows from: signals without any have been */
static const double noise_blocks = 60.0;       /* memory */
static const double model_noise = 2e-4;        /* rad/s of a block: tyres on an uneven road */
static const double model_share = 0.02;        /* of the turn, besides */
static const double lag = 0.05;                /* s, by which gyro and wheels may be apart */
static const double quantum_alike = 6.0;       /* blocks that a rounding error outlasts */
static const double outlier = 3.0;             /* standard deviations; beyond them a block weighs less */
static const float cusum_slack = 0.5f, cusum_limit = 8.0f; /* standard deviations */
static const double cusum_clip = 4.0;
static const double alarm_bias = 3.5e-3;       /* rad/s, 0.2 deg/s: what is open again after an alarm */
static const double alarm_drift = 1.5e-4;      /* rad/s^2, 0.5 deg/s/min */
static const double alarm_mismatch = 5e-4;
static const double alarm_share_of_radii = 0.1; /* of what is open again of bias and drift, where radii moved */
static const double root_half = 0.70710678118654752440;
static const double alarm_over = 1.5;          /* of the variance before the alarm */
static const double alarm_least = 15.0;        /* s */

bool oc_gyro_bias_alarmed(const oc_gyro_bias *state) {
    return state->alarm_blocks > 0.0;
}

static int state_of(int32_t axle, int which) {
    return FIRST_OF_AXLE + STATES_OF_AXLE * axle + which;
}

/* A block that ended is learned from in steps, a tick each, so that no tick is a spike. */
enum { NOTHING_DUE, REST_DUE, CONCLUSION_DUE, FRONT_DUE, REAR_DUE, PREDICTION_DUE };

static double squared(double value) {
    return value * value;
}

void oc_gyro_bias_setup(oc_gyro_bias_design *design, const oc_vehicle *vehicle, const oc_params *params,
                        double rate_hz) {
    const double tracks[OC_AXLE_COUNT] = {vehicle->track_width_rear, vehicle->track_width_front};
    *design = (oc_gyro_bias_design){
        .tick_s = 1.0 / rate_hz,
        .ticks_per_block = block_s * rate_hz,
        .settling_ticks = (int32_t)(params->standstill_settling_s * rate_hz + 0.5),
        .silent_ticks = (int32_t)(silent_s * rate_hz),
        .standing_ticks = params->standstill_time_min_s * rate_hz,
    };
    for (int32_t axle = 0; axle < OC_AXLE_COUNT; ++axle) {
        const bool known = tracks[axle] > 0.0;
        design->track[axle] = known ? tracks[axle] : usual_track;
        design->per_track[axle] = 1.0 / design->track[axle];
        design->track_sd[axle] = known ? params->track_width_sd_1 : usual_track_sd;
    }
}

void oc_gyro_bias_restart(oc_gyro_bias *state) {
    state->running = 0;
}

static void forget_block(oc_gyro_bias *state) {
    state->block_ticks = 0.0;
    state->due = NOTHING_DUE;
    for (int32_t axle = 0; axle < OC_AXLE_COUNT; ++axle) {
        oc_gyro_bias_axle *a = &state->axles[axle];
        a->weight = a->difference = a->speed = a->yaw_rate = a->acceleration = a->flat = 0.0;
    }
}

static void forget_standing(oc_gyro_bias *state) {
    state->still = state->still_yaw_rate = state->still_squares = 0.0;
}

/* The first tick since power-on finds the priors, the first since ignition a bias that may have moved. */
static void begin(oc_gyro_bias *state, const oc_gyro_bias_design *design, const oc_params *p, double time) {
    if (!state->started) {
        state->started = 1;
        state->P[BIAS][BIAS] = squared(p->gyro_bias_sd_rad_s);
        for (int32_t axle = 0; axle < OC_AXLE_COUNT; ++axle) {
            const int m = state_of(axle, MISMATCH), l = state_of(axle, LOAD), s = state_of(axle, SCALE);
            state->P[m][m] = squared(p->wheel_radius_mismatch_sd_1);
            state->P[l][l] = squared(p->wheel_radius_load_sd_s2_m);
            state->P[s][s] = squared(design->track_sd[axle]);
            state->axles[axle].noise = squared(first_noise);
        }
    } else {
        state->P[BIAS][BIAS] += squared(p->gyro_bias_ignition_sd_rad_s);
        for (int k = 0; k < OC_GYRO_BIAS_STATES; ++k) {
            state->P[DRIFT][k] = state->P[k][DRIFT] = 0.0;
        }
        state->past.covariance[DRIFT] = 0.0f;
        state->x[DRIFT] = 0.0;
    }
    state->sd = sqrt(state->P[BIAS][BIAS]);
    state->P[DRIFT][DRIFT] = squared(p->gyro_bias_drift_standing_sd_rad_s2);
    state->has_wheels = 0;
    state->silent_ticks = design->silent_ticks;
    state->running = 1;
    state->time = time;
    state->still_ticks = 0;
    state->still_blocks = 0.0;
    forget_block(state);
    forget_standing(state);
}

/* A drift that wheels can follow may be feared more than one that only the next standstill will show. */
static double drift_sd(const oc_gyro_bias *state, const oc_params *p) {
    return state->has_wheels ? p->gyro_bias_drift_sd_rad_s2 : p->gyro_bias_drift_standing_sd_rad_s2;
}

/* To this time: the drift moves the bias and fades, all that may wander becomes less sure. */
static void predict(oc_gyro_bias *state, const oc_params *p, double time) {
    const double passed = time - state->time;
    const double t = passed > 0.0 ? (passed < longest_prediction ? passed : longest_prediction) : 0.0;
    const double kept = 1.0 / (1.0 + t / p->gyro_bias_drift_time_s);
    oc_past_bias *past = &state->past;
    oc_past_bias_grow(past, state->P[BIAS]);
    past->covariance[BIAS] += (float)t * past->covariance[DRIFT];
    past->covariance[DRIFT] *= (float)kept;
    state->time = time;
    state->x[BIAS] += t * state->x[DRIFT];
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
        const int m = state_of(axle, MISMATCH);
        state->P[m][m] += squared(p->wheel_radius_wander_sd_1) * t / 3600.0;
    }
}

/* One reading of h'x with variance R: its innovation over the standard deviation that it was expected to have. One
 * that is further off than `outlier` weighs as much less. h is of an axle's states; the bias's share is 1. */
static double correct(oc_gyro_bias *state, int32_t axle, const double *h, double reading, double R) {
    const int first = state_of(axle, 0);
    double Ph[OC_GYRO_BIAS_STATES];
    float with_past = state->past.covariance[BIAS];
    for (int j = 0; j < OC_GYRO_BIAS_STATES; ++j) {
        Ph[j] = state->P[j][BIAS];
        for (int k = 0; k < STATES_OF_AXLE; ++k) {
            Ph[j] += state->P[j][first + k] * h[k];
        }
    }
    double hPh = Ph[BIAS], expected = state->x[BIAS];
    for (int k = 0; k < STATES_OF_AXLE; ++k) {
        hPh += h[k] * Ph[first + k];
        with_past += (float)h[k] * state->past.covariance[first + k];
        expected += h[k] * state->x[first + k];
    }
    const double innovation = reading - expected;
    const double S = hPh + R;
    const double beyond = squared(innovation * (1.0 / outlier));
    const double per_weighed = 1.0 / (beyond > S ? beyond : S);
    for (int j = 0; j < OC_GYRO_BIAS_STATES; ++j) {
        const double gain = Ph[j] * per_weighed;
        state->x[j] += gain * innovation;
        for (int k = 0; k <= j; ++k) {
            state->P[j][k] -= gain * Ph[k];
            state->P[k][j] = state->P[j][k];
        }
    }
    oc_past_bias_correct(&state->past, with_past, Ph, (float)innovation, (float)per_weighed);
    return innovation / sqrt(S);
}

static void settle_status(oc_gyro_bias *state, const oc_params *p) {
    const double sd = state->sd = sqrt(state->P[BIAS][BIAS]);
    if (!(state->evidence > 0.0) || sd > 0.5 * p->gyro_bias_sd_rad_s) {
        state->status = OC_UNOBSERVABLE;
        return;
    }
    state->status = oc_gyro_bias_alarmed(state)
                        ? OC_INVALID
                        : oc_status_next(state->status, sd, p->gyro_bias_half_width_max_rad_s);
}

/* A standing block's mean is the bias. It is so sure that a bias far from it has moved. The floor is the standstill's,
 * not the block's: the k-th block of one adds as a k-th part, until a drift must be followed. */
static void learn_standing(oc_gyro_bias *state, const oc_params *p, double time, double tick_s) {
    static const double none[STATES_OF_AXLE] = {0.0};
    const double n = state->still;
    const double variance = state->still_squares / n;
    if (variance <= squared(standing_spread)) {
        predict(state, p, time);
        state->still_blocks += state->still_blocks < standing_blocks ? 1.0 : 0.0;
        const double R = squared(standing_floor) * state->still_blocks + variance * standing_alike / n;
        const double innovation = state->still_yaw_rate - state->x[BIAS];
        const double S = state->P[BIAS][BIAS] + R;
        if (innovation * innovation > outlier * outlier * S) {
            state->P[BIAS][BIAS] += innovation * innovation;
        }
        (void)correct(state, OC_AXLE_REAR, none, state->still_yaw_rate, R);
        state->alarm_blocks = 0.0;
        state->evidence += n * tick_s;
        settle_status(state, p);
    }
    forget_standing(state);
}

static bool rolls(const oc_signals *tick) {
    const uint32_t left = tick->valid & OC_HAS_WHEEL_SPEED_REAR_LEFT;
    const uint32_t right = tick->valid & OC_HAS_WHEEL_SPEED_REAR_RIGHT;
    return (left && fabs(tick->wheel_speed_rear_left) > rolling_speed) ||
           (right && fabs(tick->wheel_speed_rear_right) > rolling_speed);
}

static void stand(oc_gyro_bias *state, const oc_gyro_bias_design *design, const oc_params *p, const oc_signals *tick) {
    if (!(tick->valid & OC_HAS_VEHICLE_SPEED) || !(fabs(tick->vehicle_speed) <= p->standstill_speed_max_m_s) ||
        rolls(tick)) {
        if (state->still_ticks > 0) {
            state->still_ticks = 0;
            state->still_blocks = 0.0;
            forget_standing(state);
        }
        return;
    }
    if (state->still_ticks < design->settling_ticks) {
        ++state->still_ticks;
        return;
    }
    state->still_ticks = design->settling_ticks + 1;
    state->still += 1.0;
    const double innovation = tick->yaw_rate - state->still_yaw_rate;
    state->still_yaw_rate += innovation / state->still;
    state->still_squares += innovation * (tick->yaw_rate - state->still_yaw_rate);
    if (state->still >= design->standing_ticks) {
        learn_standing(state, p, tick->time, design->tick_s);
    }
}

/* Where the difference of the speeds stands still for a tick it is on a step of its quantisation. */
static void watch_quantum(oc_gyro_bias_axle *a, double difference) {
    if (fabs(difference - a->last) < 1e-6) {
        const double step = fabs(difference - a->plateau);
        if (step > 1e-6) {
            a->quantum = a->quantum > 0.0 && a->quantum < step ? a->quantum : step;
            a->held = 0.0;
        }
        a->plateau = difference;
        a->flat += 1.0;
    }
    a->last = difference;
}

static void add(oc_gyro_bias_axle *a, double track, double left, double right, double yaw_rate, double acceleration) {
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

/* Rounding error of a difference that seldom moves: it stays as it is for longer than a block. One that moves with
 * noise is averaged away, and seen in the noise. `flat` is the share of ticks at which it did not move. */
static double rounding_variance(const oc_gyro_bias_axle *a, double per_track, double flat) {
    return quantum_alike / 12.0 * squared(a->quantum * per_track * flat) * (1.0 + a->held);
}

/* Noise of a block from the difference of two neighbours, once the state has explained what it can. */
static void learn_noise(oc_gyro_bias_axle *a, double unexplained) {
    const double memory = a->blocks + 5.0 < noise_blocks ? a->blocks + 5.0 : noise_blocks;
    const double seen = 0.5 * unexplained * unexplained;
    const double limit = outlier * outlier * (a->noise > least_noise ? a->noise : least_noise);
    a->noise += ((seen < limit ? seen : limit) - a->noise) / memory;
}

static double clipped(double value, double limit) {
    return value > limit ? limit : value < -limit ? -limit : value;
}

/* True when what was added has leaned to one side for too long; it begins anew then. */
static bool cusum(oc_gyro_bias_cusum *sums, double innovation) {
    const float s = (float)clipped(innovation, cusum_clip);
    const float up = sums->up + s - cusum_slack, down = sums->down - s - cusum_slack;
    const bool leaned = up > cusum_limit || down > cusum_limit;
    sums->up = up > 0.0f && !leaned ? up : 0.0f;
    sums->down = down > 0.0f && !leaned ? down : 0.0f;
    return leaned;
}

/* So much of bias and drift is open again. */
static void raise_alarm(oc_gyro_bias *state, double share) {
    if (!(state->alarm_blocks > 0.0)) {
        state->alarm_variance = state->P[BIAS][BIAS];
    }
    state->alarm_blocks = 1.0;
    state->P[BIAS][BIAS] += squared(share * alarm_bias);
    state->P[DRIFT][DRIFT] += squared(share * alarm_drift);
}

static void open_mismatch(oc_gyro_bias *state, int32_t axle) {
    const int m = state_of(axle, MISMATCH);
    state->P[m][m] += squared(alarm_mismatch);
}

/* Both axles lean to one side: the bias has moved, or the radii of the axle that leans more; the other one tells. */
static void watch_bias(oc_gyro_bias *state, double rear, double front, double heard) {
    if (cusum(&state->together, (rear + front) / sqrt(heard))) {
        raise_alarm(state, 1.0);
        open_mismatch(state, fabs(rear) >= fabs(front) ? OC_AXLE_REAR : OC_AXLE_FRONT);
    }
}

/* One leans against the other: a tyre loses air or warms up, and the bias between them has followed it. */
static void watch_radii(oc_gyro_bias *state, double rear, double front) {
    if (cusum(&state->apart, (rear - front) * root_half)) {
        raise_alarm(state, alarm_share_of_radii);
        open_mismatch(state, OC_AXLE_REAR);
        open_mismatch(state, OC_AXLE_FRONT);
    }
}

/* The alarm is over when for a while nothing leaned, and the bias is known as well as before. */
static void watch_alarm(oc_gyro_bias *state, const oc_params *p) {
    const double narrow = squared(p->gyro_bias_half_width_max_rad_s / 1.96);
    const double again = alarm_over * state->alarm_variance;
    if (!(state->alarm_blocks > 0.0)) {
        return;
    }
    state->alarm_blocks += 1.0;
    state->alarm_time += block_s;
    if (state->alarm_blocks * block_s > alarm_least && state->P[BIAS][BIAS] <= (again > narrow ? again : narrow)) {
        state->alarm_blocks = 0.0;
    }
}

/* What an axle's whole block reads, and how far that is from the next before as noise and the rest have it. */
static void read_axle(oc_gyro_bias *state, const oc_gyro_bias_design *design, int32_t axle) {
    oc_gyro_bias_axle *a = &state->axles[axle];
    a->innovation = 0.0;
    a->has_update = a->weight >= 0.5 * design->ticks_per_block;
    if (!a->has_update) {
        return;
    }
    const double per_track = design->per_track[axle], per_tick = 1.0 / a->weight;
    const double v = a->speed * per_tick;
    const double r = a->yaw_rate * per_tick;
    const double reading = r - a->difference * per_tick * per_track;
    const double load = v * a->acceleration * per_tick;
    double late = 0.0;
    if (a->blocks > 0.0) {
        late = lag / block_s * (r - a->before_yaw_rate);
        const double explained = -(v - a->before_speed) * per_track * state->x[state_of(axle, MISMATCH)] -
                                 (load - a->before_load) * per_track * state->x[state_of(axle, LOAD)] -
                                 (r - a->before_yaw_rate) * state->x[state_of(axle, SCALE)];
        learn_noise(a, reading - a->before - explained);
    }
    a->before = reading;
    a->before_speed = v;
    a->before_load = load;
    a->before_yaw_rate = r;
    a->blocks += 1.0;
    a->held += 1.0;
    a->variance = a->noise + squared(model_noise) + squared(late) + rounding_variance(a, per_track, a->flat * per_tick);
}

static void learn_axle(oc_gyro_bias *state, const oc_gyro_bias_design *design, int32_t axle) {
    oc_gyro_bias_axle *a = &state->axles[axle];
    if (!a->has_update) {
        return;
    }
    const double per_track = design->per_track[axle];
    const double turn = a->before_yaw_rate - state->x[BIAS];
    const double h[STATES_OF_AXLE] = {
        [MISMATCH] = -a->before_speed * per_track, [LOAD] = -a->before_load * per_track, [SCALE] = -turn};
    a->innovation = correct(state, axle, h, a->before, a->variance + squared(model_share * turn));
}

/* What both axles said together. */
static void conclude_block(oc_gyro_bias *state, const oc_params *p) {
    const oc_gyro_bias_axle *rear = &state->axles[OC_AXLE_REAR], *front = &state->axles[OC_AXLE_FRONT];
    const int32_t heard = rear->has_update + front->has_update;
    if (heard > 0) {
        state->evidence += block_s;
        state->wheel_evidence += block_s;
        watch_bias(state, rear->innovation, front->innovation, (double)heard);
    }
    if (heard == OC_AXLE_COUNT) {
        watch_radii(state, rear->innovation, front->innovation);
    }
    watch_alarm(state, p);
    settle_status(state, p);
}

static void end_block(oc_gyro_bias *state, const oc_gyro_bias_design *design, double time) {
    read_axle(state, design, OC_AXLE_REAR);
    read_axle(state, design, OC_AXLE_FRONT);
    forget_block(state);
    state->block_time = time;
    state->due = PREDICTION_DUE;
}

static void learn_what_is_due(oc_gyro_bias *state, const oc_gyro_bias_design *design, const oc_params *p) {
    switch (state->due--) {
    case PREDICTION_DUE: predict(state, p, state->block_time); break;
    case REAR_DUE: learn_axle(state, design, OC_AXLE_REAR); break;
    case FRONT_DUE: learn_axle(state, design, OC_AXLE_FRONT); break;
    case CONCLUSION_DUE: conclude_block(state, p); break;
    default: break; /* so that the others see that this tick was busy */
    }
}

/* Whether what tilts the truck on its tyres is known: not while the accelerometer is silent for a moment, in which it
 * would have read other than what is usual. */
static bool knows_load(oc_gyro_bias *state, const oc_gyro_bias_design *design, bool heard) {
    if (heard) {
        state->silent_ticks = 0;
        return true;
    }
    if (state->silent_ticks < design->silent_ticks) {
        ++state->silent_ticks;
        return false;
    }
    return true;
}

void oc_gyro_bias_update(oc_gyro_bias *state, const oc_gyro_bias_design *design, const oc_params *params,
                         const oc_signals *tick) {
    const uint32_t rear = OC_HAS_WHEEL_SPEED_REAR_LEFT | OC_HAS_WHEEL_SPEED_REAR_RIGHT;
    const uint32_t front = OC_HAS_WHEEL_SPEED_FRONT_LEFT | OC_HAS_WHEEL_SPEED_FRONT_RIGHT;
    if (!(tick->valid & OC_HAS_YAW_RATE)) {
        return;
    }
    if (!state->running) {
        begin(state, design, params, tick->time);
    }
    if (!state->has_wheels && (tick->valid & (rear | front))) {
        state->has_wheels = 1;
        state->P[DRIFT][DRIFT] += squared(params->gyro_bias_drift_first_sd_rad_s2);
    }
    stand(state, design, params, tick);
    const bool heard = params->use_accelerometer != 0 && (tick->valid & OC_HAS_LATERAL_ACCELERATION) != 0;
    const bool adds = knows_load(state, design, heard);
    if (adds && (tick->valid & rear) == rear) {
        add(&state->axles[OC_AXLE_REAR], design->track[OC_AXLE_REAR], tick->wheel_speed_rear_left,
            tick->wheel_speed_rear_right, tick->yaw_rate, tick->lateral_acceleration);
    }
    if (adds && (tick->valid & front) == front) {
        add(&state->axles[OC_AXLE_FRONT], design->track[OC_AXLE_FRONT], tick->wheel_speed_front_left,
            tick->wheel_speed_front_right, tick->yaw_rate, tick->lateral_acceleration);
    }
    state->block_ticks += 1.0;
    if (state->due != NOTHING_DUE) {
        learn_what_is_due(state, design, params);
    } else if (state->block_ticks >= design->ticks_per_block) {
        end_block(state, design, tick->time);
    }
}

bool oc_gyro_bias_is_busy(const oc_gyro_bias *state) {
    return state->due != NOTHING_DUE;
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

oc_estimate oc_gyro_bias_mismatch(const oc_gyro_bias *state, const oc_params *params, int32_t axle) {
    const int m = state_of(axle, MISMATCH);
    const double prior = params->wheel_radius_mismatch_sd_1;
    if (!state->started || !(state->axles[axle].blocks > 0.0)) {
        return (oc_estimate){.standard_deviation = prior};
    }
    const double sd = sqrt(state->P[m][m]);
    return (oc_estimate){
        .value = state->x[m],
        .standard_deviation = sd,
        .evidence = state->axles[axle].blocks * block_s,
        .status = sd > 0.5 * prior ? OC_UNOBSERVABLE : OC_VALID,
    };
}

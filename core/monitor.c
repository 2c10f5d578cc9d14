#include "monitor.h"

#include <math.h>

/* Beyond these a value is no measurement of a road vehicle; NaN is beyond them, too. */
static const double angle_limit = 100.0;        /* rad, 16 turns */
static const double yaw_rate_limit = 10.0;      /* rad/s */
static const double speed_limit = 150.0;        /* m/s */
static const double acceleration_limit = 100.0; /* m/s^2 */

/* A second in order on a clock set back, or after one wild stamp, is the new time; less is disorder. */
static const double new_clock_s = 1.0;

const char *oc_version(void) {
    /* written from the header's numbers, each below 10, without stdio */
    static const char version[] = {'0' + OC_VERSION_MAJOR, '.', '0' + OC_VERSION_MINOR, '.', '0' + OC_VERSION_PATCH, 0};
    return version;
}

const char *oc_error_name(oc_error error) {
    static const char *const names[OC_ERROR_COUNT] = {"ok", "vehicle", "params", "rate"};
    return (unsigned)error < OC_ERROR_COUNT ? names[error] : "unknown";
}

const char *oc_status_name(oc_status status) {
    static const char *const names[OC_STATUS_COUNT] = {"unobservable", "converging", "valid", "invalid"};
    return (unsigned)status < OC_STATUS_COUNT ? names[status] : "unknown";
}

const char *oc_reason_name(oc_reason reason) {
    switch (reason) {
    case OC_REASON_MISSING_SIGNAL: return "missing_signal";
    case OC_REASON_TIME: return "time";
    case OC_REASON_GAP: return "gap";
    case OC_REASON_SETTLING: return "settling";
    case OC_REASON_SPEED: return "speed";
    case OC_REASON_CURVATURE: return "curvature";
    case OC_REASON_LONGITUDINAL_ACCELERATION: return "longitudinal_acceleration";
    case OC_REASON_BANK: return "bank";
    case OC_REASON_WINDOW: return "window";
    case OC_REASON_COUNT: break;
    }
    return NULL;
}

const char *oc_vehicle_check(const oc_vehicle *vehicle) {
    if (!(vehicle->wheelbase >= 1.0 && vehicle->wheelbase <= 20.0)) {
        return "wheelbase";
    }
    if (!(vehicle->steering_ratio >= 1.0 && vehicle->steering_ratio <= 60.0)) {
        return "steering_ratio";
    }
    return NULL;
}

oc_error oc_setup(oc_coefficients *coefficients, const oc_vehicle *vehicle, const oc_params *params, double rate_hz) {
    if (oc_vehicle_check(vehicle) != NULL) {
        return OC_ERROR_VEHICLE;
    }
    if (oc_params_check(params) != NULL) {
        return OC_ERROR_PARAMS;
    }
    if (!(rate_hz >= 20.0 && rate_hz <= 200.0) || !(params->cutoff_hz < 0.45 * rate_hz)) {
        return OC_ERROR_RATE;
    }
    oc_coefficients c = {
        .vehicle = *vehicle,
        .params = *params,
        .rate_hz = rate_hz,
        .tick_s = 1.0 / rate_hz,
        .ratio_times_wheelbase = vehicle->steering_ratio * vehicle->wheelbase,
        .ticks_per_batch = params->batch_s * rate_hz,
        .ticks_until_new_clock = (int32_t)(new_clock_s * rate_hz),
        .standstill_settling_ticks = (int32_t)(params->standstill_settling_s * rate_hz + 0.5),
    };
    oc_preprocess_design(&c.preprocess, params->cutoff_hz, params->delay_band_hz, params->speed_slope_window_s,
                         rate_hz);
    const double clean_ticks = params->clean_time_s * rate_hz;
    const double per_block = floor(clean_ticks / OC_BLOCKS_PER_CLEAN_TIME);
    c.ticks_per_block = per_block > 1.0 ? (int32_t)per_block : 1;
    c.blocks_until_final = (int32_t)-floor(-clean_ticks / c.ticks_per_block);
    *coefficients = c;
    return OC_OK;
}

void oc_init(oc_state *state) {
    *state = (oc_state){0};
}

void oc_restart(oc_state *state) {
    state->tracking = (oc_tracking){0};
    state->evidence.standstill.still_ticks = 0;
}

static bool within(double value, double limit) {
    return fabs(value) < limit;
}

static bool signals_present(const oc_signals *tick, uint32_t needed) {
    return (tick->valid & needed) == needed && within(tick->steering_wheel_angle, angle_limit) &&
           within(tick->yaw_rate, yaw_rate_limit) && within(tick->vehicle_speed, speed_limit) &&
           (!(needed & OC_HAS_LATERAL_ACCELERATION) || within(tick->lateral_acceleration, acceleration_limit));
}

static uint32_t signals_needed(const oc_params *params) {
    const uint32_t always = OC_HAS_STEERING_WHEEL_ANGLE | OC_HAS_YAW_RATE | OC_HAS_VEHICLE_SPEED;
    return params->use_accelerometer ? always | OC_HAS_LATERAL_ACCELERATION : always;
}

/* Spread of the yaw rate's bias: what standing showed and the thesis's method leaves uncorrected, else the prior. */
static double yaw_rate_bias_spread(const oc_evidence *evidence, const oc_coefficients *c) {
    const oc_estimate bias =
        oc_standstill_yaw_rate(&evidence->standstill, c->tick_s, c->params.standstill_time_min_s);
    if (bias.status != OC_VALID) {
        return c->params.yaw_rate_bias_sd_rad_s;
    }
    return sqrt(bias.value * bias.value + bias.standard_deviation * bias.standard_deviation);
}

/* Below it straights and bends have so much the same mix of signs that offset and gradient trade places. */
static const double apart_min = 0.25;

/* (38): the understeer gradient, zero with its prior's spread until its own evidence suffices. The two errors that reach
 * it, the bends' own and the offset's, both grow where bends and straights are alike. */
static oc_estimate understeer_of(oc_evidence *evidence, const oc_coefficients *c, double apart) {
    const oc_params *p = &c->params;
    const oc_understeer *understeer = &evidence->understeer;
    const oc_offset *offset = &evidence->offset;
    const double time = understeer->weight * c->tick_s;
    if (!(time >= p->understeer_evidence_min_s) || !(understeer->batches > 1.0) || !(apart > apart_min)) {
        evidence->understeer_status = OC_UNOBSERVABLE;
        return (oc_estimate){.standard_deviation = p->understeer_sd_rad_m_s2, .evidence = time};
    }
    const double K = oc_understeer_with_offset(understeer, offset->ticks.y, offset->ticks.x);
    const double per_offset = oc_understeer_per_offset(understeer);
    const double variance = oc_understeer_variance(understeer, oc_offset_value(offset, K), K) +
                            per_offset * per_offset * oc_offset_variance(offset, K);
    const double sd = sqrt(variance) / apart;
    const double narrow = p->understeer_half_width_max_rad_m_s2;
    evidence->understeer_status = oc_status_next(evidence->understeer_status, 1.96 * sd, narrow, 4.0 / 3.0 * narrow);
    return (oc_estimate){
        .value = K, .standard_deviation = sd, .evidence = time, .status = evidence->understeer_status};
}

/* Variance of the offset by all that the gradient and the drive's scatter leave open; the gyro's part comes on top. */
static double offset_variance(const oc_evidence *evidence, const oc_estimate *gradient, double apart) {
    const double K = gradient->value;
    const double x = evidence->offset.ticks.x;
    const double scatter = oc_offset_variance(&evidence->offset, K);
    if (gradient->status == OC_UNOBSERVABLE) {
        return scatter + x * x * gradient->standard_deviation * gradient->standard_deviation;
    }
    const double bends = oc_understeer_variance(&evidence->understeer, oc_offset_value(&evidence->offset, K), K);
    return (scatter + x * x * bends) / (apart * apart);
}

/* (36), (37), (38) from the evidence as it stands. */
static void learn(oc_evidence *evidence, oc_learned *learned, const oc_coefficients *c) {
    const oc_params *p = &c->params;
    const oc_offset *offset = &evidence->offset;
    const double time = offset->ticks.weight * c->tick_s;
    const double apart = oc_understeer_apart(&evidence->understeer, offset->ticks.x);
    const oc_estimate gradient = understeer_of(evidence, c, apart);
    const double gyro = offset->ticks.w * yaw_rate_bias_spread(evidence, c);
    const double sd = sqrt(offset_variance(evidence, &gradient, apart) + gyro * gyro);

    const bool enough = time >= p->offset_evidence_min_s;
    const double narrow = p->offset_half_width_max_rad;
    if (enough && 1.96 * sqrt(oc_offset_variance(offset, gradient.value)) <= narrow) {
        evidence->offset_trusted = 1;
    }
    evidence->offset_status = !(offset->batches.weight > 1.0) ? OC_UNOBSERVABLE
                              : !enough ? OC_CONVERGING
                                        : oc_status_next(evidence->offset_status, 1.96 * sd, narrow, 4.0 / 3.0 * narrow);
    learned->understeer_gradient = gradient;
    learned->offset = (oc_estimate){
        .value = oc_offset_value(offset, gradient.value),
        .standard_deviation = sd,
        .evidence = time,
        .status = evidence->offset_status,
    };
}

/* Figure 15, the estimation: clean ticks wait for their t1, final blocks are learned from. */
static void estimate(oc_state *state, const oc_coefficients *c, const oc_motion *motion, double speed,
                     uint32_t reasons) {
    const oc_params *p = &c->params;
    oc_moments block;
    const double i = c->vehicle.steering_ratio;
    const double y = motion->residual;
    const double x = i * motion->lateral_acceleration;
    const double w = c->ratio_times_wheelbase / (speed > 1.0 ? speed : 1.0);
    bool learned = false;

    if (reasons != 0) {
        oc_pending_drop(&state->tracking.straight);
    } else if (oc_pending_add(&state->tracking.straight, c->ticks_per_block, c->blocks_until_final, y, x, w, &block)) {
        oc_offset_update(&state->evidence.offset, &block, c->ticks_per_batch);
        learned = true;
    }

    const double a_y = fabs(motion->lateral_acceleration);
    const bool bend = a_y > p->understeer_acceleration_min_m_s2 && a_y < p->understeer_acceleration_max_m_s2;
    if ((reasons & ~(uint32_t)OC_REASON_CURVATURE) != 0 || !bend || !state->evidence.offset_trusted) {
        oc_pending_drop(&state->tracking.cornering);
    } else if (oc_pending_add(&state->tracking.cornering, c->ticks_per_block, c->blocks_until_final, y, x, w, &block)) {
        oc_understeer_update(&state->evidence.understeer, &block, c->ticks_per_batch);
        learned = true;
    }

    if (learned) {
        learn(&state->evidence, &state->learned, c);
    }
}

static void count(oc_evidence *evidence, uint32_t reasons) {
    for (uint32_t k = 0, left = reasons; left != 0; ++k, left >>= 1) {
        evidence->rejected[k] += left & 1u;
    }
    evidence->unused_motion += reasons != 0;
}

/* Whether the filters must start anew at this tick: nothing before it, a hole, or a clock set back. Half a tick more
 * than the longest hole, so that the last bit of a time stamp does not decide. */
static bool interrupted(const oc_tracking *tracking, const oc_coefficients *c, double time) {
    const double hole = time - tracking->last_filtered - 0.5 * c->tick_s;
    return !tracking->running || hole < -c->tick_s || (hole > c->params.gap_max_s && hole > c->tick_s);
}

/* Whether a tick brings time forward; one that does not is refused, unless a whole second of such ticks is in order. */
static bool goes_forward(oc_tracking *tracking, const oc_coefficients *c, double time) {
    if (!(time > -1e300 && time < 1e300)) {
        return false;
    }
    if (tracking->clock_started && !(time > tracking->last_time)) {
        tracking->refused_in_order = time > tracking->last_refused ? tracking->refused_in_order + 1 : 0;
        tracking->last_refused = time;
        if (tracking->refused_in_order < c->ticks_until_new_clock) {
            return false;
        }
    }
    tracking->refused_in_order = 0;
    tracking->last_time = time;
    tracking->clock_started = 1;
    return true;
}

/* Figure 15 as one function: the reasons against this tick and the motion at it. */
static uint32_t step(oc_state *state, const oc_coefficients *c, const oc_signals *tick, oc_motion *motion,
                     double *speed) {
    oc_tracking *tracking = &state->tracking;
    oc_evidence *evidence = &state->evidence;
    const oc_params *p = &c->params;
    const bool has_acceleration =
        (tick->valid & OC_HAS_LATERAL_ACCELERATION) && within(tick->lateral_acceleration, acceleration_limit);
    const double a_y = p->use_accelerometer ? tick->lateral_acceleration : 0.0;

    /* time goes forward, or nothing happened */
    if (!goes_forward(tracking, c, tick->time)) {
        ++evidence->rejected[1];
        return OC_REASON_TIME;
    }
    ++evidence->ticks;

    /* a tick without its signals leaves the filters alone and what was pending unproven */
    if (!signals_present(tick, signals_needed(p))) {
        oc_pending_drop(&tracking->straight);
        oc_pending_drop(&tracking->cornering);
        evidence->standstill.still_ticks = 0;
        count(evidence, OC_REASON_MISSING_SIGNAL);
        return OC_REASON_MISSING_SIGNAL;
    }

    /* 5.1.1: filter, delay, differentiate */
    uint32_t reasons = 0;
    if (interrupted(tracking, c, tick->time)) {
        reasons = tracking->running ? OC_REASON_GAP : 0;
        oc_preprocess_restart(&tracking->preprocess, &c->preprocess, tick->steering_wheel_angle, tick->yaw_rate,
                              tick->vehicle_speed, a_y);
        evidence->standstill.still_ticks = 0;
        tracking->running = 1;
    }
    tracking->last_filtered = tick->time;
    const oc_filtered filtered =
        oc_preprocess_update(&tracking->preprocess, &c->preprocess, tick->steering_wheel_angle, tick->yaw_rate,
                             tick->vehicle_speed, a_y);
    if (!oc_preprocess_settled(&tracking->preprocess, &c->preprocess)) {
        reasons |= OC_REASON_SETTLING;
    }

    /* standing still shows what the sensors read for nothing */
    oc_standstill_update(&evidence->standstill, c->standstill_settling_ticks, tick->vehicle_speed,
                         p->standstill_speed_max_m_s, tick->yaw_rate, tick->lateral_acceleration, has_acceleration);

    /* 5.1.2: motion and gate */
    *motion = oc_motion_of(&filtered, c->ratio_times_wheelbase, p->use_accelerometer != 0);
    *speed = filtered.vehicle_speed;
    reasons |= oc_gate(p, motion, filtered.vehicle_speed);
    if (!(reasons & (OC_REASON_SETTLING | OC_REASON_SPEED))) {
        evidence->bank_ticks += 1.0;
        evidence->bank_sum += motion->bank;
    }
    count(evidence, reasons);

    /* 5.1.3: offset and understeer gradient */
    estimate(state, c, motion, filtered.vehicle_speed, reasons);
    return reasons;
}

void oc_step(oc_state *state, const oc_coefficients *coefficients, const oc_signals *tick, oc_output *output) {
    oc_motion motion = {0};
    double speed = 0.0;
    const uint32_t reasons = step(state, coefficients, tick, &motion, &speed);
    if (output != NULL) {
        *output = (oc_output){
            .time = state->tracking.last_time,
            .vehicle_speed = speed,
            .motion = motion,
            .reasons = reasons,
            .offset_status = state->learned.offset.status,
            .offset = state->learned.offset.value,
            .offset_sd = state->learned.offset.standard_deviation,
            .understeer_gradient = state->learned.understeer_gradient.value,
        };
    }
}

static double at(const double *column, size_t row) {
    return column == NULL ? 0.0 : column[row];
}

void oc_run(oc_state *state, const oc_coefficients *coefficients, const oc_columns *columns, oc_output *outputs) {
    const uint32_t valid = (columns->steering_wheel_angle != NULL ? OC_HAS_STEERING_WHEEL_ANGLE : 0u) |
                           (columns->yaw_rate != NULL ? OC_HAS_YAW_RATE : 0u) |
                           (columns->vehicle_speed != NULL ? OC_HAS_VEHICLE_SPEED : 0u) |
                           (columns->lateral_acceleration != NULL ? OC_HAS_LATERAL_ACCELERATION : 0u);
    for (size_t row = 0; row < columns->count; ++row) {
        const oc_signals tick = {
            .time = columns->time[row],
            .steering_wheel_angle = at(columns->steering_wheel_angle, row),
            .yaw_rate = at(columns->yaw_rate, row),
            .vehicle_speed = at(columns->vehicle_speed, row),
            .lateral_acceleration = at(columns->lateral_acceleration, row),
            .valid = valid,
        };
        oc_step(state, coefficients, &tick, outputs == NULL ? NULL : &outputs[row]);
    }
}

/* The offset as it would be if what is pending were final. */
static double temporary_offset(const oc_state *state, double understeer_gradient) {
    oc_offset all = state->evidence.offset;
    const oc_pending *pending = &state->tracking.straight;
    const oc_moments filling = oc_moments_of(&pending->filling);
    for (int32_t k = 0; k < pending->count; ++k) {
        oc_moments_merge(&all.ticks, &pending->blocks[(pending->first + k) % OC_PENDING_MAX]);
    }
    oc_moments_merge(&all.ticks, &filling);
    return oc_offset_value(&all, understeer_gradient);
}

void oc_answer_get(const oc_state *state, const oc_coefficients *c, oc_answer *answer) {
    oc_evidence now = state->evidence; /* a standstill since the last final block counts, too */
    oc_learned learned;
    learn(&now, &learned, c);
    const double used = now.offset.ticks.weight;
    const double K = learned.understeer_gradient.value;
    const double time_min = c->params.standstill_time_min_s;
    *answer = (oc_answer){
        .offset = learned.offset,
        .offset_temporary = temporary_offset(state, K),
        .offset_variance_if_independent = oc_offset_variance_if_independent(&now.offset, K),
        .understeer_gradient = learned.understeer_gradient,
        .yaw_rate_bias = oc_standstill_yaw_rate(&now.standstill, c->tick_s, time_min),
        .standstill_lateral_acceleration = oc_standstill_lateral_acceleration(&now.standstill, c->tick_s, time_min),
        .offset_per_yaw_rate_bias = now.offset.ticks.w,
        .bank_mean = now.bank_ticks > 0.0 ? now.bank_sum / now.bank_ticks : 0.0,
        .bank_time = now.bank_ticks * c->tick_s,
        .duration = (double)now.ticks * c->tick_s,
        .used = used * c->tick_s,
        .unused = ((double)now.ticks - used) * c->tick_s,
    };
    for (int32_t k = 0; k < OC_REASON_COUNT; ++k) {
        answer->rejected[k] = (double)now.rejected[k] * c->tick_s;
    }
    answer->rejected[OC_REASON_COUNT - 1] = ((double)now.ticks - (double)now.unused_motion - used) * c->tick_s;
}

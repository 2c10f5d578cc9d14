#include "monitor.h"

#include <math.h>

#include "methods.h"

/* Beyond these a value is no measurement of a road vehicle; NaN is beyond them, too. */
static const double angle_limit = 100.0;        /* rad, 16 turns */
static const double yaw_rate_limit = 10.0;      /* rad/s */
static const double speed_limit = 150.0;        /* m/s */
static const double acceleration_limit = 100.0; /* m/s^2 */

void oc_init(oc_state *state) {
    *state = (oc_state){0};
}

void oc_restart(oc_state *state) {
    state->tracking = (oc_tracking){0};
    state->evidence.joint.lost = 1;
    state->evidence.standstill.still_ticks = 0;
    oc_gyro_bias_restart(&state->evidence.gyro_bias);
}

static bool within(double value, double limit) {
    return fabs(value) < limit;
}

static bool all_measured(const oc_signals *tick) {
    return within(tick->steering_wheel_angle, angle_limit) && within(tick->yaw_rate, yaw_rate_limit) &&
           within(tick->vehicle_speed, speed_limit) && within(tick->lateral_acceleration, acceleration_limit) &&
           within(tick->wheel_speed_front_left, speed_limit) && within(tick->wheel_speed_front_right, speed_limit) &&
           within(tick->wheel_speed_rear_left, speed_limit) && within(tick->wheel_speed_rear_right, speed_limit) &&
           within(tick->lateral_speed, speed_limit);
}

/* The bit where its member is no measurement. */
static uint32_t bit_beyond(oc_signal_bit bit, double value, double limit) {
    return within(value, limit) ? 0u : (uint32_t)bit;
}

static uint32_t wheels_beyond(const oc_signals *tick) {
    return bit_beyond(OC_HAS_WHEEL_SPEED_FRONT_LEFT, tick->wheel_speed_front_left, speed_limit) |
           bit_beyond(OC_HAS_WHEEL_SPEED_FRONT_RIGHT, tick->wheel_speed_front_right, speed_limit) |
           bit_beyond(OC_HAS_WHEEL_SPEED_REAR_LEFT, tick->wheel_speed_rear_left, speed_limit) |
           bit_beyond(OC_HAS_WHEEL_SPEED_REAR_RIGHT, tick->wheel_speed_rear_right, speed_limit);
}

/* The valid bits, but for those over what no road vehicle can have measured. */
static uint32_t measured(const oc_signals *tick) {
    if (all_measured(tick)) {
        return tick->valid;
    }
    const uint32_t beyond = bit_beyond(OC_HAS_STEERING_WHEEL_ANGLE, tick->steering_wheel_angle, angle_limit) |
                            bit_beyond(OC_HAS_YAW_RATE, tick->yaw_rate, yaw_rate_limit) |
                            bit_beyond(OC_HAS_VEHICLE_SPEED, tick->vehicle_speed, speed_limit) |
                            bit_beyond(OC_HAS_LATERAL_ACCELERATION, tick->lateral_acceleration, acceleration_limit) |
                            bit_beyond(OC_HAS_LATERAL_SPEED, tick->lateral_speed, speed_limit);
    return tick->valid & ~(beyond | wheels_beyond(tick));
}

/* m/s^2, as on a road of the mean bank; 0 where nothing tells the turning. */
static double usual_side_force(const oc_state *state, const oc_coefficients *c, const oc_signals *tick) {
    const uint32_t turning = OC_HAS_YAW_RATE | OC_HAS_VEHICLE_SPEED;
    if ((tick->valid & turning) != turning) {
        return 0.0;
    }
    const oc_estimate bias = oc_gyro_bias_get(&state->evidence.gyro_bias, &c->params);
    return (tick->yaw_rate - bias.value) * tick->vehicle_speed + state->evidence.joint.bank_mean;
}

/* Leaves the bits of what was measured and is to be used; what an accelerometer reads standing is told anyway. What
 * side force there usually is stands for one that is not heard. */
static void listen(oc_signals *tick, const oc_state *state, const oc_coefficients *c) {
    tick->valid = measured(tick);
    const bool stands = fabs(tick->vehicle_speed) <= c->params.standstill_speed_max_m_s;
    if (!c->params.use_accelerometer && !stands) {
        tick->valid &= ~(uint32_t)OC_HAS_LATERAL_ACCELERATION;
    }
    if ((tick->valid & OC_HAS_LATERAL_ACCELERATION) == 0) {
        tick->lateral_acceleration = usual_side_force(state, c, tick);
    }
}

static uint32_t signals_needed(const oc_coefficients *c) {
    if (c->params.method == OC_METHOD_WHEEL_SPEED) {
        return OC_HAS_STEERING_WHEEL_ANGLE | (c->wheel_axle == OC_AXLE_REAR
                                                  ? OC_HAS_WHEEL_SPEED_REAR_LEFT | OC_HAS_WHEEL_SPEED_REAR_RIGHT
                                                  : OC_HAS_WHEEL_SPEED_FRONT_LEFT | OC_HAS_WHEEL_SPEED_FRONT_RIGHT);
    }
    const uint32_t always = OC_HAS_STEERING_WHEEL_ANGLE | OC_HAS_YAW_RATE | OC_HAS_VEHICLE_SPEED;
    return c->params.use_accelerometer ? always | OC_HAS_LATERAL_ACCELERATION : always;
}

/* What turns and drives the truck, by the method's sensors: yaw rate, vehicle speed, lateral acceleration. */
typedef struct {
    double yaw_rate, speed, lateral_acceleration; /* rad/s, m/s, m/s^2 */
    bool use_accelerometer;
} sensed;

/* 5.5.4: speed and yaw rate of the axle, as if its wheels were of one radius. */
static sensed sensed_by_wheels(const oc_coefficients *c, const oc_signals *tick) {
    const bool rear = c->wheel_axle == OC_AXLE_REAR;
    const double left = rear ? tick->wheel_speed_rear_left : tick->wheel_speed_front_left;
    const double right = rear ? tick->wheel_speed_rear_right : tick->wheel_speed_front_right;
    const oc_vehicle *vehicle = &c->vehicle;
    const double curvature =
        rear ? oc_wheel_speed_rear_curvature(vehicle->track_width_rear, left, right, 0.0)
             : oc_wheel_speed_front_curvature(vehicle->wheelbase, vehicle->track_width_front, left, right, 0.0);
    const double speed = 0.5 * (left + right);
    return (sensed){.yaw_rate = curvature * speed, .speed = speed};
}

static sensed sensed_by(const oc_coefficients *c, const oc_signals *tick) {
    if (c->params.method == OC_METHOD_WHEEL_SPEED) {
        return sensed_by_wheels(c, tick);
    }
    const bool use_accelerometer = c->params.use_accelerometer != 0;
    return (sensed){
        .yaw_rate = tick->yaw_rate,
        .speed = tick->vehicle_speed,
        .lateral_acceleration = use_accelerometer ? tick->lateral_acceleration : 0.0,
        .use_accelerometer = use_accelerometer,
    };
}

static void count(oc_evidence *evidence, uint32_t reasons) {
    for (uint32_t k = 0, left = reasons; left != 0; ++k, left >>= 1) {
        evidence->rejected[k] += left & 1u;
    }
    evidence->unused_motion += reasons != 0;
}

/* Whether there is a hole before this tick, or a clock set back. Half a tick more than the longest hole, so that the
 * last bit of a time stamp does not decide. */
static bool interrupted(const oc_tracking *tracking, const oc_coefficients *c, double time) {
    const double hole = time - tracking->last_filtered - 0.5 * c->tick_s;
    return tracking->followed && (hole < -c->tick_s || (hole > c->params.gap_max_s && hole > c->tick_s));
}

/* Who stands still begins anew: the filters hold nothing then that an ignition cycle could lose. */
static bool stands_still(oc_tracking *tracking, const oc_standstill *standstill, const oc_coefficients *c,
                         double speed) {
    if (standstill->still_ticks < c->gyro_bias.settling_ticks ||
        !(fabs(speed) <= c->params.standstill_speed_max_m_s)) {
        return false;
    }
    tracking->joint.running = 0;
    tracking->running = 0;
    return true;
}

/* Whether a tick brings time forward; one that does not is refused, unless a whole second of such ticks is in order. */
static bool goes_forward(oc_tracking *tracking, const oc_coefficients *c, double time) {
    if (!within(time, 1e30)) {
        return false;
    }
    if (tracking->clock_started && !(time > tracking->last_time)) {
        tracking->refused_in_order = time > tracking->last_refused ? tracking->refused_in_order + 1 : 0;
        tracking->last_refused = time;
        if (tracking->refused_in_order < c->ticks_until_new_clock) {
            return false;
        }
        tracking->fault.running = tracking->angle.running = 0; /* their times are the old clock's */
    }
    tracking->refused_in_order = 0;
    tracking->last_time = time;
    tracking->clock_started = 1;
    return true;
}

/* The motion at a tick, for the estimators; all zero where the tick has none. */
typedef struct {
    oc_filtered filtered;
    oc_motion motion;
    oc_estimate yaw_rate_bias; /* that was taken off the yaw rate */
    double mismatch_residual;  /* rad, by the wheels' radii */
    bool moves;
} followed;

/* Figure 15, as far as the gate: the reasons against this tick and the motion at it. The tick's bits are
 * over measurements. */
static uint32_t follow_motion(oc_state *state, const oc_coefficients *c, oc_signals *tick, followed *now) {
    oc_tracking *tracking = &state->tracking;
    oc_evidence *evidence = &state->evidence;
    const oc_params *p = &c->params;
    const bool by_wheels = p->method == OC_METHOD_WHEEL_SPEED;

    /* time goes forward, or nothing happened */
    if (!goes_forward(tracking, c, tick->time)) {
        ++evidence->rejected[1];
        return OC_REASON_TIME;
    }
    ++evidence->ticks;

    /* 5.3.1: the gyro is judged whether there is an angle or not */
    oc_gyro_bias_update(&evidence->gyro_bias, &c->gyro_bias, p, tick);

    /* a tick without its signals leaves the filters alone and what was pending unproven */
    const uint32_t needed = signals_needed(c);
    if ((tick->valid & needed) != needed) {
        oc_pending_drop(&tracking->straight);
        oc_pending_drop(&tracking->cornering);
        evidence->standstill.still_ticks = 0;
        count(evidence, OC_REASON_MISSING_SIGNAL);
        return OC_REASON_MISSING_SIGNAL;
    }
    const sensed by = sensed_by(c, tick);

    /* standing still shows what the sensors read for nothing */
    const bool after_hole = interrupted(tracking, c, tick->time);
    tracking->last_filtered = tick->time;
    tracking->followed = 1;
    if (after_hole) {
        evidence->joint.lost = 1;
        evidence->standstill.still_ticks = 0;
    }
    if (tick->valid & OC_HAS_YAW_RATE) {
        oc_standstill_update(&evidence->standstill, c->gyro_bias.settling_ticks, by.speed,
                             p->standstill_speed_max_m_s, tick->yaw_rate, tick->lateral_acceleration,
                             (tick->valid & OC_HAS_LATERAL_ACCELERATION) != 0);
        if (stands_still(tracking, &evidence->standstill, c, by.speed)) {
            if (p->method == OC_METHOD_JOINT) {
                oc_stand_jointly(state, c);
            }
            count(evidence, OC_REASON_SPEED);
            return OC_REASON_SPEED;
        }
    }

    /* 5.1.1: filter, delay, differentiate */
    uint32_t reasons = after_hole ? OC_REASON_GAP : 0;
    if (!tracking->running || after_hole) {
        oc_preprocess_restart(&tracking->preprocess, &c->preprocess, tick->steering_wheel_angle, by.yaw_rate, by.speed,
                              by.lateral_acceleration);
        tracking->joint.running = 0;
        tracking->running = 1;
    }
    oc_filtered *filtered = &now->filtered;
    *filtered = oc_preprocess_update(&tracking->preprocess, &c->preprocess, tick->steering_wheel_angle,
                                                by.yaw_rate, by.speed, by.lateral_acceleration);
    if (!oc_preprocess_settled(&tracking->preprocess, &c->preprocess)) {
        reasons |= OC_REASON_SETTLING;
    }

    /* 5.1.2: motion and gate; the residual stays as if the wheels were of one radius, until all is known of them */
    double mismatch_residual = 0.0;
    if (by_wheels) {
        const double mismatch = oc_wheel_mismatch_of(evidence, c).value;
        oc_wheel_speed_update(&evidence->wheel_speed, by.speed - 0.5 * by.yaw_rate * c->gyro_bias.track[c->wheel_axle],
                              by.speed + 0.5 * by.yaw_rate * c->gyro_bias.track[c->wheel_axle], c->tick_s);
        filtered->yaw_rate -= filtered->vehicle_speed * mismatch / c->gyro_bias.track[c->wheel_axle];
        mismatch_residual = c->offset_per_mismatch * mismatch;
    }
    now->mismatch_residual = mismatch_residual;
    const bool jointly = p->method == OC_METHOD_JOINT;
    if (jointly) {
        now->yaw_rate_bias = oc_gyro_bias_get(&evidence->gyro_bias, p);
        filtered->yaw_rate -= now->yaw_rate_bias.value;
    }
    oc_motion *motion = &now->motion;
    *motion = oc_motion_of(filtered, c->ratio_times_wheelbase, by.use_accelerometer);
    reasons |= jointly ? oc_joint_gate(p, motion, filtered->vehicle_speed, evidence->joint.bank_mean)
                       : oc_gate(p, motion, filtered->vehicle_speed);
    if (jointly && oc_gyro_bias_alarmed(&evidence->gyro_bias)) {
        reasons |= OC_REASON_YAW_RATE_BIAS;
    }
    if (!(reasons & (OC_REASON_SETTLING | OC_REASON_SPEED))) {
        evidence->bank_ticks += 1.0;
        evidence->bank_sum += motion->bank;
    }
    count(evidence, reasons);
    now->moves = true;
    return reasons;
}

/* Figure 15, what comes after the gate. */
static void estimate(oc_state *state, const oc_coefficients *c, const oc_signals *tick, const followed *now,
                     uint32_t reasons) {
    if (!now->moves) {
        return;
    }
    /* 5.1.3: offset and understeer gradient */
    if (c->params.method == OC_METHOD_JOINT) {
        oc_estimate_jointly(state, c, tick, &now->filtered, &now->motion, reasons);
        return;
    }
    oc_estimate_straight_ahead(state, c, &now->motion, now->filtered.vehicle_speed,
                               now->motion.residual - now->mismatch_residual, reasons);
}

/* A sensor at fault teaches nothing; one that sits elsewhere now does, its new offset. One that may be at fault is not
 * listened to by the thesis's methods; the joint one predicts it, or it would not find that its offset changed. */
static bool sensor_misleads(const oc_fault_watch *watch, oc_method method) {
    const bool elsewhere = watch->fault == OC_FAULT_REMOUNTED || watch->fault == OC_FAULT_JUMPED;
    return (watch->fault != OC_FAULT_NONE && !elsewhere) ||
           (method != OC_METHOD_JOINT && oc_fault_suspected(watch));
}

/* Without a copy of the tick, which would wait for what was just written. */
static void step_and_tell(oc_state *state, const oc_coefficients *coefficients, oc_signals *tick, oc_output *output) {
    followed now;
    oc_angle angle;
    const bool follows = coefficients->params.angle_method != OC_ANGLE_NONE;
    listen(tick, state, coefficients);
    const uint32_t valid = tick->valid;
    const oc_fault_watch *watch = &state->tracking.fault;
    tick->valid = sensor_misleads(watch, coefficients->params.method) ? valid & ~(uint32_t)OC_HAS_STEERING_WHEEL_ANGLE : valid;
    now.moves = false;
    const uint32_t reasons = follow_motion(state, coefficients, tick, &now);
    if (!now.moves) {
        now = (followed){0};
    }
    estimate(state, coefficients, tick, &now, reasons);
    if (follows && !(reasons & OC_REASON_TIME)) {
        now.yaw_rate_bias = oc_gyro_bias_get(&state->evidence.gyro_bias, &coefficients->params);
        oc_follow_angle(state, coefficients, tick, valid, &now.yaw_rate_bias, &angle);
    } else {
        angle = (oc_angle){0};
    }
    if (output != NULL) {
        oc_tell(output, state, coefficients, &now.motion, now.filtered.vehicle_speed, reasons, &angle);
    }
}

void oc_step(oc_state *state, const oc_coefficients *coefficients, const oc_signals *tick, oc_output *output) {
    oc_signals copy = *tick;
    step_and_tell(state, coefficients, &copy, output);
}

static double at(const double *column, size_t row) {
    return column == NULL ? 0.0 : column[row];
}

void oc_run(oc_state *state, const oc_coefficients *coefficients, const oc_columns *columns, oc_output *outputs) {
    const uint32_t valid = (columns->steering_wheel_angle != NULL ? OC_HAS_STEERING_WHEEL_ANGLE : 0u) |
                           (columns->yaw_rate != NULL ? OC_HAS_YAW_RATE : 0u) |
                           (columns->vehicle_speed != NULL ? OC_HAS_VEHICLE_SPEED : 0u) |
                           (columns->lateral_acceleration != NULL ? OC_HAS_LATERAL_ACCELERATION : 0u) |
                           (columns->wheel_speed_front_left != NULL ? OC_HAS_WHEEL_SPEED_FRONT_LEFT : 0u) |
                           (columns->wheel_speed_front_right != NULL ? OC_HAS_WHEEL_SPEED_FRONT_RIGHT : 0u) |
                           (columns->wheel_speed_rear_left != NULL ? OC_HAS_WHEEL_SPEED_REAR_LEFT : 0u) |
                           (columns->wheel_speed_rear_right != NULL ? OC_HAS_WHEEL_SPEED_REAR_RIGHT : 0u) |
                           (columns->lateral_speed != NULL ? OC_HAS_LATERAL_SPEED : 0u);
    for (size_t row = 0; row < columns->count; ++row) {
        oc_signals tick = {
            .time = columns->time[row],
            .steering_wheel_angle = at(columns->steering_wheel_angle, row),
            .yaw_rate = at(columns->yaw_rate, row),
            .vehicle_speed = at(columns->vehicle_speed, row),
            .lateral_acceleration = at(columns->lateral_acceleration, row),
            .wheel_speed_front_left = at(columns->wheel_speed_front_left, row),
            .wheel_speed_front_right = at(columns->wheel_speed_front_right, row),
            .wheel_speed_rear_left = at(columns->wheel_speed_rear_left, row),
            .wheel_speed_rear_right = at(columns->wheel_speed_rear_right, row),
            .lateral_speed = at(columns->lateral_speed, row),
            .valid = valid,
        };
        step_and_tell(state, coefficients, &tick, outputs == NULL ? NULL : &outputs[row]);
    }
}

#include "monitor.h"

#include <math.h>
#include <string.h>

#include "bounds.h"
#include "methods.h"

/* memset, here and below: an unoptimised compiler builds a struct of zeros on the stack before it copies it. */
void oc_init(oc_state *state) {
    if (state != NULL) {
        memset(state, 0, sizeof *state);
        state->ready = OC_STATE_READY;
    }
}

void oc_restart(oc_state *state, double elapsed_s) {
    if (state == NULL || state->ready != OC_STATE_READY) {
        return;
    }
    static const double off_s_max = 3.2e8; /* ten years, also against what is no number */
    const double off_s = elapsed_s > 0.0 ? (elapsed_s < off_s_max ? elapsed_s : off_s_max) : 0.0;
    oc_joint_ignition(&state->evidence.joint, &state->tracking.joint, (float)off_s);
    memset(&state->tracking, 0, sizeof state->tracking);
    state->evidence.standstill.still_ticks = 0;
    oc_gyro_bias_restart(&state->evidence.gyro_bias, off_s);
}

/* Tuned, in tuned.toml: monitor */
/* rad: angle from straight ahead up to which a truck that seems to stand cannot creep through a turn */
static const double near_straight = 5.0 * 0.017453292f;
static const double near_unknown_straight = 20.0 * 0.017453292f; /* rad: the same while the offset is not learned */
static const double backward_speed_max = 10.0; /* m/s: speed above which no truck drives backward */
/* end */

static void set_yaw_rate_bias(oc_tick *tick, const oc_gyro_bias *gyro_bias, const oc_params *p) {
    const oc_estimate bias = oc_gyro_bias_get(gyro_bias, p);
    tick->yaw_rate_bias = bias.value;
    tick->yaw_rate_bias_sd = bias.standard_deviation;
}

/* m/s^2, on a road of the mean bank; 0 without yaw rate or speed. */
static double lateral_acceleration_on_mean_bank(const oc_signals *tick, const oc_evidence *evidence) {
    const uint32_t turning = OC_HAS_YAW_RATE | OC_HAS_VEHICLE_SPEED;
    if ((tick->valid & turning) != turning) {
        return 0.0;
    }
    const double yaw_rate = tick->yaw_rate - evidence->gyro_bias.x[0]; /* the bias; 0 before a reading */
    return yaw_rate * tick->vehicle_speed + evidence->joint.bank_mean;
}

/* Whether to discard the angle. A sensor that was remounted or has jumped has a new offset, and is used. The thesis's
 * methods discard a suspected sensor; the joint method predicts its angle to detect a changed offset. */
static bool is_angle_discarded(const oc_fault_watch *watch, bool suspected, oc_method method) {
    const bool has_new_offset = watch->fault == OC_FAULT_REMOUNTED || watch->fault == OC_FAULT_JUMPED;
    return (watch->fault != OC_FAULT_NONE && !has_new_offset) || (method != OC_METHOD_JOINT && suspected);
}

/* What the truck's controllers say, as reasons of the gate. */
static void take_statuses(oc_tick *tick, oc_tracking *tracking, const oc_coefficients *c) {
    const uint32_t is_true = oc_status_watch_update(&tracking->statuses, &tick->signals, (float)c->tick_s);
    tick->statuses = is_true;
    const bool brakes = (is_true & (OC_HAS_STABILITY_CONTROL_ACTIVE | OC_HAS_ANTI_LOCK_ACTIVE)) != 0;
    const bool backs_up = (is_true & OC_HAS_REVERSE) != 0 && fabs(tick->signals.vehicle_speed) < backward_speed_max;
    const float left_s = oc_max(tracking->braked_s - (float)c->tick_s, 0.0f);
    tracking->braked_s = brakes ? 1.0f : left_s; /* a second, in which truck and filters swing out */
    tick->disturbed = (tracking->braked_s > 0.0f ? OC_REASON_INTERVENTION : 0u) |
                      (backs_up ? OC_REASON_REVERSE : 0u) |
                      ((is_true & OC_HAS_STEERING_ASSIST_ACTIVE) != 0 ? OC_REASON_STEERING_ASSIST : 0u);
}

/* Brakes that turn the truck, and a speed without sign, contradict the other signals: nothing is compared. */
static void check_assignment(oc_tick *tick, uint32_t sent, oc_assignment *assignment,
                             const oc_assignment_design *design) {
    const uint32_t measured = tick->signals.valid;
    const bool compares = (tick->disturbed & (OC_REASON_INTERVENTION | OC_REASON_REVERSE)) == 0;
    const uint32_t compared = compares ? UINT32_MAX : ~(uint32_t)OC_HAS_VEHICLE_SPEED;
    tick->signals.valid = measured & compared;
    oc_assignment_update(assignment, design, &tick->signals, sent & compared);
    tick->signals.valid = measured;
    tick->at_fault = (uint32_t)assignment->at_fault;
}

/* ISO 8855: forward is positive. Most senders give the size only. */
static void drive_backward(oc_signals *signals) {
    double *const speeds[] = {&signals->vehicle_speed, &signals->wheel_speed_front_left,
                              &signals->wheel_speed_front_right, &signals->wheel_speed_rear_left,
                              &signals->wheel_speed_rear_right};
    for (size_t k = 0; k < sizeof speeds / sizeof speeds[0]; ++k) {
        *speeds[k] = -fabs(*speeds[k]);
    }
}

/* Clears the valid bits of unused measurements. The accelerometer is always used at standstill. Where it is not
 * available, the lateral acceleration on a road of the mean bank replaces it. */
static void select_signals(oc_tick *tick, const oc_fault_watch *watch, const oc_evidence *evidence,
                           const oc_params *p) {
    oc_signals *signals = &tick->signals;
    const bool stands = fabs(signals->vehicle_speed) <= p->standstill_speed_max_m_s;
    signals->valid &= ~(tick->at_fault & ~(uint32_t)OC_HAS_STEERING_WHEEL_ANGLE);
    if ((tick->disturbed & OC_REASON_REVERSE) != 0) {
        drive_backward(signals);
    }
    if (!p->use_accelerometer && !stands) {
        signals->valid &= ~(uint32_t)OC_HAS_LATERAL_ACCELERATION;
    }
    if ((signals->valid & OC_HAS_LATERAL_ACCELERATION) == 0) {
        signals->lateral_acceleration = lateral_acceleration_on_mean_bank(signals, evidence);
    }
    tick->measured = signals->valid;
    tick->suspected = oc_fault_suspected(watch);
    const bool angle_at_fault = (tick->at_fault & OC_HAS_STEERING_WHEEL_ANGLE) != 0;
    if (angle_at_fault || is_angle_discarded(watch, tick->suspected, p->method)) {
        signals->valid &= ~(uint32_t)OC_HAS_STEERING_WHEEL_ANGLE;
    }
}

/* Whether the torque replaces an accelerometer that is not used. */
static bool needs_torque(const oc_coefficients *c) {
    return ((uint32_t)c->needed & OC_HAS_STEERING_WHEEL_TORQUE) != 0;
}

/* rad, of a rear axle that steers; else 0, whatever the signal has. */
static double rear_axle_angle_of(const oc_signals *signals, const oc_coefficients *c) {
    return c->ratio_times_rear_weight > 0.0 ? signals->rear_axle_angle - c->params.known_rear_axle_zero_rad : 0.0;
}

/* 5.5.4: speed and yaw rate of the axle, for equal radii of its wheels. */
static void sense_by_wheels(oc_tick *tick, const oc_coefficients *c) {
    const oc_signals *signals = &tick->signals;
    const bool rear = c->wheel_axle == OC_AXLE_REAR;
    const double left = rear ? signals->wheel_speed_rear_left : signals->wheel_speed_front_left;
    const double right = rear ? signals->wheel_speed_rear_right : signals->wheel_speed_front_right;
    const oc_vehicle *vehicle = &c->vehicle;
    const double curvature =
        rear ? oc_wheel_speed_rear_curvature(vehicle->track_width_rear, left, right, 0.0)
             : oc_wheel_speed_front_curvature(vehicle->wheelbase, vehicle->track_width_front, left, right, 0.0);
    tick->sensed.speed = 0.5 * (left + right);
    tick->sensed.yaw_rate = curvature * tick->sensed.speed;
    tick->sensed.lateral_acceleration = 0.0;
    tick->sensed.use_accelerometer = false;
}

/* The torque sensor's zero replaces the accelerometer's; without one the torque gives the bank. */
static void sense_by_torque(oc_tick *tick, oc_evidence *evidence, const oc_coefficients *c) {
    const bool has_torque = (tick->signals.valid & OC_HAS_STEERING_WHEEL_TORQUE) != 0;
    const bool instead = needs_torque(c);
    if (c->params.method != OC_METHOD_JOINT || !(has_torque || evidence->torque.started)) {
        return;
    }
    const oc_torque_tick by = {
        .torque = tick->signals.steering_wheel_torque,
        .angle = tick->signals.steering_wheel_angle,
        .acceleration = instead ? (tick->signals.yaw_rate - tick->yaw_rate_bias) * tick->signals.vehicle_speed
                                : tick->sensed.lateral_acceleration,
        .speed = tick->disturbed == 0 ? tick->sensed.speed : 0.0, /* the driver's torque is not the road's */
        .has_torque = has_torque,
    };
    tick->sensed.lateral_acceleration = oc_torque_update(&evidence->torque, &c->torque, &by);
    tick->sensed.use_accelerometer = tick->sensed.use_accelerometer || instead;
}

static void sense(oc_tick *tick, oc_evidence *evidence, const oc_coefficients *c) {
    if (c->params.method == OC_METHOD_WHEEL_SPEED) {
        sense_by_wheels(tick, c);
        return;
    }
    tick->sensed.use_accelerometer = c->params.use_accelerometer != 0;
    tick->sensed.yaw_rate = tick->signals.yaw_rate;
    tick->sensed.speed = tick->signals.vehicle_speed;
    tick->sensed.lateral_acceleration = tick->sensed.use_accelerometer ? tick->signals.lateral_acceleration : 0.0;
    sense_by_torque(tick, evidence, c);
}

/* A torque that is not proportional to the lateral force counts as missing. */
static bool lacks_torque(const oc_evidence *evidence, const oc_coefficients *c) {
    return needs_torque(c) && !oc_torque_is_trusted(&evidence->torque, &c->torque);
}

/* Without all signals the filters keep their state, and pending blocks are dropped. */
static void wait_for_signals(oc_tick *tick, oc_tracking *tracking, oc_standstill *standstill) {
    oc_pending_drop(&tracking->straight);
    oc_pending_drop(&tracking->cornering);
    standstill->still_ticks = 0;
    tick->reasons = tick->at_fault != 0 ? OC_REASON_SIGNAL_FAULT : OC_REASON_MISSING_SIGNAL;
}

/* A hole precedes this tick, or the clock was set back. Half a tick is a margin for rounded time stamps. */
static void watch_holes(oc_tick *tick, oc_tracking *tracking, const oc_coefficients *c) {
    const double hole = tick->signals.time - tracking->last_complete - 0.5 * c->tick_s;
    tick->after_hole =
        tracking->has_complete && (hole < -c->tick_s || (hole > c->params.gap_max_s && hole > c->tick_s));
    tracking->last_complete = tick->signals.time;
    tracking->has_complete = 1;
}

/* Below the speed at which the signal begins, the truck may creep along the circle of its steering wheel angle. */
static void watch_speed_floor(oc_tick *tick, oc_state *state, const oc_coefficients *c) {
    const oc_learned *learned = &state->learned;
    const bool has_offset = learned->offset.status != OC_UNOBSERVABLE;
    const oc_signals *signals = &tick->signals;
    tick->creep = 0.0;
    if ((signals->valid & OC_HAS_VEHICLE_SPEED) == 0) {
        return;
    }
    if (fabs(signals->vehicle_speed) > c->params.standstill_speed_max_m_s) {
        oc_speed_floor_update(&state->evidence.speed_floor, (float)signals->vehicle_speed, (float)c->tick_s);
        return;
    }
    const double straight = has_offset ? near_straight : near_unknown_straight;
    const double rear_part = c->ratio_times_rear_weight * rear_axle_angle_of(signals, c);
    const double turned = fabs(signals->steering_wheel_angle - rear_part - learned->offset.value) - straight;
    if (oc_signals_has(signals->valid, c->steered) && turned > 0.0) {
        const float resolution = oc_signal_resolution(&state->tracking.assignment.watches[OC_SPEED_WATCH]);
        const float speed = oc_max(oc_speed_floor_get(&state->evidence.speed_floor), resolution);
        tick->creep = (double)speed * turned / c->ratio_times_wheelbase;
    }
}

/* Averages the sensors' zero errors at standstill. Afterwards the filters begin anew, so that an ignition cycle during
 * a standstill loses nothing. */
static void average_standstill(oc_tick *tick, oc_standstill *standstill, const oc_coefficients *c) {
    const oc_signals *signals = &tick->signals;
    if (tick->after_hole) {
        standstill->still_ticks = 0;
    }
    if (!(signals->valid & OC_HAS_YAW_RATE)) {
        return;
    }
    const double speed_max = c->params.standstill_speed_max_m_s;
    oc_standstill_update(standstill, c->gyro_bias.settling_ticks, tick->sensed.speed, speed_max, signals->yaw_rate,
                         signals->lateral_acceleration, (signals->valid & OC_HAS_LATERAL_ACCELERATION) != 0,
                         tick->creep);
    tick->stands = standstill->still_ticks >= c->gyro_bias.settling_ticks && fabs(tick->sensed.speed) <= speed_max;
    tick->reasons = tick->stands ? OC_REASON_SPEED : 0;
}

/* 5.1.1: filter, delay, differentiate. */
static void preprocess(oc_tick *tick, oc_tracking *tracking, const oc_coefficients *c) {
    const oc_preprocess *design = &c->preprocess;
    const oc_sensed *by = &tick->sensed;
    const double angle = tick->signals.steering_wheel_angle;
    const double rear = rear_axle_angle_of(&tick->signals, c);
    tick->reasons = tick->after_hole ? OC_REASON_GAP : 0;
    if (!tracking->running || tick->after_hole) {
        oc_preprocess_restart(&tracking->preprocess, design, angle, by->yaw_rate, by->speed, by->lateral_acceleration,
                              rear);
        tracking->joint.running = 0;
        tracking->running = 1;
    }
    tick->filtered = oc_preprocess_update(&tracking->preprocess, design, angle, by->yaw_rate, by->speed,
                                          by->lateral_acceleration, rear);
    if (!oc_preprocess_settled(&tracking->preprocess, design)) {
        tick->reasons |= OC_REASON_SETTLING;
    }
}

/* 5.1.2: the truck's motion, and the gate. */
static void follow_motion(oc_tick *tick, oc_evidence *evidence, const oc_coefficients *c) {
    const oc_params *p = &c->params;
    oc_filtered *filtered = &tick->filtered;
    if (p->method == OC_METHOD_WHEEL_SPEED) {
        oc_correct_wheel_speeds(tick, evidence, c);
    }
    if (p->method == OC_METHOD_JOINT) {
        filtered->yaw_rate -= tick->yaw_rate_bias;
    }
    tick->reasons |= tick->disturbed;
    tick->motion = oc_motion_of(filtered, c->ratio_times_wheelbase, c->ratio_times_rear_weight,
                                tick->sensed.use_accelerometer);
    if (p->method == OC_METHOD_JOINT) {
        tick->reasons |= oc_joint_gate(p, &tick->motion, filtered->vehicle_speed, evidence->joint.bank_mean);
        tick->reasons |= oc_gyro_bias_alarmed(&evidence->gyro_bias) ? OC_REASON_YAW_RATE_BIAS : 0u;
    } else {
        tick->reasons |= oc_gate(p, &tick->motion, filtered->vehicle_speed);
    }
    if (!(tick->reasons & (OC_REASON_SETTLING | OC_REASON_SPEED))) {
        evidence->bank_ticks += 1.0;
        evidence->bank_sum += tick->motion.bank;
        oc_bank_watch_update(&evidence->bank_watch, tick->motion.bank, 60.0 * c->rate_hz);
    }
    tick->moves = true;
}

static void count(oc_evidence *evidence, uint32_t reasons) {
    for (uint32_t k = 0, left = reasons; left != 0; ++k, left >>= 1) {
        evidence->rejected[k] += left & 1u;
    }
    evidence->unused_motion += (reasons & ~(uint32_t)OC_REASON_TIME) != 0;
}

/* New estimates where evidence grew or was corrected. */
static void learn(oc_evidence *evidence, oc_learned *learned, const oc_coefficients *c) {
    if (c->params.method == OC_METHOD_JOINT) {
        oc_learn_jointly(evidence, &evidence->verdicts, learned, c);
        evidence->gyro_bias.past.memory_s = oc_joint_memory(&evidence->joint, &c->joint);
    } else {
        oc_learn_straight_ahead(evidence, &evidence->verdicts, learned, c);
    }
    oc_learn_truck(learned, &evidence->joint, c);
}

/* The step from clean motion to estimates, by the selected method. */
static void estimate(const oc_tick *tick, oc_tracking *tracking, oc_evidence *evidence, oc_learned *learned,
                     const oc_coefficients *c) {
    if (c->params.method == OC_METHOD_JOINT) {
        oc_estimate_jointly(tick, tracking, evidence, c);
    } else if (tick->moves && oc_estimate_straight_ahead(tick, tracking, evidence, c)) {
        learn(evidence, learned, c);
    }
}

/* The most urgent piece of deferred work; false if there is none. The hypotheses wait for missing signals, as their
 * next samples do. */
static bool work_piece(oc_state *state, const oc_coefficients *c, bool has_all) {
    oc_evidence *evidence = &state->evidence;
    oc_joint_tracking *joint = &state->tracking.joint;
    if (evidence->gyro_bias.due > 0) {
        oc_gyro_bias_work(&evidence->gyro_bias, &c->gyro_bias, &c->params);
    } else if (joint->due > 0 && has_all) {
        if (oc_joint_work(&evidence->joint, joint, &c->joint, &state->learned.offset, state->tracking.last_complete)) {
            learn(evidence, &state->learned, c);
        }
    } else if (evidence->torque.due > 0) {
        oc_torque_work(&evidence->torque, &c->torque);
    } else {
        return false;
    }
    return true;
}

/* The queue of deferred work, since a second's work takes too long for one tick: what earlier ticks left. */
static void work(oc_state *state, const oc_coefficients *c, bool has_all) {
    int32_t left = c->pieces_per_tick;
    while (left > 0 && work_piece(state, c, has_all)) {
        --left;
    }
}

/* Figure 15. A tick that is rejected, incomplete or at standstill does not reach the gate. */
static void step(oc_state *state, const oc_coefficients *c, oc_tick *tick) {
    oc_tracking *tracking = &state->tracking;
    oc_evidence *evidence = &state->evidence;
    oc_gyro_bias *gyro_bias = &evidence->gyro_bias;

    tick->stands = tick->moves = false;

    /* a tick whose time does not increase, or not by the rate, is rejected */
    const oc_clock_verdict verdict =
        oc_clock_update(&tracking->clock, c->ticks_until_new_clock, c->tick_s, tick->signals.time);
    if (verdict == OC_CLOCK_REJECTS) {
        tick->reasons = OC_REASON_TIME;
        tick->angle = (oc_angle){0};
        count(evidence, tick->reasons);
        return;
    }
    tick->clock_set_back = verdict == OC_CLOCK_SET_BACK;
    ++evidence->ticks;

    const uint32_t sent = tick->signals.valid;
    tick->signals.valid = oc_signals_measured(&tick->signals);
    take_statuses(tick, tracking, c);

    /* whether each signal is what its name says */
    check_assignment(tick, sent, &tracking->assignment, &c->assignment);
    select_signals(tick, &tracking->fault, evidence, &c->params);

    /* what earlier ticks deferred */
    const bool has_all = oc_signals_has(tick->signals.valid, c->needed);
    work(state, c, has_all);

    /* 5.3.1: the gyro's bias, also without an angle */
    if ((tick->disturbed & OC_REASON_INTERVENTION) != 0) {
        tick->signals.valid &= ~(uint32_t)OC_WHEEL_SPEEDS; /* the wheels slip */
    }
    watch_speed_floor(tick, state, c);
    oc_gyro_bias_update(gyro_bias, &c->gyro_bias, &c->params, &tick->signals, tick->creep);
    set_yaw_rate_bias(tick, gyro_bias, &c->params);

    /* chapter 4: the motion for the observer */
    oc_observe_motion(tick, tracking, c);

    /* the method's sensors */
    if (has_all) {
        sense(tick, evidence, c);
    }
    if (!has_all || lacks_torque(evidence, c)) {
        wait_for_signals(tick, tracking, &evidence->standstill);
    } else {
        watch_holes(tick, tracking, c);
        /* standstill: zero errors of the sensors */
        average_standstill(tick, &evidence->standstill, c);
        if (tick->stands) {
            tracking->running = 0;
        } else {
            /* 5.1.1: filter, delay, differentiate */
            preprocess(tick, tracking, c);
            /* 5.1.2: motion and gate */
            follow_motion(tick, evidence, c);
        }
        /* 5.1.3: offset and understeer gradient */
        estimate(tick, tracking, evidence, &state->learned, c);
    }
    count(evidence, tick->reasons);

    /* chapter 4: the sensor, and the angle without it */
    oc_follow_angle(tick, tracking, evidence, &state->learned, c);
}

static void step_and_publish(oc_state *state, const oc_coefficients *c, oc_tick *tick, oc_output *output) {
    step(state, c, tick);
    if (output != NULL) {
        oc_publish(output, state, c, tick);
    }
}

oc_error oc_check_call(const oc_state *state, const oc_coefficients *c) {
    if (state == NULL || c == NULL) {
        return OC_ERROR_NULL;
    }
    if (!(c->rate_hz >= (double)OC_RATE_MIN_HZ && c->rate_hz <= (double)OC_RATE_MAX_HZ)) {
        return OC_ERROR_SETUP;
    }
    return state->ready == OC_STATE_READY ? OC_OK : OC_ERROR_STATE;
}

oc_error oc_step(oc_state *state, const oc_coefficients *coefficients, const oc_signals *signals, oc_output *output) {
    const oc_error error = signals == NULL ? OC_ERROR_NULL : oc_check_call(state, coefficients);
    if (error != OC_OK) {
        if (output != NULL) {
            memset(output, 0, sizeof *output);
            output->reasons = OC_REASON_MISSING_SIGNAL;
        }
        return error;
    }
    oc_tick tick = {.signals = *signals};
    step_and_publish(state, coefficients, &tick, output);
    return OC_OK;
}

/* The columns are in the order of the signals and of their bits. */
static void take_row(oc_signals *signals, const oc_columns *columns, size_t row, uint32_t valid) {
    const double *const *column = &columns->steering_wheel_angle;
    double *signal = &signals->steering_wheel_angle;
    signals->time = columns->time[row];
    signals->valid = valid;
    for (uint32_t k = 0, left = valid; left != 0; ++k, left >>= 1) {
        if ((left & 1u) != 0) {
            signal[k] = column[k][row];
        }
    }
}

void oc_run(oc_state *state, const oc_coefficients *coefficients, const oc_columns *columns, oc_output *outputs) {
    const double *const *column = &columns->steering_wheel_angle;
    oc_tick tick = {.reasons = 0};
    uint32_t valid = 0;
    for (uint32_t k = 0; k < OC_SIGNAL_COUNT; ++k) {
        valid |= column[k] != NULL ? 1u << k : 0u;
    }
    for (size_t row = 0; row < columns->count; ++row) {
        take_row(&tick.signals, columns, row, valid);
        step_and_publish(state, coefficients, &tick, outputs == NULL ? NULL : &outputs[row]);
    }
}

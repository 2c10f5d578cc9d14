#include "methods.h"

#include <math.h>

/* Tuned, in tuned.toml: without_sensor */
static const float flank_s_min = 8.0f; /* s: load of a flank below which the offset may include half the play */
static const float unloaded_half_play_sd = 0.07f; /* rad: sd of half a play of up to 15 deg; 4 deg */
static const float judge_after_s = 400.0f; /* s: comparison until the learned truck is accurate enough */
static const float braked_angle_sd = 0.17f; /* rad: sd of the estimated angle while brakes turn the truck; 10 deg */
static const double gap_s_min = 0.3; /* s: a gap after which the observer restarts */
/* end */

static bool is_identified(const oc_learned *learned) {
    const oc_status status = learned->offset.status;
    return status == OC_VALID || status == OC_CONVERGING;
}

/* Without an accelerometer the joint method's lateral force is a share of r*v, the observer's all of r*v. */
void oc_learn_truck(oc_learned *l, const oc_joint *joint, const oc_coefficients *c) {
    const oc_play *play = &joint->hypotheses[joint->best].play;
    const bool creeps_by_load = play->friction >= 0.0f;
    const double L = c->vehicle.wheelbase;
    const float flank_s = joint->loaded_left_s < joint->loaded_right_s ? joint->loaded_left_s : joint->loaded_right_s;
    const float sd = (float)l->offset.standard_deviation;
    const float unloaded = flank_s < flank_s_min ? (1.0f - flank_s / flank_s_min) * unloaded_half_play_sd : 0.0f;
    const float tyre_share = c->joint.tyre_share;
    l->truck = (oc_angle_truck){
        .offset_sd = sqrtf(sd * sd + unloaded * unloaded),
        .gradient = tyre_share * (float)l->understeer_gradient.value,
        .gradient_sd = tyre_share * (float)l->understeer_gradient.standard_deviation,
        .wheelbase = l->equivalent_wheelbase.evidence > 0.0 ? (float)(l->equivalent_wheelbase.value / L - 1.0) : 0.0f,
        .backlash = (float)l->backlash.value,
        .unloading = (float)l->unloading_acceleration.value / tyre_share,
        .unloading_sd = (float)l->unloading_acceleration.standard_deviation / tyre_share,
        .wander = oc_joint_wanders(joint) ? c->joint.hypothesis.wander / (tyre_share * tyre_share) : 0.0f,
        .tandem = oc_joint_tandem(joint, &c->joint) / tyre_share,
        .friction = creeps_by_load ? play->friction / tyre_share : 0.0f,
        .creep = creeps_by_load ? play->creep * tyre_share : 0.0f,
        .yaw_rate_noise = oc_noise_in_mean(&joint->second.noise, OC_NOISE_OF_YAW_RATE),
        .left_s = joint->loaded_left_s,
        .right_s = joint->loaded_right_s,
        .identified = is_identified(l),
    };
}

static double front_wheel_by_wheels(const oc_coefficients *c, const oc_gyro_bias *gyro_bias, const oc_signals *tick) {
    const oc_vehicle *v = &c->vehicle;
    const double mismatch = oc_gyro_bias_mismatch(gyro_bias, &c->params, OC_AXLE_FRONT).value;
    const double left = tick->wheel_speed_front_left, right = tick->wheel_speed_front_right;
    return c->params.angle_method == OC_ANGLE_WHEEL_SPEED_EXACT
               ? oc_front_wheel_exact(v->wheelbase, v->track_width_front, left, right, mismatch)
               : oc_wheel_speed_front_angle(v->wheelbase, v->track_width_front, left, right, mismatch);
}

static bool by_wheel_speed(const oc_params *p) {
    return p->angle_method == OC_ANGLE_WHEEL_SPEED || p->angle_method == OC_ANGLE_WHEEL_SPEED_EXACT;
}

/* The share that the present flank lacks of its required time, 0 to 1. The play was identified on the other flank, and
 * may be wider on this one. */
static float flank_deficit(const oc_angle_truck *truck, float place) {
    const float flank_s = place > 0.0f ? truck->left_s : truck->right_s;
    return flank_s < flank_s_min ? fabsf(place) * (1.0f - flank_s / flank_s_min) : 0.0f;
}

/* A remounted sensor: its offset changed by the difference to the estimate. Only the joint method can adapt an
 * offset. */
static void learn_remount(oc_tracking *tracking, oc_joint *joint, const oc_estimate *offset) {
    oc_fault_watch *watch = &tracking->fault;
    watch->offset += watch->steady_difference;
    const oc_change change = {
        .kind = OC_CHANGE_OFFSET,
        .size = watch->offset - (float)offset->value,
        .size_sd = tracking->angle.sd,
    };
    oc_joint_note_change(joint, &change, offset, watch->since);
}

/* Uses the previous tick's estimate, so that a jump is never published. */
static void judge_sensor(const oc_tick *tick, oc_tracking *tracking, oc_evidence *evidence, const oc_learned *learned,
                         const oc_coefficients *c, bool has_angle) {
    const oc_angle_truck *truck = &learned->truck;
    const oc_angle_tracking *angle = &tracking->angle;
    oc_fault_tick judged = {
        .time = tick->signals.time,
        .tick_s = c->angle.tick_s,
        .judged_s = oc_angle_is_due(angle) ? c->angle.check_s : 0.0f,
        .measured = has_angle ? (float)tick->signals.steering_wheel_angle : 0.0f,
        .estimate = angle->estimate,
        .speed = tick->observed.speed,
        .has_measured = has_angle,
        .after_hole = tick->after_gap,
        .assisted = (tick->disturbed & OC_REASON_STEERING_ASSIST) != 0,
    };
    if (oc_fault_may_judge(&tracking->fault, &judged)) {
        judged.offset = (float)learned->offset.value;
        judged.offset_sd = truck->identified ? truck->offset_sd : unloaded_half_play_sd;
        judged.sd = angle->sd;
        judged.flank_deficit = flank_deficit(truck, angle->place);
        judged.is_accurate = oc_angle_is_accurate(angle);
        judged.can_judge = (tick->at_fault & ~(uint32_t)OC_HAS_STEERING_WHEEL_ANGLE) == 0 &&
                           tick->observed.has_motion &&
                           (tick->disturbed & (OC_REASON_INTERVENTION | OC_REASON_REVERSE)) == 0 &&
                           truck->identified && evidence->angle.seconds > judge_after_s;
    }
    const oc_fault before = evidence->fault.fault;
    const oc_fault now = oc_fault_update(&tracking->fault, &evidence->fault, &judged);
    if (now == OC_FAULT_REMOUNTED && before != now && before != OC_FAULT_NONE && c->params.method == OC_METHOD_JOINT) {
        learn_remount(tracking, &evidence->joint, &learned->offset);
    }
}

static bool is_after_gap(const oc_fault_watch *watch, double time) {
    return watch->running && time - watch->last_time > gap_s_min;
}

/* A signal that is not available may have any value, even one beyond single precision. */
static float measured_or_none(bool is_measured, double value) {
    return is_measured ? (float)value : 0.0f;
}

/* Chapter 4, the motion. After a gap the estimate begins anew. */
void oc_observe_motion(oc_tick *tick, oc_tracking *tracking, const oc_coefficients *c) {
    const oc_signals *signals = &tick->signals;
    if (tick->clock_set_back) {
        tracking->fault.running = 0;
        tracking->angle.running = 0;
    }
    tick->after_gap = is_after_gap(&tracking->fault, signals->time);
    if (tick->after_gap) {
        tracking->angle.running = 0;
    }
    /* the angle of a truck whose rear axle steers would need that of the rear axle, without its offset */
    const bool moves = oc_signals_has(tick->measured, c->observed) && c->ratio_times_rear_weight <= 0.0;
    tick->observed = (oc_angle_tick){
        .yaw_rate = measured_or_none(moves, signals->yaw_rate - tick->yaw_rate_bias),
        .yaw_rate_bias_sd = (float)tick->yaw_rate_bias_sd,
        .speed = measured_or_none(moves, signals->vehicle_speed),
        .lateral_acceleration = measured_or_none(moves, signals->lateral_acceleration),
        .has_motion = moves,
    };
    oc_angle_filter(&tracking->angle, &c->angle, &tick->observed);
}

/* Chapter 4: monitors the sensor, and estimates the angle without it. */
void oc_follow_angle(oc_tick *tick, oc_tracking *tracking, oc_evidence *evidence, const oc_learned *learned,
                     const oc_coefficients *c) {
    const oc_params *p = &c->params;
    const oc_signals *signals = &tick->signals;
    const bool has_angle = (tick->measured & OC_HAS_STEERING_WHEEL_ANGLE) != 0;
    judge_sensor(tick, tracking, evidence, learned, c, has_angle);
    oc_angle_tick *now = &tick->observed;
    now->accelerometer_lost = p->use_accelerometer && (tick->measured & OC_HAS_LATERAL_ACCELERATION) == 0;
    if (now->accelerometer_lost || (!p->use_accelerometer && !learned->truck.identified)) {
        now->bank_sd = (float)p->bank_sd_m_s2;
    }
    if (now->has_motion && by_wheel_speed(p)) {
        now->front_wheel = (float)front_wheel_by_wheels(c, &evidence->gyro_bias, signals);
    }
    now->lateral_speed =
        measured_or_none(now->has_motion && p->angle_method == OC_ANGLE_SIDE_SLIP, signals->lateral_speed);
    now->true_by_sensor = has_angle ? signals->steering_wheel_angle - learned->offset.value : 0.0;
    const bool angle_fits = (tick->at_fault & OC_HAS_STEERING_WHEEL_ANGLE) == 0;
    now->has_sensor =
        has_angle && angle_fits && !oc_offset_is_combined(c) && !oc_fault_excludes_angle(&tracking->fault);
    now->assisted = (tick->disturbed & OC_REASON_STEERING_ASSIST) != 0;
    now->braked_sd = (tick->disturbed & OC_REASON_INTERVENTION) != 0 ? braked_angle_sd : 0.0f;
    now->can_learn = oc_angle_checks(&tracking->angle) && has_angle && tick->at_fault == 0 && tick->disturbed == 0 &&
                     !now->accelerometer_lost && tracking->fault.fault == OC_FAULT_NONE &&
                     !oc_fault_suspected(&tracking->fault);
    oc_angle_update(&tracking->angle, &evidence->angle, &c->angle, &learned->truck, now, &tick->angle);
}

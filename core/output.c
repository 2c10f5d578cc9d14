#include "methods.h"

oc_status oc_offset_status(const oc_evidence *evidence, oc_status learned) {
    return learned != OC_UNOBSERVABLE && evidence->fault.fault != OC_FAULT_NONE ? OC_INVALID : learned;
}

void oc_tell(oc_output *output, const oc_state *state, const oc_coefficients *c, const oc_motion *motion, double speed,
             uint32_t reasons, const oc_angle *angle) {
    const oc_estimate bias = oc_gyro_bias_get(&state->evidence.gyro_bias, &c->params);
    *output = (oc_output){
        .time = state->tracking.last_time,
        .vehicle_speed = speed,
        .motion = *motion,
        .reasons = reasons,
        .offset_status = oc_offset_status(&state->evidence, state->learned.offset.status),
        .offset = state->learned.offset.value,
        .offset_sd = state->learned.offset.standard_deviation,
        .understeer_gradient = state->learned.understeer_gradient.value,
        .backlash = state->learned.backlash.value,
        .place = state->learned.backlash.evidence > 0.0
                     ? oc_joint_place(&state->evidence.joint)
                     : 0.0,
        .unloading_acceleration = state->learned.unloading_acceleration.value,
        .evidence = state->learned.offset.evidence,
        .yaw_rate_bias = bias.value,
        .yaw_rate_bias_sd = bias.standard_deviation,
        .angle = *angle,
        .fault = state->tracking.fault.fault,
        .fault_since = state->tracking.fault.since,
        .fault_confidence = state->tracking.fault.confidence,
    };
}

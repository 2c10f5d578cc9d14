#include "methods.h"

oc_status oc_offset_status(const oc_state *state, oc_status learned) {
    const bool sensor_fault = state->evidence.fault.fault != OC_FAULT_NONE;
    return state->tracking.assignment.at_fault != 0 || (learned != OC_UNOBSERVABLE && sensor_fault) ? OC_INVALID
                                                                                                   : learned;
}

oc_fault oc_published_fault(const oc_state *state) {
    const bool another = (state->tracking.assignment.at_fault & ~OC_HAS_STEERING_WHEEL_ANGLE) != 0;
    return another ? OC_FAULT_NONE : state->evidence.fault.fault;
}

bool oc_offset_is_combined(const oc_coefficients *c) {
    return c->ratio_times_rear_weight > 0.0 && !(c->params.known_rear_axle_zero_sd_rad > 0.0);
}

void oc_publish(oc_output *output, const oc_state *state, const oc_coefficients *c, const oc_tick *tick) {
    const oc_estimate bias = oc_gyro_bias_get(&state->evidence.gyro_bias, &c->params);
    output->time = state->tracking.clock.last_time;
    output->vehicle_speed = tick->moves ? tick->filtered.vehicle_speed : 0.0;
    output->motion = tick->moves ? tick->motion : (oc_motion){0};
    output->reasons = tick->reasons;
    const oc_status learned = oc_offset_is_combined(c) ? OC_UNOBSERVABLE : state->learned.offset.status;
    output->offset_status = oc_offset_status(state, learned);
    output->offset = state->learned.offset.value;
    output->offset_sd = state->learned.offset.standard_deviation;
    output->offset_parts = state->learned.parts;
    output->offset_lean = state->learned.offset.lean;
    output->understeer_gradient = state->learned.understeer_gradient.value;
    output->backlash = state->learned.backlash.value;
    output->place = state->learned.backlash.evidence > 0.0
                 ? oc_joint_place(&state->evidence.joint, &state->tracking.joint)
                 : 0.0;
    output->unloading_acceleration = state->learned.unloading_acceleration.value;
    output->evidence = state->learned.offset.evidence;
    output->yaw_rate_bias = bias.value;
    output->yaw_rate_bias_sd = bias.standard_deviation;
    output->angle = tick->angle;
    output->fault = oc_published_fault(state);
    output->fault_since = state->tracking.fault.since;
    output->fault_confidence = state->tracking.fault.confidence;
    output->signal_fault = state->tracking.assignment.fault;
    output->signals_at_fault = state->tracking.assignment.at_fault;
}

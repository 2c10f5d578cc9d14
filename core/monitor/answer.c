/* The answer on request; no tick calls it. */
#include "methods.h"
#include "monitor.h"

#include <math.h>
#include <string.h>

/* Derived. */
enum { window_bit = 8 }; /* of OC_REASON_WINDOW, 1 << 8 */

/* The count is below 2^63: the library's conversion is slow on a Cortex-M. */
static double to_double(uint64_t count) {
    return (double)(uint32_t)(count >> 32) * 4294967296.0 + (double)(uint32_t)count;
}

/* Whether the bias is observable by wheel speeds since the last standstill. */
static bool has_wheel_bias(const oc_evidence *evidence, const oc_coefficients *c) {
    return evidence->gyro_bias.wheel_evidence > 0.0 &&
           oc_gyro_bias_get(&evidence->gyro_bias, &c->params).status != OC_UNOBSERVABLE;
}

static oc_estimate yaw_rate_bias_of(const oc_evidence *evidence, const oc_coefficients *c) {
    return has_wheel_bias(evidence, c)
               ? oc_gyro_bias_get(&evidence->gyro_bias, &c->params)
               : oc_standstill_yaw_rate(&evidence->standstill, c->tick_s, c->params.standstill_time_min_s);
}

static oc_offset_covariances covariances_of(const oc_evidence *evidence, const oc_coefficients *c) {
    oc_joint_answer found;
    if (c->params.method != OC_METHOD_JOINT || !(evidence->joint.second.used_s > 0.0f)) {
        return (oc_offset_covariances){0};
    }
    oc_joint_answer_get(&found, &evidence->joint, &c->joint);
    return (oc_offset_covariances){
        .understeer_gradient = (double)found.offset_covariance[OC_OF_GRADIENT],
        .unloading_acceleration = (double)found.offset_covariance[OC_OF_UNLOADING],
        .backlash = (double)found.offset_covariance[OC_OF_WIDTH],
    };
}

oc_error oc_answer_get(const oc_state *state, const oc_coefficients *c, oc_answer *answer) {
    const oc_error error = answer == NULL ? OC_ERROR_NULL : oc_check_call(state, c);
    if (error != OC_OK) {
        if (answer != NULL) {
            memset(answer, 0, sizeof *answer);
        }
        return error;
    }
    const oc_evidence *now = &state->evidence;
    oc_verdicts verdicts = now->verdicts; /* a copy: a query changes no status */
    oc_learned learned = state->learned;  /* updated by a standstill since the last final block */
    const bool jointly = c->params.method == OC_METHOD_JOINT;
    if (jointly) {
        oc_learn_jointly(now, &verdicts, &learned, c);
    } else {
        oc_learn_straight_ahead(now, &verdicts, &learned, c);
    }
    learned.offset.status = oc_offset_status(state, learned.offset.status);
    const double used = jointly ? (double)now->joint.second.used_s / c->tick_s : now->offset.ticks.weight;
    const double K = learned.understeer_gradient.value;
    const double time_min = c->params.standstill_time_min_s;
    const double ticks = to_double(now->ticks);
    answer->offset = learned.offset;
    answer->offset_parts = learned.parts;
    answer->offset_covariances = covariances_of(now, c);
    answer->offset_temporary =
        jointly ? learned.offset.value
                : oc_temporary_offset(state, K) + learned.offset.value - oc_offset_value(&now->offset, K);
    answer->offset_variance_if_independent = oc_offset_variance_if_independent(&now->offset, K);
    answer->understeer_gradient = learned.understeer_gradient;
    answer->backlash = learned.backlash;
    answer->unloading_acceleration = learned.unloading_acceleration;
    answer->equivalent_wheelbase = learned.equivalent_wheelbase;
    answer->changes = jointly ? now->joint.changes : 0;
    answer->fault = oc_published_fault(state);
    answer->signal_fault = state->tracking.assignment.fault;
    answer->signals_at_fault = state->tracking.assignment.at_fault;
    answer->signal_fault_value = (double)state->tracking.assignment.value;
    answer->yaw_rate_bias = yaw_rate_bias_of(now, c);
    answer->yaw_rate_bias_wheel_time = has_wheel_bias(now, c) ? now->gyro_bias.wheel_evidence : 0.0;
    answer->yaw_rate_bias_alarm_time = now->gyro_bias.alarm_time;
    answer->wheel_radius_mismatch_rear = oc_gyro_bias_mismatch(&now->gyro_bias, &c->params, OC_AXLE_REAR);
    answer->wheel_radius_mismatch_front = oc_gyro_bias_mismatch(&now->gyro_bias, &c->params, OC_AXLE_FRONT);
    answer->leaked_rear = oc_gyro_bias_leaked(&now->gyro_bias, OC_AXLE_REAR);
    answer->leaked_front = oc_gyro_bias_leaked(&now->gyro_bias, OC_AXLE_FRONT);
    answer->standstill_lateral_acceleration = oc_standstill_lateral_acceleration(&now->standstill, c->tick_s, time_min);
    answer->loaded_left_s = (double)now->joint.loaded_left_s;
    answer->loaded_right_s = (double)now->joint.loaded_right_s;
    answer->unexplained = sqrt((double)now->joint.second.reference);
    answer->yaw_rate_noise = sqrt((double)oc_noise_in_mean(&now->joint.second.noise, OC_NOISE_OF_YAW_RATE));
    answer->steered_by = (double)oc_joint_steered_by(&now->joint);
    answer->steered_s = answer->steered_by > 0.0 ? fabs((double)now->joint.outlying_s) : 0.0;
    answer->steered_since_s = answer->steered_by > 0.0 ? (double)now->joint.outlying_since_s : 0.0;
    answer->lacking_to_left = jointly ? oc_joint_flank_lacking(&now->joint, &c->joint, 1) : 0.0;
    answer->lacking_to_right = jointly ? oc_joint_flank_lacking(&now->joint, &c->joint, -1) : 0.0;
    answer->offset_per_yaw_rate_bias = !jointly ? now->offset.ticks.w
                                : now->joint.speed_mean > 0.0 ? c->ratio_times_wheelbase / now->joint.speed_mean
                                                             : 0.0;
    answer->bank_mean = now->bank_ticks > 0.0 ? now->bank_sum / now->bank_ticks : 0.0;
    answer->traffic_side = (double)oc_traffic_side(now, c);
    answer->bank_time = now->bank_ticks * c->tick_s;
    answer->bank_low = now->bank_watch.low;
    answer->bank_high = now->bank_watch.high;
    answer->accelerometer_wanders = jointly && oc_joint_wanders(&now->joint);
    answer->offset_walks = jointly && oc_joint_walks(&now->joint);
    answer->accelerometer_runs_away = oc_bank_watch_drifts(&now->bank_watch);
    answer->duration = ticks * c->tick_s;
    answer->used = used * c->tick_s;
    answer->unused = (ticks - used) * c->tick_s;
    for (int32_t k = 0; k < OC_REASON_COUNT; ++k) {
        answer->rejected[k] = to_double(now->rejected[k]) * c->tick_s;
    }
    for (int32_t k = 0; k < OC_CHANGES_MAX; ++k) {
        answer->changed[k] = now->joint.changed[k];
    }
    answer->rejected[window_bit] = (ticks - to_double(now->unused_motion) - used) * c->tick_s;
    return OC_OK;
}

oc_error oc_answer_by_priors(oc_state *copy, const oc_coefficients *c, oc_answer *answer) {
    if (oc_check_call(copy, c) == OC_OK && c->params.method == OC_METHOD_JOINT &&
        copy->evidence.joint.second.used_s > 0.0f) {
        oc_solve_jointly(&copy->tracking, &copy->evidence, c);
    }
    return oc_answer_get(copy, c, answer);
}

#include "saved_plausible.h"

#include <math.h>

#include "bounds.h"

/* Numerical. */
/* Against overflow; wider than any drive needs. */
static const float angle_max = 200.0f;        /* rad */
static const float yaw_rate_max = 10.0f;      /* rad/s */
static const float acceleration_max = 100.0f; /* m/s^2 */
static const float speed_max = 150.0f;        /* m/s */
static const float second_max = 1.5f;         /* s, and 1 of a cosine */

/* Of numbers that follow one another. */
static bool none_negative(const double *of, size_t count) {
    for (size_t k = 0; k < count; ++k) {
        if (of[k] < 0.0) {
            return false;
        }
    }
    return true;
}

static bool is_within(float value, float limit) {
    return fabsf(value) <= limit;
}

typedef struct {
    float lower[OC_TERMS_TRIANGLE], inverse[OC_TERMS];
} factor;

/* Whether a triangle is positive semidefinite but for rounding; and its factor, with an information of 1. Where a pivot
 * was raised, a row of the factor has more squares than the diagonal. */
static bool are_sums_of_squares(const float *triangle, float noise, factor *f) {
    float information[OC_TERMS], longest[OC_TERMS];
    for (int32_t row = 0; row < OC_TERMS; ++row) {
        information[row] = 1.0f;
        longest[row] = 1.000004f * oc_triangle_cell(triangle, row, row) / noise + 2.0f;
    }
    oc_triangle_factor(triangle, information, noise, f->lower, f->inverse);
    const float *cell = f->lower;
    for (int32_t row = 0; row < OC_TERMS; ++row) {
        float squares = 0.0f;
        for (int32_t column = 0; column <= row; ++column, ++cell) {
            squares += *cell * *cell;
        }
        if (!(squares <= longest[row])) {
            return false;
        }
    }
    return true;
}

/* Checks correlations, which have one scale; both triangles, since updates read rows of both. */
static bool is_covariance(const oc_gyro_bias *gyro_bias) {
    static const float negligible = 1e-6f; /* of a correlation, against rounding */
    factor f = {{0.0f}, {0.0f}};
    float per_sd[OC_GYRO_BIAS_STATES];
    float *cell = f.lower; /* of correlations first, then of their factor */
    for (int32_t row = 0; row < OC_GYRO_BIAS_STATES; ++row) {
        if (!is_within((float)gyro_bias->P[row][row], yaw_rate_max * yaw_rate_max)) {
            return false;
        }
        per_sd[row] = 1.0f / sqrtf((float)gyro_bias->P[row][row] + 1e-30f);
        for (int32_t column = 0; column <= row; ++column, ++cell) {
            const float scale = per_sd[row] * per_sd[column];
            *cell = scale * (float)gyro_bias->P[row][column];
            if (!(fabsf(scale * (float)gyro_bias->P[column][row] - *cell) <= negligible)) {
                return false;
            }
        }
    }
    return are_sums_of_squares(f.lower, negligible, &f);
}

/* Positive divisors, a positive semidefinite scatter, and products with the target within Cauchy-Schwarz. */
static bool is_hypothesis(const oc_hypothesis *h) {
    static const float target_squares = 1e9f; /* rad^2, numerical: a day's seconds, each a turn off */
    factor f;
    float toward[OC_TERMS];
    for (int32_t asked = 0; asked < OC_OF_COUNT; ++asked) {
        if (h->variances.of[asked] < 0.0f) {
            return false;
        }
    }
    for (int32_t term = 0; term < OC_TERMS; ++term) {
        toward[term] = h->toward[term];
    }
    const float noise = oc_hypothesis_noise(h);
    const bool has_sums = h->learned_s >= 0.0f && h->weight >= 0.0f && h->age >= 0.0f && h->pulled_variance >= 0.0f &&
                          h->blocks.factor >= 0.0f && h->long_blocks.factor >= 0.0f && h->variance > 1e-8f;
    return has_sums && h->play.half_width > 0.0f && is_within(h->play.unloading, acceleration_max) &&
           (h->play.friction < 0.0f || h->play.creep > 0.01f) &&
           are_sums_of_squares(h->scatter, noise, &f) &&
           oc_triangle_variance(f.lower, f.inverse, 0, toward) <= target_squares * noise;
}

static bool is_below(int32_t place, int32_t count) {
    return place >= 0 && place < count;
}

static bool is_moments(const oc_moments *moments) {
    return none_negative(&moments->weight, 3) && /* and yy and xx */
           is_within((float)moments->y, angle_max) && is_within((float)moments->x, acceleration_max);
}

static bool is_straight_ahead(const oc_offset *offset, const oc_understeer *understeer) {
    return is_moments(&offset->ticks) && is_moments(&offset->filling) && is_moments(&offset->batches) &&
           is_moments(&understeer->filling) && none_negative(&understeer->xx, 2) && /* and weight */
           none_negative(&understeer->batches, 5) && /* and sums of squares up to xx_xx */
           understeer->xx_xx <= 1.000001 * understeer->batches_xx * understeer->batches_xx;
}

static bool is_still_mean(const oc_still_mean *still, float limit) {
    return still->weight >= 0.0 && still->squares >= 0.0 && is_within((float)still->mean, limit);
}

static bool is_standstill(const oc_standstill *standstill) {
    return is_still_mean(&standstill->yaw_rate, yaw_rate_max) &&
           is_still_mean(&standstill->lateral_acceleration, acceleration_max) && standstill->still_ticks >= 0;
}

static bool is_status(oc_status status) {
    return (uint32_t)status < OC_STATUS_COUNT;
}

static bool are_hypotheses(const oc_joint *joint) {
    float age = 0.0f; /* of the oldest */
    for (int32_t k = 0; k < joint->count; ++k) {
        if (!is_hypothesis(&joint->hypotheses[k])) {
            return false;
        }
        age = oc_max(age, joint->hypotheses[k].age);
    }
    /* at least one is not on probation at the next second, else no hypothesis counts */
    const float used_s = joint->second.used_s;
    return !(used_s > 60.0f && age <= oc_clamp(0.05f * used_s, 60.0f, 600.0f));
}

static bool is_joint(const oc_joint *joint, const oc_joint_design *design) {
    const bool has_places = is_below(joint->count, OC_JOINT_HYPOTHESES + 1) &&
                            is_below(joint->best, joint->started ? joint->count : OC_JOINT_HYPOTHESES) &&
                            is_below(joint->next_start, OC_JOINT_LATER_STARTS) &&
                            is_below(joint->phase, design->ticks_per_sample) &&
                            is_below(joint->in_block, OC_SECONDS_PER_BLOCK) &&
                            is_below(joint->in_long_block, OC_SECONDS_PER_LONG_BLOCK) && joint->changes >= 0;
    for (int32_t k = 0; k < OC_CHANGES_MAX; ++k) {
        if ((uint32_t)joint->changed[k].change.kind > OC_CHANGE_BENDS) {
            return false;
        }
    }
    const oc_second *second = &joint->second;
    const bool is_second = second->used_s >= 0.0f && second->trial_s >= 0.0f && second->second_s <= second_max &&
                           second->memory_share >= 0.0f && second->memory_share <= 1.0f &&
                           fabsf(joint->along) <= second_max && fabsf(joint->across) <= second_max &&
                           is_within((float)joint->bank_mean, acceleration_max);
    return has_places && is_second &&
           (!joint->started || (are_hypotheses(joint) && second->second_s > 0.0f && second->reference > 0.0f));
}

static bool is_collected(const oc_collected *collected) {
    for (int32_t k = 0; k < OC_JOINT_SAMPLES; ++k) {
        if (!is_below(collected->samples[k].in_second + 1, OC_JOINT_SAMPLES + 1)) {
            return false;
        }
    }
    return is_below(collected->count, OC_JOINT_SAMPLES + 1);
}

/* Divisors of a round in progress are positive. */
static bool is_joint_tracking(const oc_joint_tracking *tracking, const oc_joint *joint, const oc_joint_design *design) {
    return is_within((float)tracking->bank, acceleration_max) &&
           is_within(tracking->prior.unloading_mean, acceleration_max) &&
           is_below(tracking->in_second + 1, OC_JOINT_SAMPLES + 1) && is_below(tracking->turns, 2 * joint->count + 2) &&
           is_below(tracking->next, OC_JOINT_SAMPLES + 1) &&
           is_collected(&tracking->filling) && is_collected(&tracking->taken) &&
           tracking->filling.count < design->samples_per_second &&
           (tracking->turns == 0 ||
            (tracking->prior.unloading_sd > 1e-6f && tracking->prior.yaw_rate_bias_sd > 1e-7f));
}

/* Pending blocks are at most as many as make one final. */
static bool is_pending(const oc_pending *pending, int32_t blocks_until_final) {
    for (int32_t k = 0; k < OC_PENDING_MAX; ++k) {
        if (!is_moments(&pending->blocks[k])) {
            return false;
        }
    }
    return is_below(pending->first, OC_PENDING_MAX) && is_below(pending->count, blocks_until_final + 1) &&
           pending->ticks >= 0 && is_within((float)pending->filling.y, 1e5f);
}

static bool is_angle(const oc_angle_tracking *tracking, const oc_angle_evidence *evidence) {
    return is_within(tracking->yaw_rate_first, yaw_rate_max) && is_within(tracking->yaw_rate, yaw_rate_max) &&
           is_within(tracking->speed, speed_max) && is_within(tracking->bank, acceleration_max) &&
           tracking->place_variance >= 0.0f && evidence->spread >= 0.0f && evidence->seconds >= 0.0f;
}

static bool is_tracking(const oc_tracking *tracking, const oc_coefficients *c) {
    const oc_preprocess_state *preprocess = &tracking->preprocess;
    for (int32_t k = 0; k < OC_DELAY_MAX; ++k) {
        if (!is_within((float)preprocess->angle[k], angle_max)) {
            return false;
        }
    }
    return is_below(preprocess->angle_next, OC_DELAY_MAX) && is_below(preprocess->speed_next, OC_SLOPE_POINTS) &&
           is_pending(&tracking->straight, c->blocks_until_final) &&
           is_pending(&tracking->cornering, c->blocks_until_final) &&
           (uint32_t)tracking->fault.fault < OC_FAULT_COUNT;
}

static bool is_gyro_bias(const oc_gyro_bias *gyro_bias) {
    const float memory_s = gyro_bias->past.memory_s;
    for (int32_t axle = 0; axle < OC_AXLE_COUNT; ++axle) {
        const oc_gyro_bias_axle *at = &gyro_bias->axles[axle];
        if (!none_negative(&at->weight, 7) || !is_within((float)at->noise, 1.0f)) { /* up to blocks */
            return false;
        }
    }
    for (int32_t k = 0; k < OC_GYRO_BIAS_STATES; ++k) {
        if (!is_within((float)gyro_bias->x[k], yaw_rate_max) || !is_within(gyro_bias->past.covariance[k], 1.0f)) {
            return false;
        }
    }
    return is_below(gyro_bias->due, 6) && is_status(gyro_bias->status) && is_covariance(gyro_bias) &&
           !(memory_s > 0.0f && memory_s < 0.1f) && gyro_bias->sd >= 0.0 &&
           none_negative(&gyro_bias->still_squares, 4) && /* up to wheel_evidence */
           is_within((float)gyro_bias->still_yaw_rate, 1e9f) && is_within(gyro_bias->past.bias, yaw_rate_max);
}

/* A second that is due has ticks, and the slope is a divisor where it is trusted. */
static bool is_torque(const oc_torque *torque) {
    static const float torque_max = 1e4f; /* N m, N m per m/s^2 */
    for (int32_t k = 0; k < OC_TORQUE_TERMS; ++k) {
        if (!is_within(torque->terms[k], torque_max)) {
            return false;
        }
    }
    for (int32_t k = 0; k < OC_TORQUE_TERMS * (OC_TORQUE_TERMS + 1) / 2; ++k) {
        if (!is_within(torque->covariance[k], torque_max)) {
            return false;
        }
    }
    return is_within(torque->place, 1.0f) && is_within(torque->angle, angle_max) &&
           is_within(torque->slow, acceleration_max) && torque->slow_s >= 0.0f &&
           is_within(torque->filling.torque, 1e6f) && is_within(torque->filling.acceleration, 1e6f) &&
           is_within(torque->filling.place, 256.0f) && is_below(torque->filling.ticks, 256) &&
           (!torque->due || torque->filling.ticks > 0);
}

static bool is_estimate(const oc_estimate *estimate) {
    return is_within((float)estimate->value, 1e5f) &&
           none_negative(&estimate->standard_deviation, 2) && /* and evidence */
           is_status(estimate->status);
}

static bool is_learned(const oc_learned *learned, bool has_place) {
    return is_estimate(&learned->offset) && is_estimate(&learned->understeer_gradient) &&
           is_estimate(&learned->backlash) && is_estimate(&learned->unloading_acceleration) &&
           is_estimate(&learned->equivalent_wheelbase) && (has_place || !(learned->backlash.evidence > 0.0));
}

bool oc_saved_plausible(const oc_state *state, const oc_coefficients *c) {
    const oc_evidence *evidence = &state->evidence;
    const oc_joint *joint = &evidence->joint;
    return is_straight_ahead(&evidence->offset, &evidence->understeer) && is_standstill(&evidence->standstill) &&
           is_joint(joint, &c->joint) && is_tracking(&state->tracking, c) &&
           is_joint_tracking(&state->tracking.joint, joint, &c->joint) && is_gyro_bias(&evidence->gyro_bias) &&
           is_torque(&evidence->torque) && is_angle(&state->tracking.angle, &evidence->angle) &&
           (uint32_t)evidence->fault.fault < OC_FAULT_COUNT &&
           is_learned(&state->learned, joint->hypotheses[joint->best].play.half_width > 0.0f);
}

#include "saved_plausible.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "bounds.h"

/* Numerical. */
/* Against overflow; wider than the values of any drive. */
enum {
    NOT_NEGATIVE, SHARE, PLACE, SECOND, YAW_RATE, ACCELERATION, SPEED, ANGLE, ESTIMATE, TORQUE, SUM, FORCES, SQUARES
};
static const struct {
    float low, high;
} limits[] = {
    [NOT_NEGATIVE] = {0.0f, 1e30f},
    [SHARE] = {0.0f, 1.0f},
    [PLACE] = {-1.0f, 1.0f},
    [SECOND] = {-1.5f, 1.5f}, /* s, and 1 of a cosine */
    [YAW_RATE] = {-10.0f, 10.0f}, /* rad/s */
    [ACCELERATION] = {-100.0f, 100.0f}, /* m/s^2 */
    [SPEED] = {-150.0f, 150.0f}, /* m/s */
    [ANGLE] = {-200.0f, 200.0f}, /* rad */
    [ESTIMATE] = {-1e5f, 1e5f}, /* and what combines several signals, as a_y - r v */
    [TORQUE] = {-1e4f, 1e4f}, /* N m, N m per m/s^2 */
    [SUM] = {-1e6f, 1e6f}, /* over a second's ticks */
    [FORCES] = {-1e8f, 1e8f}, /* the same of a rod's force */
    [SQUARES] = {-1e24f, 1e24f}, /* and their squares, of signals decoded from wrong bits */
};

/* Consecutive numbers in the state: offset of the first in bytes, count, range; for an array also the number of structs
 * and the step between two in words of four bytes. */
typedef struct {
    uint16_t place;
    uint8_t numbers, range, structs;
    uint16_t step;
} member;

/* Bytes of a word, and steps in words. */
enum {
    WORD = 4,
    MOMENTS = sizeof(oc_moments) / WORD,
    AXLES = sizeof(oc_gyro_reading) / WORD,
    ESTIMATES = sizeof(oc_estimate) / WORD,
    HYPOTHESES = sizeof(oc_hypothesis) / WORD,
    WATCHES = sizeof(oc_signal_watch) / WORD,
    WITNESSES = sizeof(oc_witness) / WORD,
    PAIRS = sizeof(oc_signal_pair) / WORD
};

/* Compiles only if the numbers below fit a member, and the estimates are consecutive, like an array. */
enum {
    PLACES_FIT = 1 / (sizeof(oc_state) <= UINT16_MAX),
    NUMBERS_FIT = 1 / (OC_DELAY_MAX <= UINT8_MAX && OC_LEARNED_ESTIMATES <= UINT8_MAX),
    STRUCTS_FIT = 1 / (OC_PENDING_MAX <= UINT8_MAX && OC_JOINT_HYPOTHESES <= UINT8_MAX),
    ESTIMATES_ARE_ONE_ARRAY = 1 / (offsetof(oc_learned, equivalent_wheelbase) - offsetof(oc_learned, offset) ==
                                   (OC_LEARNED_ESTIMATES - 1) * sizeof(oc_estimate))
};

static const member doubles[] = {
    {offsetof(oc_state, tracking.preprocess.angle), OC_DELAY_MAX, ANGLE, 1, 0},
    {offsetof(oc_state, tracking.straight.filling.y), 1, ESTIMATE, 1, 0},
    {offsetof(oc_state, tracking.straight.blocks[0].weight), 3, NOT_NEGATIVE, OC_PENDING_MAX, MOMENTS}, /* to xx */
    {offsetof(oc_state, tracking.straight.blocks[0].y), 2, ANGLE, OC_PENDING_MAX, MOMENTS},             /* and x */
    {offsetof(oc_state, tracking.cornering.filling.y), 1, ESTIMATE, 1, 0},
    {offsetof(oc_state, tracking.cornering.blocks[0].weight), 3, NOT_NEGATIVE, OC_PENDING_MAX, MOMENTS},
    {offsetof(oc_state, tracking.cornering.blocks[0].y), 2, ANGLE, OC_PENDING_MAX, MOMENTS},
    {offsetof(oc_state, tracking.joint.bank), 2, ESTIMATE, 1, 0}, /* and load_bank */
    {offsetof(oc_state, evidence.offset.ticks.weight), 3, NOT_NEGATIVE, 3, MOMENTS}, /* filling and batches, too */
    {offsetof(oc_state, evidence.offset.ticks.y), 2, ANGLE, 3, MOMENTS},
    {offsetof(oc_state, evidence.understeer.xx), 5, NOT_NEGATIVE, 1, 0}, /* to filling.xx */
    {offsetof(oc_state, evidence.understeer.filling.y), 2, ANGLE, 1, 0},
    {offsetof(oc_state, evidence.understeer.batches), 5, NOT_NEGATIVE, 1, 0}, /* to xx_xx */
    {offsetof(oc_state, evidence.standstill.yaw_rate.weight), 2, NOT_NEGATIVE, 1, 0},
    {offsetof(oc_state, evidence.standstill.yaw_rate.mean), 1, YAW_RATE, 1, 0},
    {offsetof(oc_state, evidence.standstill.lateral_acceleration.weight), 2, NOT_NEGATIVE, 1, 0},
    {offsetof(oc_state, evidence.standstill.lateral_acceleration.mean), 1, ACCELERATION, 1, 0},
    {offsetof(oc_state, evidence.gyro_bias.x), OC_GYRO_BIAS_STATES, YAW_RATE, 1, 0},
    {offsetof(oc_state, evidence.gyro_bias.axles[0].weight), 7, NOT_NEGATIVE, OC_AXLE_COUNT, AXLES}, /* to blocks */
    {offsetof(oc_state, evidence.gyro_bias.axles[0].difference), 4, SUM, OC_AXLE_COUNT, AXLES}, /* to acceleration */
    {offsetof(oc_state, evidence.gyro_bias.axles[0].noise), 1, SHARE, OC_AXLE_COUNT, AXLES},
    {offsetof(oc_state, evidence.gyro_bias.still.weight), 2, NOT_NEGATIVE, 1, 0},
    {offsetof(oc_state, evidence.gyro_bias.still.mean), 1, YAW_RATE, 1, 0},
    {offsetof(oc_state, evidence.gyro_bias.still_blocks), 4, NOT_NEGATIVE, 1, 0}, /* to sd */
    {offsetof(oc_state, evidence.gyro_bias.straights), 5, SUM, 1, 0},
    {offsetof(oc_state, evidence.joint.bank_mean), 1, ESTIMATE, 1, 0},
    {offsetof(oc_state, evidence.joint.crown_bank), 1, ESTIMATE, 1, 0},
    {offsetof(oc_state, evidence.joint.crown_samples), 1, NOT_NEGATIVE, 1, 0},
    {offsetof(oc_state, learned.offset.value), 1, ESTIMATE, OC_LEARNED_ESTIMATES, ESTIMATES},
    {offsetof(oc_state, learned.offset.standard_deviation), 2, NOT_NEGATIVE, OC_LEARNED_ESTIMATES, ESTIMATES},
};

static const member floats[] = {
    {offsetof(oc_state, tracking.braked_s), 1, SECOND, 1, 0},
    {offsetof(oc_state, tracking.statuses.differs_s), OC_WATCHED_STATUSES + 1, NOT_NEGATIVE, 1, 0}, /* intervenes_s */
    {offsetof(oc_state, tracking.assignment.watches[0].last), offsetof(oc_signal_watch, held_ticks) / WORD, SQUARES,
     OC_WATCHED, WATCHES},
    {offsetof(oc_state, tracking.assignment.levels), OC_WATCHED * sizeof(oc_signal_level) / WORD, SQUARES, 1, 0},
    {offsetof(oc_state, tracking.assignment.witnesses[0].means), offsetof(oc_witness, steps) / WORD, SQUARES,
     OC_WITNESSES, WITNESSES},
    {offsetof(oc_state, tracking.assignment.pairs[0].firsts), offsetof(oc_signal_pair, oldest) / WORD, SQUARES,
     OC_PAIRS, PAIRS},
    {offsetof(oc_state, tracking.assignment.sums),
     (offsetof(oc_assignment, ticks) - offsetof(oc_assignment, sums)) / WORD, SQUARES, 1, 0},
    {offsetof(oc_state, tracking.joint.prior.unloading_mean), 1, ACCELERATION, 1, 0},
    {offsetof(oc_state, tracking.joint.prior.crown), 3, ESTIMATE, 1, 0}, /* to removed */
    {offsetof(oc_state, tracking.joint.prior.removed_information), 2, NOT_NEGATIVE, 1, 0}, /* and bank_sd */
    {offsetof(oc_state, tracking.angle.yaw_rate_first), 3, YAW_RATE, 1, 0}, /* to yaw_acceleration */
    {offsetof(oc_state, tracking.angle.speed), 1, SPEED, 1, 0},
    {offsetof(oc_state, tracking.angle.bank), 1, ESTIMATE, 1, 0},
    {offsetof(oc_state, tracking.angle.noise), 2, NOT_NEGATIVE, 1, 0}, /* and swing */
    {offsetof(oc_state, tracking.angle.steered), 2, SHARE, 1, 0}, /* and share */
    {offsetof(oc_state, tracking.angle.activity), 1, ANGLE, 1, 0},
    {offsetof(oc_state, tracking.angle.step), 1, ANGLE, 1, 0},
    {offsetof(oc_state, tracking.angle.place_variance), 1, NOT_NEGATIVE, 1, 0},
    {offsetof(oc_state, evidence.gyro_bias.past.bias), 1, YAW_RATE, 1, 0},
    {offsetof(oc_state, evidence.gyro_bias.past.covariance), OC_GYRO_BIAS_STATES, PLACE, 1, 0},
    {offsetof(oc_state, evidence.joint.along), 2, SECOND, 1, 0}, /* and across */
    {offsetof(oc_state, evidence.joint.removed), 2, ESTIMATE, 1, 0},
    {offsetof(oc_state, evidence.joint.removed_samples), 2, NOT_NEGATIVE, 1, 0},
    {offsetof(oc_state, evidence.joint.checked_s), 4, SUM, 1, 0}, /* to outlying_width */
    {offsetof(oc_state, evidence.joint.second.noise), 3 * OC_NOISY, NOT_NEGATIVE, 1, 0},
    {offsetof(oc_state, evidence.joint.second.used_s), 2, NOT_NEGATIVE, 1, 0}, /* and trial_s */
    {offsetof(oc_state, evidence.joint.second.second_s), 1, SECOND, 1, 0},
    {offsetof(oc_state, evidence.joint.second.reference), 1, NOT_NEGATIVE, 1, 0},
    {offsetof(oc_state, evidence.joint.second.memory_share), 1, SHARE, 1, 0},
    {offsetof(oc_state, evidence.joint.hypotheses[0].play.half_width), 1, ANGLE, OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].play.unloading), 1, ACCELERATION, OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].play.creep), 1, ANGLE, OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].play.windup), 1, PLACE, OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].play.unwinding), 1, ANGLE, OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].play.wind), OC_WINDS, ACCELERATION,
     OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].target_mean), 1, ESTIMATE, OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].width_mean), 1, ANGLE, OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].learned_s), 2, NOT_NEGATIVE, OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].blocks.factor), 1, NOT_NEGATIVE, OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].long_blocks.factor), 1, NOT_NEGATIVE,
     OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].sums), OC_TERMS, SUM, OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].means), OC_TERMS, SUM, OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].gradient), 3, ESTIMATE, OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].age), 1, NOT_NEGATIVE, OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.joint.hypotheses[0].lean), 3, SUM, OC_JOINT_HYPOTHESES, HYPOTHESES}, /* and on */
    {offsetof(oc_state, evidence.joint.hypotheses[0].set_up_variance), 2 + OC_OF_COUNT, NOT_NEGATIVE,
     OC_JOINT_HYPOTHESES, HYPOTHESES},
    {offsetof(oc_state, evidence.torque.terms), OC_TORQUE_TERMS, TORQUE, 1, 0},
    {offsetof(oc_state, evidence.torque.place), 1, PLACE, 1, 0},
    {offsetof(oc_state, evidence.torque.angle), 1, ANGLE, 1, 0},
    {offsetof(oc_state, evidence.torque.slow), 1, ACCELERATION, 1, 0},
    {offsetof(oc_state, evidence.torque.slow_s), 1, NOT_NEGATIVE, 1, 0},
    {offsetof(oc_state, evidence.torque.filling.torque), 1, FORCES, 1, 0},
    {offsetof(oc_state, evidence.torque.filling.acceleration), 2, SUM, 1, 0}, /* and place */
    {offsetof(oc_state, learned.truck.offset_sd), 7, ESTIMATE, 1, 0}, /* to unloading_sd */
    {offsetof(oc_state, evidence.angle.error_scale), 2, NOT_NEGATIVE, 1, 0}, /* and seconds */
};

/* C99 allows memcpy only. */
static float number_at(const uint8_t *from, size_t bytes) {
    double wide;
    float narrow;
    if (bytes == sizeof wide) {
        memcpy(&wide, from, sizeof wide);
        return (float)wide;
    }
    memcpy(&narrow, from, sizeof narrow);
    return narrow;
}

/* Whether all numbers of these members are in their ranges; `bytes`: size of a number. */
static bool are_in_range(const oc_state *state, const member *members, size_t count, size_t bytes) {
    for (const member *m = members; m < members + count; ++m) {
        for (size_t k = 0; k < (size_t)m->structs * m->numbers; ++k) {
            const size_t place = m->place + k / m->numbers * m->step * WORD + k % m->numbers * bytes;
            const float number = number_at((const uint8_t *)state + place, bytes);
            if (!(number >= limits[m->range].low && number <= limits[m->range].high)) {
                return false;
            }
        }
    }
    return true;
}

typedef struct {
    float lower[OC_TERMS_TRIANGLE], inverse[OC_TERMS];
} factor;

/* Compiles only if the gyro bias's covariance fits such a triangle, too. */
enum {
    STATES_FIT = 1 / (sizeof(((oc_gyro_bias *)0)->x) / sizeof(double) <= sizeof(((factor *)0)->inverse) / sizeof(float))
};

/* Whether the triangle in f->lower is positive semidefinite up to rounding, in units of `noise`; replaces it by its
 * factor, with an information of 1. Where oc_triangle_factor raised a pivot, the squares of a row of the factor exceed
 * the diagonal. */
static bool are_sums_of_squares(factor *f, float noise) {
    float information[OC_TERMS], longest[OC_TERMS];
    for (int32_t k = 0; k < OC_TERMS_TRIANGLE; ++k) {
        f->lower[k] /= noise;
    }
    for (int32_t row = 0; row < OC_TERMS; ++row) {
        information[row] = 1.0f;
        longest[row] = 1.000004f * oc_triangle_cell(f->lower, row, row) + 2.0f;
    }
    oc_triangle_factor(f->lower, information, f->inverse);
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

/* Checks the correlations, which have one scale. Both triangles, since updates read rows of both. */
static bool is_covariance(const oc_gyro_bias *gyro_bias) {
    static const float negligible = 1e-6f; /* of a correlation, against rounding */
    static const double variance_max = 100.0; /* beyond any yaw rate's */
    factor f = {{0.0f}, {0.0f}};
    float per_sd[OC_GYRO_BIAS_STATES];
    float *cell = f.lower;
    for (int32_t row = 0; row < OC_GYRO_BIAS_STATES; ++row) {
        if (!(fabs(gyro_bias->P[row][row]) <= variance_max)) {
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
    return are_sums_of_squares(&f, negligible);
}

/* Positive divisors, a positive semidefinite scatter, and products with the target within Cauchy-Schwarz. */
static bool is_hypothesis(const oc_hypothesis *h) {
    static const float target_squares = 1e9f; /* rad^2, numerical: a day of seconds, each with an error of a turn */
    factor f;
    float products[OC_TERMS];
    memcpy(products, h->target_products, sizeof products);
    memcpy(f.lower, h->scatter, sizeof f.lower);
    const float noise = oc_hypothesis_noise(h);
    return h->variance > 1e-8f && h->play.half_width > 0.0f && (h->play.friction < 0.0f || h->play.creep > 0.01f) &&
           are_sums_of_squares(&f, noise) &&
           oc_triangle_variance(f.lower, f.inverse, 0, products) <= target_squares * noise;
}

static bool is_below(int32_t place, int32_t count) {
    return place >= 0 && place < count;
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
    /* at least one is not on probation at the next second, else the answer has no hypothesis */
    const float used_s = joint->second.used_s;
    return !(used_s > 60.0f && age <= oc_clamp(0.05f * used_s, 60.0f, 600.0f));
}

static bool is_joint(const oc_joint *joint, const oc_joint_design *design) {
    for (int32_t k = 0; k < OC_CHANGES_MAX; ++k) {
        if ((uint32_t)joint->changed[k].change.kind > OC_CHANGE_BENDS) {
            return false;
        }
    }
    return is_below(joint->count, OC_JOINT_HYPOTHESES + 1) &&
           is_below(joint->best, joint->started ? joint->count : OC_JOINT_HYPOTHESES) &&
           is_below(joint->next_start, OC_JOINT_LATER_STARTS) && is_below(joint->phase, design->ticks_per_sample) &&
           is_below(joint->in_block, OC_SECONDS_PER_BLOCK) &&
           is_below(joint->in_long_block, OC_SECONDS_PER_LONG_BLOCK) && joint->changes >= 0 &&
           (!joint->started ||
            (joint->second.second_s > 0.0f && joint->second.reference > 0.0f && are_hypotheses(joint)));
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
    return is_below(tracking->in_second + 1, OC_JOINT_SAMPLES + 1) &&
           is_below(tracking->due, 2 * joint->count + 2) &&
           is_below(tracking->next, OC_JOINT_SAMPLES + 1) &&
           is_collected(&tracking->filling) && is_collected(&tracking->collected) &&
           tracking->filling.count < design->samples_per_second &&
           (tracking->due == 0 ||
            (tracking->prior.unloading_sd > 1e-6f && tracking->prior.yaw_rate_bias_sd > 1e-7f));
}

/* At most as many blocks are pending as make one final. */
static bool is_pending(const oc_pending *pending, int32_t blocks_until_final) {
    return is_below(pending->first, OC_PENDING_MAX) && is_below(pending->count, blocks_until_final + 1) &&
           pending->ticks >= 0;
}

static bool are_pairs(const oc_assignment *assignment) {
    for (int32_t k = 0; k < OC_PAIRS; ++k) {
        if (!is_below(assignment->pairs[k].oldest, OC_LAG_COUNT)) {
            return false;
        }
    }
    return true;
}

static bool is_tracking(const oc_tracking *tracking, const oc_coefficients *c) {
    return are_pairs(&tracking->assignment) && is_below(tracking->preprocess.angle_next, OC_DELAY_MAX) &&
           is_below(tracking->preprocess.speed_next, OC_SLOPE_POINTS) &&
           is_pending(&tracking->straight, c->blocks_until_final) &&
           is_pending(&tracking->cornering, c->blocks_until_final) &&
           (uint32_t)tracking->fault.fault < OC_FAULT_COUNT;
}

static bool is_gyro_bias(const oc_gyro_bias *gyro_bias) {
    const float memory_s = gyro_bias->past.memory_s;
    return is_below(gyro_bias->due, OC_GYRO_BIAS_PIECES + 1) && is_status(gyro_bias->status) &&
           is_covariance(gyro_bias) && !(memory_s > 0.0f && memory_s < 0.1f);
}

/* A second that is due has ticks. The covariance does not exceed the prior's by much, whose unit is the slope. */
static bool is_torque(const oc_torque *torque, const oc_torque_design *design) {
    for (int32_t k = 0; k < OC_TORQUE_TERMS * (OC_TORQUE_TERMS + 1) / 2; ++k) {
        if (!(fabsf(torque->covariance[k]) <= design->slope * design->slope)) {
            return false;
        }
    }
    return is_below(torque->filling.ticks, 256) && (!torque->due || torque->filling.ticks > 0);
}

static bool is_learned(const oc_learned *learned, bool has_place) {
    return is_status(learned->offset.status) && is_status(learned->understeer_gradient.status) &&
           is_status(learned->backlash.status) && is_status(learned->unloading_acceleration.status) &&
           is_status(learned->equivalent_wheelbase.status) && (has_place || !(learned->backlash.evidence > 0.0));
}

bool oc_saved_plausible(const oc_state *state, const oc_coefficients *c) {
    const oc_evidence *evidence = &state->evidence;
    const oc_joint *joint = &evidence->joint;
    const oc_understeer *understeer = &evidence->understeer;
    return are_in_range(state, doubles, sizeof doubles / sizeof *doubles, sizeof(double)) &&
           are_in_range(state, floats, sizeof floats / sizeof *floats, sizeof(float)) &&
           understeer->xx_xx <= 1.000001 * understeer->batches_xx * understeer->batches_xx &&
           evidence->standstill.still_ticks >= 0 && is_joint(joint, &c->joint) && is_tracking(&state->tracking, c) &&
           is_joint_tracking(&state->tracking.joint, joint, &c->joint) && is_gyro_bias(&evidence->gyro_bias) &&
           is_torque(&evidence->torque, &c->torque) && (uint32_t)evidence->fault.fault < OC_FAULT_COUNT &&
           is_learned(&state->learned, joint->hypotheses[joint->best].play.half_width > 0.0f);
}

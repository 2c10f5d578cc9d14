#include "bounds.h"
#include "methods.h"

#include <math.h>

/* Tuned, in tuned.toml: joint_method */
static const float crown_share_sd = 0.35f; /* sd of standing_crown_share_1, which is between yards and roads */
static const float removed_sd = 0.06f; /* m/s^2: sd of the removed crown about removed_share of the crown */
static const float uneven = 0.2f; /* (m/s^2)^2: variance of the removed crown, times the samples */
/* log odds by superelevated bends, from which roads fall to the other side of traffic */
static const float other_side_log_odds = 5.0f;
/* samples after which the mean bank errs as much as the mean crown of the roads */
static const float bank_samples = 300.0f;
/* end */

/* Numerical. */
static const float unloading_max = 100.0f; /* m/s^2, of signals decoded from wrong bits: as signals.c */

/* Accelerometer bias and mean crown of the roads, m/s^2. */
typedef struct {
    float bias, crown;
    float bias_variance, crown_variance, covariance;
} bank_estimate;

/* Kalman update by a reading of bias + share * crown. */
static void update_bank(bank_estimate *b, float reading, float share, float variance) {
    const float of_bias = b->bias_variance + share * b->covariance;
    const float of_crown = b->covariance + share * b->crown_variance;
    const float total = of_bias + share * of_crown + variance;
    const float innovation = reading - b->bias - share * b->crown;
    b->bias += of_bias / total * innovation;
    b->crown += of_crown / total * innovation;
    b->bias_variance -= of_bias / total * of_bias;
    b->covariance -= of_bias / total * of_crown;
    b->crown_variance -= of_crown / total * of_crown;
}

/* The crown that superelevated bends remove, for a crown of this size. Bends banked by less than it may be crowned,
 * too. */
static void add_removed_crown(oc_prior *prior, const oc_joint *joint, float crown) {
    const float left = joint->removed[0], right = joint->removed[1];
    const float samples = oc_min(joint->removed_samples[0], joint->removed_samples[1]);
    if (samples > 0.0f && 0.5f * (left - right) > crown) {
        prior->removed = 0.5f * (left + right);
        prior->removed_information = 1.0f / (removed_sd * removed_sd + uneven / samples);
    }
}

float oc_traffic_side(const oc_evidence *evidence, const oc_coefficients *c) {
    const float side = (float)c->vehicle.traffic_side;
    const float crown = side * (float)c->params.crown_m_s2;
    oc_prior bends = {0};
    add_removed_crown(&bends, &evidence->joint, fabsf(crown));
    const float log_odds = -2.0f * crown * bends.removed * bends.removed_information; /* of normals about +-crown */
    return log_odds > other_side_log_odds && c->joint.bank_unmeasured <= 0.0f ? 0.0f : side;
}

/* The prior of a_0 (docs/method.md, "Regression"): the accelerometer bias by its own prior, by the roads' mean bank and
 * by standstills. Without an accelerometer the unmeasured crown. */
static oc_prior prior_of(const oc_evidence *evidence, const oc_coefficients *c) {
    const oc_params *p = &c->params;
    const oc_known_truck *known = &c->joint.hypothesis.known;
    const float yaw_rate_bias_sd = oc_past_bias_sd(&evidence->gyro_bias.past, (float)evidence->gyro_bias.sd);
    const float side = oc_traffic_side(evidence, c), crown_size = (float)p->crown_m_s2;
    const float crown = side * crown_size;
    const float unknown_side = side == 0.0f ? crown_size : 0.0f;
    const float turning = (float)evidence->joint.speed_mean * yaw_rate_bias_sd;
    const float crown_sd = (float)p->crown_sd_m_s2;
    const float road = crown_sd * crown_sd + unknown_side * unknown_side + turning * turning;
    oc_prior prior = {
        .unloading_mean = known->pull - crown, .unloading_sd = sqrtf(road), .yaw_rate_bias_sd = yaw_rate_bias_sd};
    if (c->joint.bank_unmeasured > 0.0f) {
        return prior;
    }
    const bool has_known_bias = p->known_accelerometer_bias_sd_m_s2 > 0.0;
    const float bias_sd = (float)(has_known_bias ? p->known_accelerometer_bias_sd_m_s2 : p->accelerometer_bias_sd_m_s2);
    const float bias_mean = has_known_bias ? (float)p->known_accelerometer_bias_m_s2 : 0.0f;
    bank_estimate estimate = {
        .bias = bias_mean, .crown = crown, .bias_variance = bias_sd * bias_sd, .crown_variance = road};
    if (evidence->joint.bank_samples > 0.0) {
        /* the mean bank of a short drive may be far from the mean crown */
        update_bank(&estimate, (float)evidence->joint.bank_mean, 1.0f,
                     road * bank_samples / (float)evidence->joint.bank_samples);
    }
    const oc_estimate standing =
        oc_standstill_lateral_acceleration(&evidence->standstill, c->tick_s, p->standstill_time_min_s);
    if (standing.status == OC_VALID && p->use_accelerometer) {
        const float slope_sd = (float)p->standing_slope_sd_m_s2, by_share = crown_share_sd * crown_size;
        const float zero_sd = (float)p->accelerometer_bias_sd_m_s2;
        const float stops = evidence->standstill.stops > 1 ? (float)evidence->standstill.stops : 1.0f;
        const float since = oc_joint_wanders(&evidence->joint) ? zero_sd * zero_sd : 0.0f;
        update_bank(&estimate, (float)standing.value - evidence->torque.slow, (float)p->standing_crown_share_1,
                     slope_sd * slope_sd / stops + by_share * by_share + since);
    }
    const float variance_min = 1e-6f * bias_sd * bias_sd; /* against rounding */
    prior.crown = known->set_up_probability > 0.0f ? known->set_up_sign * (crown + unknown_side) : 0.0f;
    if (side == 0.0f) { /* as above, the crown of few straights may be far from the mean */
        const float few = bank_samples / ((float)evidence->joint.crown_samples + 1.0f);
        prior.bank = (float)evidence->joint.crown_bank;
        prior.bank_sd = sqrtf(crown_sd * crown_sd * (1.0f + few) + turning * turning);
        add_removed_crown(&prior, &evidence->joint, crown_size);
    }
    prior.zero_information = oc_torque_zero_information(&evidence->torque, &c->torque);
    prior.unloading_mean = oc_clamp_size(estimate.bias + known->pull, unloading_max);
    prior.unloading_sd = sqrtf(estimate.bias_variance > variance_min ? estimate.bias_variance : variance_min);
    return prior;
}

/* Applies the present estimate of the yaw rate bias to all evidence (docs/method.md). */
static void correct_past_yaw_rates(const oc_joint_tracking *tracking, oc_evidence *evidence, const oc_coefficients *c) {
    static const float correction_share = 0.01f; /* of the variance, numerical: a correction costs a round */
    oc_past_bias *past = &evidence->gyro_bias.past;
    if (past->bias * past->bias > correction_share * past->variance &&
        oc_joint_correct(&evidence->joint, tracking, &c->joint, past->bias, c->joint.bank_unmeasured <= 0.0f)) {
        past->bias = 0.0f;
    }
}

/* 1: the axle that resists turning is down, -1: it is lifted, 0: unknown. */
static int32_t axle_of(const oc_tick *tick) {
    if ((tick->signals.valid & OC_HAS_AXLE_LIFTED) == 0) {
        return 0;
    }
    return (tick->statuses & OC_HAS_AXLE_LIFTED) != 0 ? -1 : 1;
}

static oc_joint_tick joint_tick_of(const oc_tick *tick, const oc_params *p) {
    /* without an accelerometer a and curvature share the yaw rate's noise: no noise is removed */
    const bool has_accelerometer = p->use_accelerometer != 0;
    return (oc_joint_tick){
        .angle = tick->filtered.steering_wheel_angle,
        .rear_part = tick->motion.rear_part,
        .residual = tick->motion.residual,
        .yaw_rate = tick->filtered.yaw_rate,
        .lateral_acceleration = tick->motion.lateral_acceleration,
        .raw = {[OC_NOISE_OF_ACCELERATION] = has_accelerometer ? (float)tick->signals.lateral_acceleration : 0.0f,
                [OC_NOISE_OF_YAW_RATE] = has_accelerometer ? (float)tick->signals.yaw_rate : 0.0f},
        .curvature = tick->motion.curvature,
        .speed = tick->filtered.vehicle_speed,
        .axle = axle_of(tick),
        .usable = tick->reasons == 0,
        .suspected = tick->suspected,
    };
}

/* True when a round begins. */
static bool collect(const oc_tick *tick, oc_joint_tracking *tracking, oc_evidence *evidence, const oc_coefficients *c) {
    if (tick->stands) {
        return oc_joint_standstill(&evidence->joint, tracking, &c->joint);
    }
    const oc_joint_tick collected = joint_tick_of(tick, &c->params);
    evidence->gyro_bias.past.waiting_s += collected.usable ? (float)c->tick_s : 0.0f;
    return oc_joint_collect(&evidence->joint, tracking, &c->joint, &collected);
}

void oc_estimate_jointly(const oc_tick *tick, oc_tracking *tracking, oc_evidence *evidence, const oc_coefficients *c) {
    oc_joint *joint = &evidence->joint;
    joint->lost = joint->lost || tick->after_hole;
    correct_past_yaw_rates(&tracking->joint, evidence, c);
    if ((tick->disturbed & OC_REASON_STEERING_ASSIST) != 0) { /* afterwards as after a hole */
        joint->lost = 1;
        tracking->joint.running = 0;
        return;
    }
    if (collect(tick, &tracking->joint, evidence, c)) {
        const oc_prior prior = prior_of(evidence, c);
        oc_joint_begin_round(joint, &tracking->joint, &c->joint, &prior);
    }
}

void oc_solve_jointly(oc_tracking *tracking, oc_evidence *evidence, const oc_coefficients *c) {
    const oc_prior prior = prior_of(evidence, c);
    oc_joint *joint = &evidence->joint;
    for (int32_t k = 0; k < joint->count; ++k) {
        oc_hypothesis_solve(&joint->hypotheses[k], &c->joint.hypothesis, &prior, &joint->second,
                            &tracking->joint.equations);
    }
}

#include "methods.h"

#include <math.h>

/* What is believed of the accelerometer's bias and of the mean crown of the roads, both m/s^2. */
typedef struct {
    float bias, crown;
    float bias_variance, crown_variance, covariance;
} side_force_belief;

/* A reading of bias + share * crown, to that variance. */
static void take_reading(side_force_belief *b, float reading, float share, float variance) {
    const float of_bias = b->bias_variance + share * b->covariance;
    const float of_crown = b->covariance + share * b->crown_variance;
    const float total = of_bias + share * of_crown + variance;
    const float surprise = reading - b->bias - share * b->crown;
    b->bias += of_bias / total * surprise;
    b->crown += of_crown / total * surprise;
    b->bias_variance -= of_bias / total * of_bias;
    b->covariance -= of_bias / total * of_crown;
    b->crown_variance -= of_crown / total * of_crown;
}

/* Where the accelerometer's bias is, before the steering is asked: by its own prior, the roads' crown and the ground
 * stood on; without an accelerometer the crown alone, which then is not seen. */
static oc_prior prior_of(const oc_evidence *evidence, const oc_coefficients *c, float yaw_rate_bias_sd) {
    const oc_params *p = &c->params;
    const float side = (float)c->vehicle.traffic_side, crown_size = (float)p->crown_m_s2;
    const float crown = side * crown_size;
    const float unknown_side = side == 0.0f ? crown_size : 0.0f;
    const float turning = (float)p->joint_speed_min_m_s * 2.0f * yaw_rate_bias_sd;
    const float crown_sd = (float)p->crown_sd_m_s2;
    const float road = crown_sd * crown_sd + unknown_side * unknown_side + turning * turning;
    oc_prior prior = {.unloading_mean = -crown, .unloading_sd = sqrtf(road), .yaw_rate_bias_sd = yaw_rate_bias_sd};
    if (!p->use_accelerometer) {
        return prior;
    }
    const float bias_sd = (float)p->accelerometer_bias_sd_m_s2;
    side_force_belief belief = {.crown = crown, .bias_variance = bias_sd * bias_sd, .crown_variance = road};
    if (evidence->joint.bank_samples > 0.0) {
        /* a few seconds' bank is no mean crown yet */
        take_reading(&belief, (float)evidence->joint.bank_mean, 1.0f, road * 300.0f / (float)evidence->joint.bank_samples);
    }
    const oc_estimate standing =
        oc_standstill_lateral_acceleration(&evidence->standstill, c->tick_s, p->standstill_time_min_s);
    if (standing.status == OC_VALID) {
        const float slope_sd = (float)p->standing_slope_sd_m_s2;
        take_reading(&belief, (float)standing.value, (float)p->standing_crown_share_1, slope_sd * slope_sd);
    }
    prior.unloading_mean = belief.bias;
    prior.unloading_sd = sqrtf(belief.bias_variance);
    return prior;
}

/* 0.5 deg: the least that shows two flanks. */
static const double least_play = 0.5 * 0.017453292519943295;

/* 2 deg: from there on its middle is sought. */
static const double some_play = 2.0 * 0.017453292519943295;

/* The sd by which the offset is valid or not. Pull and wind widen it, which no drive tells; all else must be told five
 * times as well, or it is no middle that was found, but a prior's: unless the steering hardly plays. */
static double wide_as(const oc_joint_answer *found) {
    static const double times = 5.0;
    const bool plays = found->backlash + 1.96 * found->backlash_sd > some_play;
    return plays && times * found->told_sd > found->offset_sd ? times * found->told_sd : found->offset_sd;
}

/* What the hypotheses say together. */
void oc_learn_jointly(const oc_evidence *evidence, oc_verdicts *verdicts, oc_learned *learned,
                      const oc_coefficients *c) {
    const oc_params *p = &c->params;
    if (!(evidence->joint.second.used_s > 0.0f)) {
        *learned = (oc_learned){0};
        return;
    }
    const oc_joint_answer found = oc_joint_answer_get(&evidence->joint);
    const bool enough = found.used >= p->joint_evidence_min_s;
    const double narrow = p->offset_half_width_max_rad;
    const double steep = p->understeer_half_width_max_rad_m_s2;
    verdicts->offset_status =
        enough ? oc_status_next(verdicts->offset_status, 1.96 * wide_as(&found), narrow, 4.0 / 3.0 * narrow)
               : OC_CONVERGING;
    verdicts->understeer_status =
        enough ? oc_status_next(verdicts->understeer_status, 1.96 * found.gradient_sd, steep, 4.0 / 3.0 * steep)
               : OC_CONVERGING;
    verdicts->backlash_status =
        enough ? oc_status_next(verdicts->backlash_status, 1.96 * found.backlash_sd, narrow, 4.0 / 3.0 * narrow)
               : OC_CONVERGING;
    learned->offset = (oc_estimate){found.offset, found.offset_sd, found.used, verdicts->offset_status};
    learned->understeer_gradient =
        (oc_estimate){found.gradient, found.gradient_sd, found.used, verdicts->understeer_status};
    learned->backlash = (oc_estimate){found.backlash, found.backlash_sd, found.used, verdicts->backlash_status};
    /* without play nothing shows where the steering unloads */
    const bool plays = found.backlash - 1.96 * found.backlash_sd > least_play;
    learned->unloading_acceleration = (oc_estimate){found.unloading, found.unloading_sd, found.used,
                                                    plays ? verdicts->backlash_status : OC_UNOBSERVABLE};
    static const double told = 0.02; /* share of the wheelbase, well below the prior's 0.05 */
    const double wheelbase = c->vehicle.wheelbase;
    learned->equivalent_wheelbase = (oc_estimate){
        .value = wheelbase * (1.0 + found.wheelbase),
        .standard_deviation = wheelbase * found.wheelbase_sd,
        .evidence = found.used,
        .status = !enough ? OC_CONVERGING : found.wheelbase_sd < told ? OC_VALID : OC_UNOBSERVABLE,
    };
}

void oc_stand_jointly(oc_state *state, const oc_coefficients *c) {
    oc_evidence *evidence = &state->evidence;
    const oc_estimate bias = oc_gyro_bias_get(&evidence->gyro_bias, &c->params);
    const oc_prior prior = prior_of(evidence, c, (float)bias.standard_deviation);
    const int32_t concluded = evidence->joint.concluded;
    oc_joint_stand(&evidence->joint, &state->tracking.joint, &c->joint, &prior, bias.value);
    if (concluded < evidence->joint.count && evidence->joint.concluded == evidence->joint.count) {
        state->tracking.joint.work.ended = 1;
    }
}

void oc_tell_standing(oc_state *state, const oc_coefficients *c) {
    oc_joint_tracking *tracking = &state->tracking.joint;
    if (tracking->stands && tracking->work.ended) {
        tracking->work.ended = 0;
        oc_learn_jointly(&state->evidence, &state->evidence.verdicts, &state->learned, c);
    }
}

/* The joint method: all hypotheses go along with every tick, and learn from whole seconds of clean ones. */
void oc_estimate_jointly(oc_state *state, const oc_coefficients *c, const oc_filtered *filtered,
                             const oc_motion *motion, const oc_estimate *yaw_rate_bias, uint32_t reasons) {
    const oc_joint_tick tick = {
        .time = state->tracking.last_time,
        .angle = filtered->steering_wheel_angle,
        .residual = motion->residual,
        .yaw_rate = filtered->yaw_rate,
        .lateral_acceleration = motion->lateral_acceleration,
        .curvature = motion->curvature,
        .speed = filtered->vehicle_speed,
        .yaw_rate_bias = yaw_rate_bias->value,
        .yaw_rate_bias_sd = yaw_rate_bias->standard_deviation,
        .offset = state->learned.offset.value,
        .offset_sd = state->learned.offset.standard_deviation,
        .usable = reasons == 0,
        .busy = oc_gyro_bias_is_busy(&state->evidence.gyro_bias),
    };
    oc_joint_tracking *tracking = &state->tracking.joint;
    if (!tracking->running || (tracking->prior_due && !tick.busy)) {
        tracking->prior_due = 0;
        tracking->prior = prior_of(&state->evidence, c, (float)yaw_rate_bias->standard_deviation);
    }
    if (oc_joint_update(&state->evidence.joint, tracking, &c->joint, &tick)) {
        oc_learn_jointly(&state->evidence, &state->evidence.verdicts, &state->learned, c);
    }
}

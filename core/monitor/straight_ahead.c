#include "bounds.h"
#include "methods.h"

#include <math.h>

/* Numerical. */
static const double separability_min = 0.25; /* against an ill-conditioned pair of offset and gradient */
static const double quantity_max = 200.0; /* rad, m/s^2: beyond any truck's; of signals decoded from wrong bits */

/* The estimate of the gyro's filter where a gyro is available. */
oc_estimate oc_wheel_mismatch_of(const oc_evidence *evidence, const oc_coefficients *c) {
    const int32_t axle = c->wheel_axle;
    if (evidence->gyro_bias.axles[axle].blocks > 0.0) {
        return oc_gyro_bias_mismatch(&evidence->gyro_bias, &c->params, axle);
    }
    return oc_wheel_speed_mismatch(&evidence->wheel_speed, &c->params, c->gyro_bias.track[axle]);
}

/* The offset's variance by the yaw rate bias, which the thesis's method does not correct: by standstill, else prior. */
static double yaw_rate_bias_variance(const oc_evidence *evidence, const oc_coefficients *c) {
    const oc_estimate bias =
        oc_standstill_yaw_rate(&evidence->standstill, c->tick_s, c->params.standstill_time_min_s);
    const double spread = bias.status == OC_VALID
                              ? sqrt(bias.value * bias.value + bias.standard_deviation * bias.standard_deviation)
                              : c->params.yaw_rate_bias_sd_rad_s;
    const double moved = evidence->offset.ticks.w * spread;
    return moved * moved;
}

/* The offset's variance by the wheels' radii, and by the road's bank without an accelerometer. */
static double wheels_variance(const oc_coefficients *c, const oc_estimate *mismatch, const oc_estimate *gradient) {
    const double radii = c->offset_per_mismatch * mismatch->standard_deviation;
    const double bank = c->vehicle.steering_ratio * c->params.bank_sd_m_s2 * gradient->standard_deviation;
    return radii * radii + bank * bank;
}

/* (38): the understeer gradient; zero with its prior's sd until there is enough evidence. Where bends and straights are
 * alike, the errors of gradient and offset grow. */
static oc_estimate understeer_of(const oc_evidence *evidence, oc_status before, const oc_coefficients *c,
                                 double separability) {
    const oc_params *p = &c->params;
    const oc_understeer *understeer = &evidence->understeer;
    const oc_offset *offset = &evidence->offset;
    const double time = understeer->weight * c->tick_s;
    /* without an accelerometer a superelevated bend cannot be distinguished from a gentle one */
    const bool uses_bank = p->method != OC_METHOD_WHEEL_SPEED;
    if (!uses_bank || !(time >= p->understeer_evidence_min_s) || !(understeer->batches > 1.0) ||
        !(separability > separability_min)) {
        return (oc_estimate){.standard_deviation = p->understeer_sd_rad_m_s2, .evidence = time};
    }
    const double K = oc_understeer_with_offset(understeer, offset->ticks.y, offset->ticks.x);
    const double per_offset = oc_understeer_per_offset(understeer);
    const double variance = oc_understeer_variance(understeer, oc_offset_value(offset, K), K) +
                            per_offset * per_offset * oc_offset_variance(offset, K);
    const double sd = sqrt(variance) / separability;
    return (oc_estimate){
        .value = K,
        .standard_deviation = sd,
        .evidence = time,
        .status = oc_status_next(before, sd, p->understeer_half_width_max_rad_m_s2),
    };
}

/* The offset's variance by the gradient and by measurement scatter, without the gyro's part. */
static double offset_variance(const oc_evidence *evidence, const oc_estimate *gradient, double separability) {
    const double K = gradient->value;
    const double x = evidence->offset.ticks.x;
    const double scatter = oc_offset_variance(&evidence->offset, K);
    if (gradient->status == OC_UNOBSERVABLE) {
        return scatter + x * x * gradient->standard_deviation * gradient->standard_deviation;
    }
    const double bends = oc_understeer_variance(&evidence->understeer, oc_offset_value(&evidence->offset, K), K);
    return (scatter + x * x * bends) / (separability * separability);
}

/* (36), (37), (38) */
void oc_learn_straight_ahead(const oc_evidence *evidence, oc_verdicts *verdicts, oc_learned *learned,
                             const oc_coefficients *c) {
    const oc_params *p = &c->params;
    const oc_offset *offset = &evidence->offset;
    const double time = offset->ticks.weight * c->tick_s;
    const double separability = oc_understeer_separability(&evidence->understeer, offset->ticks.x);
    const oc_estimate gradient = understeer_of(evidence, learned->understeer_gradient.status, c, separability);
    const bool by_wheels = p->method == OC_METHOD_WHEEL_SPEED;
    const oc_estimate mismatch = by_wheels ? oc_wheel_mismatch_of(evidence, c) : (oc_estimate){0};
    const double by_bias = by_wheels ? wheels_variance(c, &mismatch, &gradient) : yaw_rate_bias_variance(evidence, c);
    const double sd = sqrt(offset_variance(evidence, &gradient, separability) + by_bias);

    const bool enough = time >= p->offset_evidence_min_s;
    const double narrow = p->offset_half_width_max_rad;
    if (enough && 1.96 * sqrt(oc_offset_variance(offset, gradient.value)) <= narrow) {
        verdicts->offset_trusted = 1;
    }
    const oc_status status = !(offset->batches.weight > 1.0) ? OC_UNOBSERVABLE
                             : !enough                       ? OC_CONVERGING
                                                             : oc_status_next(learned->offset.status, sd, narrow);
    learned->understeer_gradient = gradient;
    learned->offset = (oc_estimate){
        .value = oc_offset_value(offset, gradient.value) + c->offset_per_mismatch * mismatch.value,
        .standard_deviation = sd,
        .evidence = time,
        .status = status,
    };
    learned->parts = (oc_offset_parts){.drive_sd = (float)sd};
}

void oc_correct_wheel_speeds(oc_tick *tick, oc_evidence *evidence, const oc_coefficients *c) {
    const double track = c->gyro_bias.track[c->wheel_axle];
    const double turns = 0.5 * tick->sensed.yaw_rate * track; /* m/s, of either wheel from their mean */
    oc_wheel_speed_update(&evidence->wheel_speed, tick->sensed.speed - turns, tick->sensed.speed + turns, c->tick_s);
    const double mismatch = oc_wheel_mismatch_of(evidence, c).value;
    tick->filtered.yaw_rate -= tick->filtered.vehicle_speed * mismatch / track;
}

/* rad; without the correction of the wheels' radii, which applies later to all evidence. */
static double residual_of(const oc_tick *tick, const oc_evidence *evidence, const oc_coefficients *c) {
    return c->params.method == OC_METHOD_WHEEL_SPEED
               ? tick->motion.residual - c->offset_per_mismatch * oc_wheel_mismatch_of(evidence, c).value
               : tick->motion.residual;
}

/* Adds a clean tick to its block. True where an earlier block is final. */
static bool add_clean(oc_pending *pending, const oc_tick *tick, const oc_evidence *evidence, const oc_coefficients *c,
                      oc_moments *final) {
    const double speed = tick->filtered.vehicle_speed;
    const double force = c->vehicle.steering_ratio * tick->motion.lateral_acceleration;
    const double y = oc_clamp_size_double(residual_of(tick, evidence, c), quantity_max);
    const double x = oc_clamp_size_double(force, quantity_max);
    const double w = c->ratio_times_wheelbase / (speed > 1.0 ? speed : 1.0);
    return oc_pending_add(pending, c->ticks_per_block, c->blocks_until_final, y, x, w, final);
}

/* (34), (35): a block of clean ticks is final after t1, and then updates the estimates. */
bool oc_estimate_straight_ahead(const oc_tick *tick, oc_tracking *tracking, oc_evidence *evidence,
                                const oc_coefficients *c) {
    const oc_params *p = &c->params;
    const uint32_t reasons = tick->reasons;
    oc_moments block;
    bool is_final = false;

    if (reasons != 0) {
        oc_pending_drop(&tracking->straight);
    } else if (add_clean(&tracking->straight, tick, evidence, c, &block)) {
        oc_offset_update(&evidence->offset, &block, c->ticks_per_batch);
        is_final = true;
    }

    const double a_y = fabs(tick->motion.lateral_acceleration);
    const bool is_bend = a_y > p->understeer_acceleration_min_m_s2 && a_y < p->understeer_acceleration_max_m_s2;
    if ((reasons & ~(uint32_t)OC_REASON_CURVATURE) != 0 || !is_bend || !evidence->verdicts.offset_trusted) {
        oc_pending_drop(&tracking->cornering);
    } else if (add_clean(&tracking->cornering, tick, evidence, c, &block)) {
        oc_understeer_update(&evidence->understeer, &block, c->ticks_per_batch);
        is_final = true;
    }
    return is_final;
}

/* The offset including the pending blocks. */
double oc_temporary_offset(const oc_state *state, double understeer_gradient) {
    oc_offset all = state->evidence.offset;
    const oc_pending *pending = &state->tracking.straight;
    const oc_moments filling = oc_moments_of(&pending->filling);
    for (int32_t k = 0; k < pending->count; ++k) {
        oc_moments_merge(&all.ticks, &pending->blocks[(pending->first + k) % OC_PENDING_MAX]);
    }
    oc_moments_merge(&all.ticks, &filling);
    return oc_offset_value(&all, understeer_gradient);
}

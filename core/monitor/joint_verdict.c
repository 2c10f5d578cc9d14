#include <math.h>

#include "bounds.h"
#include "joint_model.h"
#include "methods.h"

/* Tuned, in tuned.toml: joint_verdict */
/* rad/s: sd of the offset after a tyre lost air, as an error of the yaw rates until it was noticed */
static const float leak_bias = 0.035f * 0.017453292f;
static const float recent_share = 0.0125f; /* 1/s: weight of a second in the recent offset: 80 s */
static const float of_movement = 1.25f; /* sd of a moving offset over its recent movement */
static const float gradient_max = 1.2f * 0.017453292f; /* rad/(m/s^2): maximum understeer gradient of any truck */
static const float wheelbase_off_max = 0.3f; /* maximum error of the wheelbase of an answer that is valid, as a share */
static const float steered_sd_share = 0.33f; /* sd by an unknown flank over the error of the seconds that show it */
/* sd by an axle set up for the crown, over its effect, from which it is likely where the side is unknown */
static const float set_up_likely = 0.47f;
/* end */

/* Whether an axle is likely set up for the crown, to a side that is unknown: the offset is then one of three. */
static bool may_be_set_up(const oc_joint_answer *found, const oc_evidence *evidence, const oc_coefficients *c) {
    const float effect = found->parts.per_acceleration * (float)c->params.crown_m_s2;
    return oc_traffic_side(evidence, c) == 0.0f && found->parts.set_up_sd > set_up_likely * effect && effect > 0.0f;
}

/* rad, sd that decides the offset's status: the drive's part, or more where the offset is still moving. */
static float offset_status_sd(const oc_joint_answer *found, float moved) {
    return oc_max(of_movement * fabsf(moved), found->parts.drive_sd);
}

static oc_status status_of(oc_status before, bool enough, float sd, double narrow) {
    return enough ? oc_status_next(before, (double)sd, narrow) : OC_CONVERGING;
}

static float root_sum_square(float sd, float other_sd) {
    return sqrtf(sd * sd + other_sd * other_sd);
}

static oc_estimate estimate_from(oc_found found, float used, oc_status status) {
    return (oc_estimate){(double)found.value, (double)found.sd, (double)used, status, 0.0f};
}

void oc_learn_jointly(const oc_evidence *evidence, oc_verdicts *verdicts, oc_learned *learned,
                      const oc_coefficients *c) {
    const oc_params *p = &c->params;
    if (!(evidence->joint.second.used_s > 0.0f)) {
        *learned = (oc_learned){0};
        return;
    }
    oc_joint_answer found;
    oc_joint_answer_get(&found, &evidence->joint, &c->joint);
    if (!p->use_accelerometer && c->joint.bank_unmeasured <= 0.0f) {
        const float bank_sd = oc_torque_bank_sd(&evidence->torque, &c->torque, (float)p->bank_sd_m_s2);
        const float by_bank = found.parts.per_acceleration * bank_sd;
        found.parts.drive_sd = root_sum_square(found.parts.drive_sd, by_bank);
        found.of[OC_OF_OFFSET].sd = root_sum_square(found.of[OC_OF_OFFSET].sd, by_bank);
    }
    if (evidence->gyro_bias.leaking != 0) {
        const double per_bias = c->ratio_times_wheelbase / evidence->joint.speed_mean;
        const float by_leak = (float)per_bias * leak_bias;
        found.parts.drive_sd = root_sum_square(found.parts.drive_sd, by_leak);
        found.of[OC_OF_OFFSET].sd = root_sum_square(found.of[OC_OF_OFFSET].sd, by_leak);
    }
    const float by_flank = steered_sd_share * oc_joint_steered_by(&evidence->joint);
    found.parts.drive_sd = root_sum_square(found.parts.drive_sd, by_flank);
    found.of[OC_OF_OFFSET].sd = root_sum_square(found.of[OC_OF_OFFSET].sd, by_flank);
    found.of[OC_OF_WIDTH].sd = root_sum_square(found.of[OC_OF_WIDTH].sd, by_flank);
    const float by_rear_zero = (float)(c->ratio_times_rear_weight * p->known_rear_axle_zero_sd_rad);
    found.parts.drive_sd = root_sum_square(found.parts.drive_sd, by_rear_zero);
    found.of[OC_OF_OFFSET].sd = root_sum_square(found.of[OC_OF_OFFSET].sd, by_rear_zero);
    /* unmodelled play looks like oversteer: 3 of 4 such valid answers were wrong (docs/method.md) */
    const float K = found.of[OC_OF_GRADIENT].value;
    const bool understeers = K > 0.0f && K < gradient_max;
    /* an angle, a yaw rate or a vehicle file of another size */
    const float off_max = oc_max(wheelbase_off_max, c->joint.hypothesis.known.product_doubt);
    const bool fits = fabsf(found.of[OC_OF_WHEELBASE].value) < off_max;
    const bool enough = understeers && fits && found.used >= (float)p->joint_evidence_min_s &&
                        !oc_bank_watch_drifts(&evidence->bank_watch) && !oc_joint_is_implausible(&evidence->joint) &&
                        !may_be_set_up(&found, evidence, c);
    const float moved = enough ? found.of[OC_OF_OFFSET].value - verdicts->recent_offset : 0.0f;
    verdicts->recent_offset = found.of[OC_OF_OFFSET].value - (1.0f - recent_share) * moved;
    const double narrow = p->offset_half_width_max_rad, steep = p->understeer_half_width_max_rad_m_s2;
    const oc_status offset = status_of(learned->offset.status, enough, offset_status_sd(&found, moved),
                                       p->offset_drive_half_width_max_rad);
    const oc_status gradient =
        status_of(learned->understeer_gradient.status, enough, found.of[OC_OF_GRADIENT].sd, steep);
    const oc_status play = status_of(learned->backlash.status, enough, found.of[OC_OF_WIDTH].sd, narrow);
    learned->offset = estimate_from(found.of[OC_OF_OFFSET], found.used, offset);
    learned->offset.lean = found.lean;
    learned->parts = found.parts;
    learned->understeer_gradient = estimate_from(found.of[OC_OF_GRADIENT], found.used, gradient);
    learned->backlash = estimate_from(found.of[OC_OF_WIDTH], found.used, play);
    /* a_0 is observable only through play */
    const bool plays = found.of[OC_OF_WIDTH].value - 1.96f * found.of[OC_OF_WIDTH].sd > 0.0f;
    learned->unloading_acceleration =
        estimate_from(found.of[OC_OF_UNLOADING], found.used, plays ? play : OC_UNOBSERVABLE);
    const float wheelbase = (float)c->vehicle.wheelbase;
    const oc_found longer = found.of[OC_OF_WHEELBASE];
    const bool is_known = longer.sd < 0.5f * oc_joint_priors()[WHEELBASE].sd;
    const oc_found metres = {wheelbase + wheelbase * longer.value, wheelbase * longer.sd};
    learned->equivalent_wheelbase = estimate_from(
        metres, found.used, !enough ? OC_CONVERGING : is_known ? OC_VALID : OC_UNOBSERVABLE);
}

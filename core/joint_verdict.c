#include "methods.h"

/* 0.5 deg: the least that shows two flanks. */
static const double least_play = 0.5 * 0.017453292519943295;

/* 2 deg: from there on its middle is sought. */
static const double some_play = 2.0 * 0.017453292519943295;

/* The sd by which the offset is valid or not. Pull and wind widen it, which no drive tells; all else must be told five
 * times as well, or it is no middle that was found, but a prior's: unless the steering hardly plays. */
static double wide_as(const oc_joint_answer *found) {
    static const double times = 5.0;
    const bool plays = found->backlash > some_play;
    return plays && times * found->told_sd > found->offset_sd ? times * found->told_sd : found->offset_sd;
}

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

#include <math.h>

#include "methods.h"

/* 0.5 deg: the least that shows two flanks. */
static const double least_play = 0.5 * 0.017453292519943295;

/* 2 deg: from there on its middle is sought. */
static const double some_play = 2.0 * 0.017453292519943295;

static const float lately_share = 1.0f / 80.0f; /* of a second, in the mean of what the offset was lately */

/* The sd by which the offset is valid or not. Pull and wind widen it, which no drive tells; all else must be told five
 * times as well, or it is no middle that was found, but a prior's: unless the steering hardly plays. Half of what it
 * moved by lately (rad) was not told either, however much play there seems to be now. */
static double wide_as(const oc_joint_answer *found, float moved) {
    static const float times = 5.0f;
    const float told = found->backlash > some_play ? (float)found->told_sd : 0.0f, untold = 0.5f * fabsf(moved);
    const float wide = times * (told > untold ? told : untold);
    return wide > (float)found->offset_sd ? (double)wide : found->offset_sd;
}

static oc_status status_of(oc_status before, bool enough, double sd, double narrow) {
    return enough ? oc_status_next(before, 1.96 * sd, narrow, 4.0 / 3.0 * narrow) : OC_CONVERGING;
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
    const float moved = enough ? (float)found.offset - verdicts->lately : 0.0f;
    verdicts->lately = (float)found.offset - (1.0f - lately_share) * moved;
    const double narrow = p->offset_half_width_max_rad, steep = p->understeer_half_width_max_rad_m_s2;
    verdicts->offset_status = status_of(verdicts->offset_status, enough, wide_as(&found, moved), narrow);
    verdicts->understeer_status = status_of(verdicts->understeer_status, enough, found.gradient_sd, steep);
    verdicts->backlash_status = status_of(verdicts->backlash_status, enough, found.backlash_sd, narrow);
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

#include <math.h>

#include "bounds.h"
#include "joint_model.h"
#include "methods.h"

/* 0.5 deg: the least that shows two flanks. */
static const float least_play = 0.5f * 0.017453292f;

static const float lately_share = 1.0f / 80.0f; /* of a second, in the mean of what the offset was lately */

/* The sd by which the offset is valid or not. Pull and wind widen it, which no drive tells; all else must be told five
 * times as well, or it is no middle that was found, but a prior's: unless the steering hardly plays. Half of what it
 * moved by lately (rad) was not told either, however much play there seems to be now. */
static float wide_as(const oc_joint_answer *found, float moved) {
    static const float times = 5.0f;
    const bool plays = found->of[OC_OF_WIDTH].value > oc_joint_model_get()->little_play;
    const float told = plays ? found->identified_sd : 0.0f, untold = 0.5f * fabsf(moved);
    return oc_max(times * oc_max(told, untold), found->of[OC_OF_OFFSET].sd);
}

static oc_status status_of(oc_status before, bool enough, float sd, double narrow) {
    return enough ? oc_status_next(before, (double)sd, narrow) : OC_CONVERGING;
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
    /* a truck that oversteers is rarer than play that was taken for a gradient */
    const bool understeers = found.of[OC_OF_GRADIENT].value > 0.0f;
    const bool enough = understeers && found.used >= (float)p->joint_evidence_min_s;
    const float moved = enough ? found.of[OC_OF_OFFSET].value - verdicts->lately : 0.0f;
    verdicts->lately = found.of[OC_OF_OFFSET].value - (1.0f - lately_share) * moved;
    const double narrow = p->offset_half_width_max_rad, steep = p->understeer_half_width_max_rad_m_s2;
    const oc_status offset = status_of(learned->offset.status, enough, wide_as(&found, moved), narrow);
    const oc_status gradient =
        status_of(learned->understeer_gradient.status, enough, found.of[OC_OF_GRADIENT].sd, steep);
    const oc_status play = status_of(learned->backlash.status, enough, found.of[OC_OF_WIDTH].sd, narrow);
    learned->offset = estimate_from(found.of[OC_OF_OFFSET], found.used, offset);
    learned->offset.lean = found.lean;
    learned->understeer_gradient = estimate_from(found.of[OC_OF_GRADIENT], found.used, gradient);
    learned->backlash = estimate_from(found.of[OC_OF_WIDTH], found.used, play);
    /* without play nothing shows where the steering unloads */
    const bool plays = found.of[OC_OF_WIDTH].value - 1.96f * found.of[OC_OF_WIDTH].sd > least_play;
    learned->unloading_acceleration =
        estimate_from(found.of[OC_OF_UNLOADING], found.used, plays ? play : OC_UNOBSERVABLE);
    static const float told = 0.02f; /* share of the wheelbase, well below the prior's 0.05 */
    const float wheelbase = (float)c->vehicle.wheelbase;
    const oc_found longer = found.of[OC_OF_WHEELBASE];
    const oc_found metres = {wheelbase + wheelbase * longer.value, wheelbase * longer.sd};
    learned->equivalent_wheelbase = estimate_from(
        metres, found.used, !enough ? OC_CONVERGING : longer.sd < told ? OC_VALID : OC_UNOBSERVABLE);
}

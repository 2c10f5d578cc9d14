#include "joint.h"

#include <math.h>

#include "bounds.h"
#include "joint_model.h"

/* A flank of the play counts as seen after so long. */
static const float flank_s = 2.0f;
static const float little_play = 0.1f;                 /* of its time on a flank counts for whoever finds hardly any */
static const float always_doubtful = 0.3f;             /* of that variance where only one flank was seen */
static const float late_comer = 16.0f;                /* of cost: who did not see a flank that the others have seen */
static const float width_error = 0.15f * 0.017453292f; /* sd, rad: of what the yaw rate's lag adds to the play */
static const float unloading_error = 0.006f;           /* sd, m/s^2: likewise, of what gives way in the steering */
static const float borne_doubt = 0.7f; /* sd, of the gradient where nobody tells what of bends the tyres bear */

double oc_joint_place(const oc_joint *joint, const oc_joint_tracking *tracking) {
    const float half_width = joint->hypotheses[joint->best].play.half_width;
    return (double)oc_clamp((tracking->wound - tracking->inner) / half_width, -1.0f, 1.0f);
}

double oc_joint_flank_lacking(const oc_joint *joint, const oc_joint_design *design, int32_t side) {
    static const float hardly_s = 1.0f;
    const float seen = side > 0 ? joint->to_left : joint->to_right;
    const bool wide = 2.0f * joint->hypotheses[joint->best].play.half_width > oc_joint_model_get()->little_play;
    const bool found = wide && design->unseen <= 0.0f && seen > hardly_s;
    const float needed = wide ? flank_s : flank_s / little_play;
    return found ? 0.0 : (double)oc_max(needed - seen, 0.0f);
}

/* What lacks to 1. */
static float lacking(float share) {
    return oc_max(1.0f - share, 0.0f);
}

/* 1/s, of the time after which a flank counts as seen: longer where seconds tell no new things each. */
static float per_flank(const oc_hypothesis *h) {
    return sqrtf(h->variance / oc_hypothesis_noise(h)) / flank_s;
}

/* The variance of a width that nobody saw. On one flank only, all play is taken for offset. A width that was found
 * was found by leaving that flank, though wheels that seldom do may have been anywhere in the play; that there is
 * hardly any is believed only where the side force was on both sides for longer, since some seconds at the entries of
 * roundabouts pass for outliers; else the midpoint stays as uncertain as half the play is beforehand. `seen`: for how
 * long the flank that was seen for less, 1 where that just suffices. */
static float unseen_width_variance(const oc_hypothesis *h, float unseen, float seen) {
    const float little = lacking(2.0f * h->play.half_width / oc_joint_model_get()->little_play);
    const float lacks = lacking(seen);
    const float doubtful = lacks * oc_max(unseen, always_doubtful * lacks * lacks);
    const float width_sd = oc_joint_model_get()->terms[WIDTH].sd;
    return oc_max(doubtful, little * lacking(little_play * seen)) * width_sd * width_sd;
}

/* Of values that each have a variance: mean, and variance within and between; from where the best one has it, lest
 * single precision loses how little they differ. */
typedef struct {
    float sum, squares, variances;
} mixture;

static void mix(mixture *mixture, float weight, float apart, float variance) {
    const float weighted = weight * apart;
    mixture->sum += weighted;
    mixture->squares += weighted * apart;
    mixture->variances += weight * variance;
}

/* `all`: the sum of the weights. */
static float variance_of(const mixture *mixture, float all) {
    const float mean = mixture->sum / all;
    const float between = mixture->squares / all - mean * mean;
    return mixture->variances / all + oc_max(between, 0.0f);
}

static void values_of(const oc_hypothesis *h, float *values) {
    values[OC_OF_OFFSET] = h->offset;
    values[OC_OF_GRADIENT] = h->gradient;
    values[OC_OF_WIDTH] = 2.0f * (h->play.half_width + h->play.windup);
    values[OC_OF_UNLOADING] = h->unloading;
    values[OC_OF_WHEELBASE] = h->wheelbase;
}

void oc_joint_answer_get(oc_joint_answer *answer, const oc_joint *joint, const oc_joint_design *design) {
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    mixture of[OC_ASKED] = {0};
    float about[OC_ASKED], values[OC_ASKED];
    values_of(best, about);
    const float seen = oc_min(joint->to_left, joint->to_right);
    const float usual_gradient = oc_joint_model_get()->terms[GRADIENT].mean;
    float all = 0.0f, pulled = 0.0f, leaning = 0.0f;
    for (int32_t k = 0; k < joint->count; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (oc_hypothesis_is_on_probation(h, &joint->second)) {
            continue;
        }
        const float per = per_flank(h);
        const float seen_by = per * oc_min(joint->to_left - h->left_before, joint->to_right - h->right_before);
        const float worse = oc_max(h->cost - best->cost, 0.0f);
        const float weight = oc_likelihood(worse + late_comer * (lacking(seen_by) - lacking(per * seen)));
        const float unseen = weight * unseen_width_variance(h, design->unseen, seen_by);
        const float borne = borne_doubt * design->unseen * oc_max(h->gradient, usual_gradient);
        values_of(h, values);
        for (int32_t of_what = 0; of_what < OC_ASKED; ++of_what) {
            mix(&of[of_what], weight, values[of_what] - about[of_what], h->variances.of[of_what]);
        }
        of[OC_OF_OFFSET].variances += 0.25f * unseen;
        of[OC_OF_WIDTH].variances += unseen;
        of[OC_OF_GRADIENT].variances += weight * borne * borne;
        all += weight;
        pulled += weight * h->pulled_variance;
        leaning += weight * h->lean;
    }
    const float lean = (1.0f - design->unseen) * leaning / all; /* most of an unseen bank is no pull */
    const float leaned = all * (lean * lean);
    of[OC_OF_OFFSET].variances += leaned;
    of[OC_OF_WIDTH].variances += all * (width_error * width_error);
    of[OC_OF_UNLOADING].variances += all * (unloading_error * unloading_error);
    for (int32_t k = 0; k < OC_ASKED; ++k) {
        answer->of[k] = (oc_found){about[k] + of[k].sum / all, sqrtf(variance_of(&of[k], all))};
    }
    const float offset_sd = answer->of[OC_OF_OFFSET].sd;
    answer->identified_sd = sqrtf(oc_max(offset_sd * offset_sd - (pulled + leaned) / all, 0.0f));
    answer->lean = lean;
    answer->used = joint->second.used_s;
}

void oc_joint_note_change(oc_joint *joint, const oc_change *change, const oc_estimate *before, double time) {
    joint->changed[joint->changes % OC_CHANGES_MAX] = (oc_changed){
        .time = time,
        .before = before->value,
        .before_sd = before->standard_deviation,
        .change = *change,
    };
    ++joint->changes;
    const float worth_s = joint->second.reference / (change->size_sd * change->size_sd); /* of seconds that told it */
    for (int32_t k = 0; k < joint->count; ++k) {
        oc_hypothesis *h = &joint->hypotheses[k];
        if (change->kind == OC_CHANGE_OFFSET) {
            oc_hypothesis_remounted(h, change->size, worth_s);
        } else {
            oc_hypothesis_loaded(h);
        }
    }
    joint->solves_all = 1; /* no surer of the offset than of the change, though no second may end for long */
}

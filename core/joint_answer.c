#include "joint.h"

#include <math.h>

#include "bounds.h"
#include "joint_model.h"

/* Tuned. */
/* Rows are those of bench/accuracy.py --tuning; drives are in CHANGELOG.md. */
static const float flank_s = 2.0f;         /* s of load until a flank counts as loaded: `cross_wind`, `motorway` */
static const float no_play_share = 0.1f;   /* of that time counts without play: 131 drives of another simulator */
static const float width_doubt_min = 0.3f; /* of the width's prior variance, with one flank loaded: `population` */
static const float missing_flank_cost = 16.0f; /* of a flank not loaded since the hypothesis began: 3,550 drives */
static const float width_error = 0.2f * 0.017453292f; /* rad, sd by the yaw rate's lag: `ordinary`, and by snow:
                                                       * bench/effects.py, row `slippery_patches` */
static const float rolling_share = 0.07f;  /* sd of K by K: a body that rolls lets the accelerometer feel more, bench/
                                            * effects.py, row `trailer` */
static const float doubt_min = 2.5f, flank_sure_s = 60.0f; /* bench/effects.py, rows `play_15`, `load_change` */
static const float offset_error = 0.04f * 0.017453292f; /* rad, sd by what the model lacks: bench/two_parts.py, row
                                                         * `ordinary` */
static const float unloading_error = 0.006f; /* m/s^2, sd by compliance of the steering: `ordinary` */
static const float gradient_doubt = 0.7f;  /* sd of K by K, without an accelerometer: `no_accelerometer_motorway` */

double oc_joint_place(const oc_joint *joint, const oc_joint_tracking *tracking) {
    const float half_width = joint->hypotheses[joint->best].play.half_width;
    return (double)oc_clamp((tracking->wound - tracking->inner) / half_width, -1.0f, 1.0f);
}

double oc_joint_flank_lacking(const oc_joint *joint, const oc_joint_design *design, int32_t side) {
    static const float moment_s = 1.0f; /* tuned: no bench on record */
    const float loaded = side > 0 ? joint->to_left : joint->to_right;
    const bool wide = 2.0f * joint->hypotheses[joint->best].play.half_width > oc_joint_model_get()->little_play;
    const bool found = wide && design->unseen <= 0.0f && loaded > moment_s;
    const float needed = wide ? flank_s : flank_s / no_play_share;
    return found ? 0.0 : (double)oc_max(needed - loaded, 0.0f);
}

bool oc_joint_is_doubtful(const oc_joint *joint) {
    return joint->hypotheses[joint->best].doubt > doubt_min && oc_min(joint->to_left, joint->to_right) < flank_sure_s;
}

static float missing(float share) {
    return oc_max(1.0f - share, 0.0f);
}

/* 1/s: correlated seconds need longer until a flank counts as loaded. */
static float flank_rate(const oc_hypothesis *h) {
    return sqrtf(h->variance / oc_hypothesis_noise(h)) / flank_s;
}

/* Variance of the width by a flank that was not loaded long enough (docs/method.md, "The other flank"): with one flank,
 * free play and offset cannot be separated. A hypothesis without play needs longer, since seconds at the entries of
 * roundabouts look like outliers. `loaded`: time on the flank loaded for less, 1 where it suffices. */
static float unloaded_width_variance(const oc_hypothesis *h, float width_sd, float hidden, float loaded) {
    const float little = missing(2.0f * h->play.half_width / oc_joint_model_get()->little_play);
    const float lacks = missing(loaded);
    const float doubtful = lacks * oc_max(hidden, width_doubt_min * lacks * lacks);
    return oc_max(doubtful, little * missing(no_play_share * loaded)) * width_sd * width_sd;
}

/* Mean of values that each have a variance, and variance within and between. Relative to the best hypothesis's value,
 * since in single precision small differences would vanish. */
typedef struct {
    float sum, squares, variances;
} mixture;

static void mix(mixture *mixture, float weight, float apart, float variance) {
    const float weighted = weight * apart;
    mixture->sum += weighted;
    mixture->squares += weighted * apart;
    mixture->variances += weight * variance;
}

/* `all`: sum of the weights. */
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
    mixture of[OC_OF_COUNT] = {0};
    float about[OC_OF_COUNT], values[OC_OF_COUNT];
    values_of(best, about);
    const float loaded = oc_min(joint->to_left, joint->to_right);
    const float width_sd = design->hypothesis.known.width_sd;
    const float prior_gradient = oc_joint_model_get()->terms[GRADIENT].mean;
    *answer = (oc_joint_answer){0};
    float all = 0.0f, pulled = 0.0f, set_up = 0.0f, leaning = 0.0f, set_up_leaning = 0.0f, per_acceleration = 0.0f;
    for (int32_t k = 0; k < joint->count; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (oc_hypothesis_is_on_probation(h, &joint->second)) {
            continue;
        }
        const float per = flank_rate(h);
        const float own_load = per * oc_min(joint->to_left - h->left_before, joint->to_right - h->right_before);
        const float worse = oc_max(h->cost + h->doubt - best->cost - best->doubt, 0.0f);
        const float weight = oc_likelihood(worse + missing_flank_cost * (missing(own_load) - missing(per * loaded)));
        const float hidden = weight * unloaded_width_variance(h, width_sd, design->unseen, own_load);
        const float borne = gradient_doubt * design->unseen * oc_max(h->gradient, prior_gradient);
        values_of(h, values);
        for (int32_t of_what = 0; of_what < OC_OF_COUNT; ++of_what) {
            mix(&of[of_what], weight, values[of_what] - about[of_what], h->variances.of[of_what]);
        }
        for (int32_t of_what = 0; of_what < OC_OF_OFFSET; ++of_what) {
            const float apart = (values[OC_OF_OFFSET] - about[OC_OF_OFFSET]) * (values[of_what] - about[of_what]);
            answer->with_offset[of_what] += weight * (apart + h->with_offset[of_what]);
        }
        of[OC_OF_OFFSET].variances += 0.25f * hidden;
        of[OC_OF_WIDTH].variances += hidden;
        answer->with_offset[OC_OF_WIDTH] -= joint->to_left > joint->to_right ? 0.5f * hidden : -0.5f * hidden;
        const float rolling = rolling_share * h->gradient;
        of[OC_OF_GRADIENT].variances += weight * (borne * borne + rolling * rolling);
        all += weight;
        pulled += weight * h->pulled_variance;
        set_up += weight * h->set_up_variance;
        leaning += weight * h->lean;
        set_up_leaning += weight * h->set_up_lean;
        per_acceleration += weight * h->per_acceleration;
    }
    const float lean = (1.0f - design->unseen) * leaning / all; /* most of an unmeasured bank is no pull */
    of[OC_OF_OFFSET].variances += all * (offset_error * offset_error);
    of[OC_OF_WIDTH].variances += all * (width_error * width_error);
    of[OC_OF_UNLOADING].variances += all * (unloading_error * unloading_error);
    for (int32_t k = 0; k < OC_OF_COUNT; ++k) {
        answer->of[k] = (oc_found){about[k] + of[k].sum / all, sqrtf(variance_of(&of[k], all))};
    }
    for (int32_t k = 0; k < OC_OF_OFFSET; ++k) {
        answer->with_offset[k] = answer->with_offset[k] / all - of[OC_OF_OFFSET].sum / all * (of[k].sum / all);
    }
    const float pull_lean = lean - (1.0f - design->unseen) * set_up_leaning / all;
    const float pull_variance = pulled / all + pull_lean * pull_lean;
    const float both = (pulled + set_up) / all + lean * lean;
    const float bank_share = 1.0f - design->alignment_share - design->wind_share; /* at least a rounding error */
    const float drive_sd = answer->of[OC_OF_OFFSET].sd;
    answer->parts = (oc_offset_parts){
        .drive_sd = sqrtf(drive_sd * drive_sd + pull_variance * bank_share),
        .pull_sd = sqrtf(pull_variance * design->alignment_share),
        .wind_sd = sqrtf(pull_variance * design->wind_share),
        .set_up_sd = sqrtf(oc_max(both - pull_variance, 0.0f)),
        .per_acceleration = per_acceleration / all,
    };
    answer->of[OC_OF_OFFSET].sd = sqrtf(drive_sd * drive_sd + both);
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
    const float worth_s = joint->second.reference / (change->size_sd * change->size_sd); /* seconds of equal variance */
    for (int32_t k = 0; k < joint->count; ++k) {
        oc_hypothesis *h = &joint->hypotheses[k];
        if (change->kind == OC_CHANGE_OFFSET) {
            oc_hypothesis_remounted(h, change->size, worth_s);
        } else {
            oc_hypothesis_loaded(h);
        }
    }
    joint->solves_all = 1; /* the offset's interval has the change's at once, even if no second ends for long */
}

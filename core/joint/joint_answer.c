#include "joint.h"

#include <math.h>

#include "bounds.h"
#include "joint_model.h"

/* Tuned, in tuned.toml: joint_answer */
static const float flank_s = 2.0f; /* s: load until a flank counts as loaded */
static const float no_play_share = 0.1f; /* of this time that counts for a hypothesis without play */
static const float width_error = 0.2f * 0.017453292f; /* rad: sd of the play by the yaw rate's lag; also by snow */
static const float rolling_share = 0.07f; /* sd of K over K: body roll adds to the accelerometer's reading */
static const float implausible_cost = 2.5f; /* cost of a_0's distance above which a flank must be sure */
static const float flank_sure_s = 60.0f; /* s: load on a flank that is sure */
static const float offset_error = 0.04f * 0.017453292f; /* rad: sd of the offset by model mismatch */
static const float per_yaw_rate_noise = 2.4f; /* s: the same in addition, by noise of a second's mean yaw rate */
/* rad/(m/s^2): the same, of the lateral acceleration */
static const float per_acceleration_noise = 1.5f * 0.017453292f;
static const float unloading_error = 0.006f; /* m/s^2: sd of a_0 by compliance of the steering */
static const float gradient_share_sd = 0.7f; /* sd of K over K without an accelerometer */
static const float walk_step = 0.5f * 0.017453292f; /* rad: sd of the offset by the next step of one that walks */
/* share of seconds far from the prediction on one side if something steers */
static const float steered_share = 0.006f;
static const float steered_checked_s = 400.0f; /* s: minimum of checked evidence for this share */
/* end */

double oc_joint_place(const oc_joint *joint, const oc_joint_tracking *tracking) {
    const float half_width = joint->hypotheses[joint->best].play.half_width;
    return (double)oc_clamp((tracking->wound - tracking->inner) / half_width, -1.0f, 1.0f);
}

double oc_joint_flank_lacking(const oc_joint *joint, const oc_joint_design *design, int32_t side) {
    const float loaded = side > 0 ? joint->loaded_left_s : joint->loaded_right_s;
    const bool wide = 2.0f * joint->hypotheses[joint->best].play.half_width > oc_joint_little_play();
    const bool found = wide && design->bank_unmeasured <= 0.0f && loaded > 0.5f * flank_s;
    const float needed = wide ? flank_s : flank_s / no_play_share;
    return found ? 0.0 : (double)oc_max(needed - loaded, 0.0f);
}

float oc_joint_sure_flank_s(void) {
    return flank_sure_s;
}

bool oc_joint_is_implausible(const oc_joint *joint) {
    return joint->hypotheses[joint->best].prior_cost > implausible_cost &&
           oc_min(joint->loaded_left_s, joint->loaded_right_s) < flank_sure_s;
}

float oc_joint_steered_by(const oc_joint *joint) {
    const bool steered = fabsf(joint->outlying_s) > steered_share * oc_max(joint->checked_s, steered_checked_s);
    return steered ? fabsf(joint->outlying_sum / joint->outlying_s) : 0.0f;
}

/* The share that a flank lacks of its required time, 0 to 1. */
static float lack(float share) {
    return oc_clamp(1.0f - share, 0.0f, 1.0f);
}

/* 1/s, one over the time until a flank counts as loaded: longer where seconds are correlated. */
static float flank_rate(const oc_hypothesis *h) {
    return sqrtf(h->variance / oc_hypothesis_noise(h)) / flank_s;
}

/* Variance of the width where one flank was not loaded long enough (docs/method.md, "The other flank"): with one flank,
 * free play and offset cannot be separated. A hypothesis without play needs longer, since the few seconds at the
 * entries of roundabouts look like outliers. `loaded`: time on the flank loaded for the shorter time, 1 if
 * sufficient. */
static float unloaded_width_variance(const oc_hypothesis *h, float width_sd, float unloaded, float loaded) {
    const float little = lack(2.0f * h->play.half_width / oc_joint_little_play());
    const float lack_of_flank = lack(loaded);
    const float doubtful = lack_of_flank * oc_max(unloaded, lack_of_flank * lack_of_flank);
    return oc_max(doubtful, little * lack(no_play_share * loaded)) * width_sd * width_sd;
}

/* Mean of a mixture, and its variance within and between. Values are relative to the best hypothesis's, since single
 * precision would lose small differences. */
typedef struct {
    float sum, squares, variances;
} mixture;

static void mix(mixture *mixture, float weight, float difference, float variance) {
    const float weighted = weight * difference;
    mixture->sum += weighted;
    mixture->squares += weighted * difference;
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

/* rad^2, variance of the offset by model mismatch. The sensors' noise adds to it what the scatter of the seconds does
 * not show: the play's clamps and the yaw rate's bias make lasting errors of it. */
static float mismatch_variance(const oc_noise *noise) {
    const float of_yaw_rate = oc_noise_in_mean(noise, OC_NOISE_OF_YAW_RATE);
    const float of_acceleration = oc_noise_in_mean(noise, OC_NOISE_OF_ACCELERATION);
    return offset_error * offset_error + per_yaw_rate_noise * per_yaw_rate_noise * of_yaw_rate +
           per_acceleration_noise * per_acceleration_noise * of_acceleration;
}

void oc_joint_answer_get(oc_joint_answer *answer, const oc_joint *joint, const oc_joint_design *design) {
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    mixture of[OC_OF_COUNT] = {0};
    float about[OC_OF_COUNT], values[OC_OF_COUNT];
    values_of(best, about);
    const float loaded = oc_min(joint->loaded_left_s, joint->loaded_right_s);
    const float width_sd = design->hypothesis.known.width_sd;
    const float prior_gradient = oc_joint_priors()[GRADIENT].mean;
    *answer = (oc_joint_answer){0};
    float all = 0.0f, pull_sum = 0.0f, set_up_sum = 0.0f, lean_sum = 0.0f, set_up_lean_sum = 0.0f;
    float per_acceleration = 0.0f;
    for (int32_t k = 0; k < joint->count; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (!oc_hypothesis_counts(h, &joint->second)) {
            continue;
        }
        const float per = flank_rate(h);
        const float own_left_s = joint->loaded_left_s - h->left_before;
        const float own_right_s = joint->loaded_right_s - h->right_before;
        const float own_loaded = per * oc_min(own_left_s, own_right_s);
        const float excess_cost = oc_max(h->cost + h->prior_cost - best->cost - best->prior_cost, 0.0f);
        const float flank_cost = 2.0f * (float)OC_SECOND_COST_MAX * (lack(own_loaded) - lack(per * loaded));
        const float weight = oc_likelihood(excess_cost + flank_cost);
        const float unloaded = weight * unloaded_width_variance(h, width_sd, design->bank_unmeasured, own_loaded);
        const float by_bank = gradient_share_sd * design->bank_unmeasured * oc_max(h->gradient, prior_gradient);
        values_of(h, values);
        for (int32_t quantity = 0; quantity < OC_OF_COUNT; ++quantity) {
            mix(&of[quantity], weight, values[quantity] - about[quantity], h->variances.of[quantity]);
        }
        for (int32_t quantity = 0; quantity < OC_OF_OFFSET; ++quantity) {
            const float product = (values[OC_OF_OFFSET] - about[OC_OF_OFFSET]) * (values[quantity] - about[quantity]);
            answer->offset_covariance[quantity] += weight * (product + h->offset_covariance[quantity]);
        }
        const float next_step = h->walks ? walk_step : 0.0f;
        of[OC_OF_OFFSET].variances += 0.25f * unloaded + weight * next_step * next_step;
        of[OC_OF_WIDTH].variances += unloaded;
        const bool rarer_right = joint->loaded_left_s > joint->loaded_right_s;
        answer->offset_covariance[OC_OF_WIDTH] -= rarer_right ? 0.5f * unloaded : -0.5f * unloaded;
        const float rolling = rolling_share * h->gradient;
        of[OC_OF_GRADIENT].variances += weight * (by_bank * by_bank + rolling * rolling);
        all += weight;
        pull_sum += weight * h->pull_variance;
        set_up_sum += weight * h->set_up_variance;
        lean_sum += weight * h->lean;
        set_up_lean_sum += weight * h->set_up_lean;
        per_acceleration += weight * h->per_acceleration;
    }
    const float lean = (1.0f - design->bank_unmeasured) * lean_sum / all; /* an unmeasured bank is mostly no pull */
    of[OC_OF_OFFSET].variances += all * mismatch_variance(&joint->second.noise);
    of[OC_OF_WIDTH].variances += all * (width_error * width_error);
    of[OC_OF_UNLOADING].variances += all * (unloading_error * unloading_error);
    for (int32_t k = 0; k < OC_OF_COUNT; ++k) {
        answer->of[k] = (oc_found){about[k] + of[k].sum / all, sqrtf(variance_of(&of[k], all))};
    }
    for (int32_t k = 0; k < OC_OF_OFFSET; ++k) {
        answer->offset_covariance[k] =
            answer->offset_covariance[k] / all - of[OC_OF_OFFSET].sum / all * (of[k].sum / all);
    }
    const float pull_lean = lean - (1.0f - design->bank_unmeasured) * set_up_lean_sum / all;
    const float pull_variance = pull_sum / all + pull_lean * pull_lean;
    const float both = (pull_sum + set_up_sum) / all + lean * lean;
    const float bank_share = 1.0f - design->alignment_share - design->wind_share; /* 0 with an accelerometer */
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

void oc_joint_change_load(oc_joint *joint) {
    for (int32_t k = 0; k < joint->count; ++k) {
        oc_hypothesis_change_load(&joint->hypotheses[k]);
    }
    joint->solves_all = 1;
}

void oc_joint_note_change(oc_joint *joint, const oc_change *change, const oc_estimate *before, double time) {
    joint->changed[joint->changes % OC_CHANGES_MAX] = (oc_changed){
        .time = time,
        .before = before->value,
        .before_sd = before->standard_deviation,
        .change = *change,
    };
    ++joint->changes;
    joint->outlying_s = joint->outlying_sum = joint->outlying_since_s = 0.0f; /* they were of the change */
    const float worth_s = joint->second.reference / (change->size_sd * change->size_sd); /* seconds of this variance */
    if (change->kind != OC_CHANGE_OFFSET) {
        oc_joint_change_load(joint);
        return;
    }
    for (int32_t k = 0; k < joint->count; ++k) {
        oc_hypothesis_shift_offset(&joint->hypotheses[k], change->size, worth_s);
    }
    joint->solves_all = 1; /* the interval includes the change's sd at once, even where the next second is far */
}

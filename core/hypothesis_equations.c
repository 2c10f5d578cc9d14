#include <math.h>

#include "bounds.h"
#include "hypothesis_terms.h"

static const float least_gradient = 0.2f * 0.017453292f; /* rad/(m/s^2), that an interval may rest on */

/* The most by which a second may move the hypothesis: as far as the model is linear. */
static const float unloading_step = 0.03f;              /* m/s^2 */
static const float friction_step = 0.03f;               /* m/s^2 */
static const float creep_step = 0.3f;                   /* share */
static const float unwinding_step = 0.2f;               /* 1/s */

/* Where half a play and half a wind-up may go, rad. */
static const float least_half_play = 0.05f * 0.017453292f;
static const float least_half_windup = 0.02f * 0.017453292f;
static const float most_half = 12.5f * 0.017453292f;

static const float both_ends = 0.15f; /* of a way's square: the variance of whoever is at either end, of which each tail
                                       * is one's */
static const float least_weight = 1e-6f;                /* s: less tells no more of an offset that was moved */
static const float smoothed = 0.71f; /* of white noise in a second, by joint.c's 0.3 s: 1 - 0.3 (1 - exp(-1 / 0.3)) */

static bool creeps(const oc_play *play) {
    return play->friction >= 0.0f;
}

static float mean_of(int32_t term) {
    return oc_joint_model_get()->terms[term].mean;
}

static float found(const oc_hypothesis *h, const oc_hypothesis_design *design, int32_t term) {
    return h->terms[term] * design->scale[term];
}

/* Where a parameter goes that is to be moved by so much, a step at most. */
static float stepped(float value, float by, float step, float low, float high) {
    return oc_clamp(value + oc_clamp(by, -step, step), low, high);
}

void oc_hypothesis_relinearise(oc_hypothesis *h, const oc_hypothesis_design *design) {
    oc_play *play = &h->play;
    const oc_play before = *play;
    play->half_width = stepped(before.half_width, 0.5f * found(h, design, WIDTH), oc_play_width_step(before.half_width),
                               least_half_play, most_half);
    oc_hypothesis_shift(h, design, WIDTH, 2.0f * (play->half_width - before.half_width));
    if (play->half_width < before.half_width) {
        oc_hypothesis_narrow(h, CREEP, UNLOADING, play->half_width / before.half_width);
    }
    play->unloading = stepped(before.unloading, found(h, design, UNLOADING), unloading_step, -1.0f, 1.0f);
    oc_hypothesis_shift(h, design, UNLOADING, play->unloading - before.unloading);
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        play->wind[k] = stepped(before.wind[k], found(h, design, WIND + k), unloading_step, -0.5f, 0.5f);
        oc_hypothesis_shift(h, design, WIND + k, play->wind[k] - before.wind[k]);
    }
    if (!creeps(play)) {
        return;
    }
    play->friction = stepped(before.friction, found(h, design, FRICTION), friction_step, 0.0f, 2.0f);
    oc_hypothesis_shift(h, design, FRICTION, play->friction - before.friction);
    play->creep = stepped(before.creep, before.creep * found(h, design, CREEP), before.creep * creep_step,
                          0.05f * mean_of(CREEP), 10.0f * mean_of(CREEP));
    oc_hypothesis_shift(h, design, CREEP, play->creep / before.creep - 1.0f);
    play->windup = stepped(before.windup, 0.5f * found(h, design, WINDUP), oc_play_width_step(before.windup),
                           least_half_windup, most_half);
    oc_hypothesis_shift(h, design, WINDUP, 2.0f * (play->windup - before.windup));
    if (play->windup < before.windup) {
        oc_hypothesis_narrow(h, UNWINDING, UNWINDING, play->windup / before.windup);
    }
    play->unwinding = stepped(before.unwinding, found(h, design, UNWINDING), unwinding_step, 0.0f, 10.0f);
    oc_hypothesis_shift(h, design, UNWINDING, play->unwinding - before.unwinding);
}

/* By how much less the prior of a_0 tells a hypothesis that is so many of its standard deviations away. Beyond 1.8 its
 * pull fades: a road may fall to the other side than most, or the vehicle file name the wrong one, and where the play
 * shows that, it is not to be talked out of it. */
static float doubted(float apart, float most) {
    const float squared = apart * apart;
    const float fourth = squared * squared;
    return oc_clamp(fourth * fourth / 110.0f, 1.0f, most);
}

/* The priors' information, and their pull on what is left to be found. */
static void add_priors(const oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                       float *information, float *terms) {
    const float *scale = design->scale;
    const oc_play *play = &h->play;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        information[k] = 1.0f;
    }
    const float apart = (prior->unloading_mean - play->unloading) / prior->unloading_sd;
    const float unloading = scale[UNLOADING] / prior->unloading_sd;
    const float bias = scale[YAW_RATE_BIAS] / prior->yaw_rate_bias_sd;
    const float believed = unloading / doubted(apart, design->most_doubt);
    information[UNLOADING] = believed * unloading;
    information[YAW_RATE_BIAS] = bias * bias;
    terms[UNLOADING] += believed * apart;
    terms[GRADIENT] += mean_of(GRADIENT) / scale[GRADIENT];
    terms[WIDTH] += (mean_of(WIDTH) - 2.0f * play->half_width) / scale[WIDTH];
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        terms[WIND + k] -= play->wind[k] / scale[WIND + k];
    }
    if (creeps(play)) {
        const float share = mean_of(CREEP) / play->creep;
        terms[FRICTION] += (mean_of(FRICTION) - play->friction) / scale[FRICTION];
        terms[UNWINDING] -= play->unwinding / scale[UNWINDING];
        terms[WINDUP] += (mean_of(WINDUP) - 2.0f * play->windup) / scale[WINDUP];
        terms[CREEP] += (share > 1.0f ? share - 1.0f : 1.0f - 1.0f / share) / scale[CREEP];
    }
}

float oc_likelihood(float x) {
    float power = 1.0f / (1.0f + x / 32.0f);
    for (int32_t k = 0; k < 5; ++k) {
        power *= power;
    }
    return power;
}

/* How far an interval reaches to where the offset is if the axle was set up to unload on the crown, 0 to 1, where the
 * steering unloads by so much apart from where the accelerometer's zero is believed, to such a variance. One axle in
 * twenty is; as many drives are on roads that fall to the other side than believed, for which that zero is off by twice
 * the crown. What is no likelier than an end of the interval leaves out, it does not reach. */
static float reach(float apart, float crown, float variance) {
    static const float neither = 18.0f; /* for one that is */
    static const float left_out = 0.025f, taken_in = 0.075f;
    const float per = crown / variance;
    const float other_side = oc_likelihood(oc_max(per * (crown - apart), -8.0f)); /* by that likelier */
    const float likely = 1.0f / (1.0f + oc_likelihood(0.5f * per * crown) * (neither / other_side + other_side));
    return oc_clamp((likely - left_out) / (taken_in - left_out), 0.0f, 1.0f);
}

/* The offset is what the sensor reads at a = a_0, where no side force acts but for pull and wind: of its variance what
 * the terms make. */
static float variance_of_offset(const oc_hypothesis *h, const oc_hypothesis_design *design,
                                const oc_equations *equations) {
    const float *scale = design->scale, *terms = equations->terms;
    const float unloading = h->play.unloading + terms[UNLOADING] * scale[UNLOADING];
    float weights[OC_TERMS] = {
        [UNLOADING] = design->steering_ratio * terms[GRADIENT] * scale[GRADIENT] * scale[UNLOADING],
        [GRADIENT] = design->steering_ratio * unloading * scale[GRADIENT],
    };
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        weights[k] -= h->means[k];
    }
    return oc_triangle_variance(equations->lower, equations->inverse, 0, weights);
}

static void conclude_offset(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                            const oc_equations *equations) {
    h->constant = h->target_mean;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        h->constant -= h->means[k] * h->terms[k];
    }
    h->offset = h->constant + design->steering_ratio * h->gradient * h->unloading;

    /* pull and wind part a_0 from the accelerometer's bias: where the drive shows a_0 and its prior the bias, each has
     * its share of what is between; in little play the lag of whatever gives way passes for a_0 */
    const float bias = design->scale[UNLOADING] * design->scale[UNLOADING] / equations->information[UNLOADING];
    const float little = oc_max(1.0f - 2.0f * h->play.half_width / oc_joint_model_get()->little_play, 0.0f);
    const float variance = h->variances.of[OC_OF_UNLOADING], any_pull = design->pull_sd * design->pull_sd;
    const float shown = oc_min(variance + little * bias, bias);
    const float told = 1.0f - shown / bias;
    const float pull = any_pull * told;
    const float of_bias = bias / (bias + pull);
    const float beyond = oc_max(of_bias * (shown + pull) - variance, 0.0f);
    const float apart = h->unloading - prior->unloading_mean;
    const float believed = prior->unloading_sd * prior->unloading_sd + any_pull + variance;
    const float set_up = of_bias * told * prior->crown; /* what is then taken for bias */
    const float reached = reach(apart, prior->crown, believed) * set_up;
    const float perhaps = both_ends * reached * set_up;
    /* what pull does to a truck that understeers a little at least, whatever bends and play are taken for */
    const float pulled = design->steering_ratio * oc_max(h->gradient, least_gradient);
    const float of_pull = pulled * pulled;
    h->lean = pulled * (of_bias * apart - apart - 0.5f * reached);
    h->pulled_variance = of_pull * (oc_min(beyond, pull) + perhaps);
    h->variances.of[OC_OF_OFFSET] += oc_hypothesis_noise(h) / oc_max(h->weight, least_weight) +
                                  of_pull * (beyond + perhaps);
}

static void set_up_equations(const oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                             oc_equations *equations) {
    const float noise = oc_hypothesis_noise(h);
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        equations->terms[k] = h->toward[k] / noise;
    }
    add_priors(h, design, prior, equations->information, equations->terms);
}

/* Noise in what a slope is of flattens it, the more the gentler the bends are: deviations are larger by it than the
 * truck's were (errors in variables). Bends have the yaw rate's, as has the residual, side force the accelerometer's.
 * It is taken out of the factor, whose last rows these terms are: what was gathered stays a sum of squares. Half of
 * what tells the gradient stays in any case. */
static void take_noise_out(const oc_hypothesis *h, const oc_hypothesis_design *design, const oc_second *second,
                           oc_equations *equations) {
    enum { BEND = WHEELBASE * (WHEELBASE + 3) / 2, BOTH = BEND + GRADIENT, FORCE };
    float *lower = equations->lower;
    const float seconds = h->learned_s / oc_hypothesis_noise(h);
    const float force = design->of_sum[GRADIENT];
    const float bend = design->of_sum[WHEELBASE] * h->means[YAW_RATE_BIAS] / design->of_sum[YAW_RATE_BIAS];
    const float acceleration = smoothed * oc_noise_in_mean(&second->noise, OC_NOISE_OF_ACCELERATION);
    const float yaw_rate = oc_noise_in_mean(&second->noise, OC_NOISE_OF_YAW_RATE);

    const float across = lower[BOTH] * lower[BEND];
    const float bends = lower[BEND] * lower[BEND], forces = lower[FORCE] * lower[FORCE];
    const float both = lower[BOTH] * lower[BOTH];
    const float known_before = equations->information[GRADIENT];
    const float parted = oc_max(0.5f * (forces - known_before), 0.0f); /* so much stays of forces */
    const float shared = both + parted; /* at most, for which bends need */
    const float needed = shared > 0.0f ? across * across / shared : bends;
    const float most = oc_clamp(design->scale[WHEELBASE] * bends, 0.0f, oc_max(bends - needed, 0.0f));
    const float of_bend = oc_clamp(seconds * yaw_rate * bend * bend, 0.0f, most); /* moves it by its prior's sd */
    lower[BEND] = sqrtf(bends - of_bend);
    equations->inverse[WHEELBASE] = 1.0f / lower[BEND];
    lower[BOTH] = across * equations->inverse[WHEELBASE];
    const float left = both + forces - lower[BOTH] * lower[BOTH];
    const float spare = oc_max(left - (forces - parted), 0.0f);
    const float of_force = oc_clamp(seconds * acceleration * force * force, 0.0f, spare);
    lower[FORCE] = sqrtf(oc_max(left - of_force, forces - parted)); /* rounding may have left less */
    equations->inverse[GRADIENT] = 1.0f / lower[FORCE];
    equations->terms[WHEELBASE] += of_bend / design->scale[WHEELBASE];
}

/* Of parameters that are two terms together, or one: then the second is the same as the first. */
static void find_variances(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_equations *equations) {
    static const struct {
        int32_t first, second;
    } asked[OC_OF_OFFSET] = {
        [OC_OF_GRADIENT] = {GRADIENT, GRADIENT},
        [OC_OF_UNLOADING] = {UNLOADING, UNLOADING},
        [OC_OF_WIDTH] = {WIDTH, WINDUP},
        [OC_OF_WHEELBASE] = {WHEELBASE, WHEELBASE},
    };
    for (int32_t k = 0; k < OC_OF_OFFSET; ++k) {
        const int32_t first = asked[k].first, second = asked[k].second;
        float weights[OC_TERMS] = {0};
        weights[first] = design->scale[first];
        weights[second] = design->scale[second];
        h->variances.of[k] = oc_triangle_variance(equations->lower, equations->inverse, first, weights);
    }
    h->variances.of[OC_OF_OFFSET] = variance_of_offset(h, design, equations);
}

static void conclude(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                     const oc_equations *equations) {
    h->gradient = found(h, design, GRADIENT);
    h->unloading = h->play.unloading + found(h, design, UNLOADING);
    h->wheelbase = found(h, design, WHEELBASE);
    conclude_offset(h, design, prior, equations);
}

void oc_hypothesis_solve(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                         const oc_second *second, oc_equations *equations) {
    set_up_equations(h, design, prior, equations);
    oc_triangle_factor(h->scatter, equations->information, oc_hypothesis_noise(h), equations->lower,
                       equations->inverse);
    take_noise_out(h, design, second, equations);
    oc_triangle_solve_lower(equations->lower, equations->inverse, 0, equations->terms);
    oc_triangle_solve_upper(equations->lower, equations->inverse, equations->terms);
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        h->terms[k] = equations->terms[k];
    }
    find_variances(h, design, equations);
    conclude(h, design, prior, equations);
}

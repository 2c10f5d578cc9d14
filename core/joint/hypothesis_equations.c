#include <math.h>

#include "bounds.h"
#include "hypothesis.h"
#include "joint_model.h"

/* Derived. */
static const float smoothed_noise = 0.71f; /* of white noise, by joint.c's 0.3 s: 1 - 0.3 (1 - exp(-1 / 0.3)) */

/* Numerical. */
/* Maximum steps of one solution: the model is linear over play.c's differences. */
static const float unloading_step = 0.03f;                 /* m/s^2 */
static const float friction_step = 0.03f;                  /* m/s^2 */
static const float creep_step = 0.3f;                      /* share */
static const float unwinding_step = 0.2f;                  /* 1/s */
static const float half_play_min = 0.05f * 0.017453292f;   /* rad, against a division by zero */
static const float half_windup_min = 0.02f * 0.017453292f; /* rad, the same */
static const float half_width_max = 12.5f * 0.017453292f;  /* rad, against divergence; play is at most 15 deg */
static const float weight_min = 1e-6f;                     /* s, against a division by zero */

/* Tuned, in tuned.toml: hypothesis_equations */
static const float front_slip = 0.7f * 0.017453292f; /* rad/(m/s^2): slip of the front wheels per front tyre force */
static const float road_max = 0.6f; /* m/s^2: distance of a_0 from its prior that roads explain */
static const float wide_pull = 2.5f; /* sd of a wide pull or wind over that of a usual one */
static const float two_ends_share = 0.15f; /* variance of an interval between two offsets, over the squared distance */
/* prior probability of roads that fall to the other side than that of traffic */
static const float other_side_probability = 0.05f;
static const float removed_share = 0.75f; /* share of the crown that superelevated bends remove */
/* end */

/* Compiles only if the terms are in the order that is used here: the noise is removed from the factor's last rows,
 * the operators add to consecutive sums (play.c), and a narrower play scales those from creep to unloading. */
enum {
    NOISY_TERMS_ARE_LAST = 1 / (WHEELBASE == OC_TERMS - 2 && GRADIENT == OC_TERMS - 1),
    SLOPES_FOLLOW_ONE_ANOTHER = 1 / (WINDUP == CREEP + OC_SLOPE_WINDUP),
    CREEP_TO_UNLOADING_ARE_THREE = 1 / (FRICTION == CREEP + 1 && UNLOADING == CREEP + 2),
    WINDS_FOLLOW_ONE_ANOTHER = 1 / (WIND_ACROSS == WIND + OC_WINDS - 1)
};

static bool creeps(const oc_play *play) {
    return play->friction >= 0.0f;
}

static float mean_of(int32_t term) {
    return oc_joint_priors()[term].mean;
}

static float solved(const oc_hypothesis *h, const oc_hypothesis_design *design, int32_t term) {
    return h->terms[term] * design->scale[term];
}

/* Moves a parameter by one limited step. */
static float stepped(float value, float by, float step, float low, float high) {
    return oc_clamp(value + oc_clamp(by, -step, step), low, high);
}

void oc_hypothesis_relinearise(oc_hypothesis *h, const oc_hypothesis_design *design) {
    oc_play *play = &h->play;
    const oc_play before = *play;
    play->half_width = stepped(before.half_width, 0.5f * solved(h, design, WIDTH),
                               oc_play_width_step(before.half_width), half_play_min, half_width_max);
    oc_hypothesis_shift(h, design, WIDTH, 2.0f * (play->half_width - before.half_width));
    if (play->half_width < before.half_width) {
        oc_hypothesis_scale_slopes(h, CREEP, UNLOADING, play->half_width / before.half_width);
    }
    play->unloading = stepped(before.unloading, solved(h, design, UNLOADING), unloading_step, -1.0f, 1.0f);
    oc_hypothesis_shift(h, design, UNLOADING, play->unloading - before.unloading);
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        play->wind[k] = stepped(before.wind[k], solved(h, design, WIND + k), unloading_step, -0.5f, 0.5f);
        oc_hypothesis_shift(h, design, WIND + k, play->wind[k] - before.wind[k]);
    }
    const float fifth_wheel = solved(h, design, FIFTH_WHEEL) / (design->steering_ratio * front_slip);
    play->fifth_wheel = stepped(before.fifth_wheel, fifth_wheel - before.fifth_wheel, unloading_step, -0.5f, 0.5f);
    if (!creeps(play)) {
        return;
    }
    play->friction = stepped(before.friction, solved(h, design, FRICTION), friction_step, 0.0f, 2.0f);
    oc_hypothesis_shift(h, design, FRICTION, play->friction - before.friction);
    play->creep = stepped(before.creep, before.creep * solved(h, design, CREEP), before.creep * creep_step,
                          0.05f * mean_of(CREEP), 10.0f * mean_of(CREEP));
    oc_hypothesis_shift(h, design, CREEP, play->creep / before.creep - 1.0f);
    play->windup = stepped(before.windup, 0.5f * solved(h, design, WINDUP), oc_play_width_step(before.windup),
                           half_windup_min, half_width_max);
    oc_hypothesis_shift(h, design, WINDUP, 2.0f * (play->windup - before.windup));
    if (play->windup < before.windup) {
        oc_hypothesis_scale_slopes(h, UNWINDING, UNWINDING, play->windup / before.windup);
    }
    play->unwinding = stepped(before.unwinding, solved(h, design, UNWINDING), unwinding_step, 0.0f, 10.0f);
    oc_hypothesis_shift(h, design, UNWINDING, play->unwinding - before.unwinding);
}

/* Divisor of a_0's prior information at `deviation` standard deviations from its mean: (z/1.8)^8 (docs/method.md,
 * "Regression"). The road may fall to the other side, or the vehicle file may name the wrong side of traffic. Beyond
 * road_max no road explains a_0, and the prior holds in full. */
static float prior_discount(float deviation, float unloading_sd, float max) {
    const float squared = deviation * deviation;
    if (fabsf(deviation) * unloading_sd > road_max) {
        return 1.0f;
    }
    const float fourth = squared * squared;
    return oc_clamp(fourth * fourth / 110.0f, 1.0f, max);
}

/* The priors' information and right sides. */
static void add_priors(const oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                       float *information, float *terms) {
    const float *scale = design->scale;
    const oc_play *play = &h->play;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        information[k] = 1.0f;
    }
    const float deviation = (prior->unloading_mean - play->unloading) / prior->unloading_sd;
    const float unloading = scale[UNLOADING] / prior->unloading_sd;
    const float bias = scale[YAW_RATE_BIAS] / prior->yaw_rate_bias_sd;
    const float discounted = unloading / prior_discount(deviation, prior->unloading_sd, design->prior_discount_max);
    const float by_torque = prior->zero_information * scale[UNLOADING];
    information[UNLOADING] = discounted * unloading + by_torque * scale[UNLOADING];
    information[YAW_RATE_BIAS] = bias * bias;
    information[WHEELBASE] = design->known.wheelbase.information;
    information[GRADIENT] = design->known.gradient.information;
    terms[UNLOADING] += discounted * deviation - by_torque * play->unloading;
    terms[WHEELBASE] += design->known.wheelbase.right_side;
    terms[GRADIENT] += design->known.gradient.right_side;
    terms[WIDTH] += (h->width_mean - 2.0f * play->half_width) / scale[WIDTH];
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

/* A given play is one more observation, of B + W with the play's sd. A rubbing hypothesis has no W. */
static void add_known_play(const oc_hypothesis *h, const oc_hypothesis_design *design, oc_equations *equations) {
    enum { B_B = WIDTH * (WIDTH + 3) / 2, W_B = WINDUP * (WINDUP + 1) / 2 + WIDTH, W_W = W_B + WINDUP - WIDTH };
    const float accuracy = design->known.play_accuracy;
    const float width = accuracy * design->scale[WIDTH], windup = accuracy * design->scale[WINDUP];
    const float deviation = accuracy * (design->known.play - 2.0f * (h->play.half_width + h->play.windup));
    equations->lower[B_B] += width * width;
    equations->lower[W_W] += windup * windup;
    equations->terms[WIDTH] += width * deviation;
    if (creeps(&h->play)) {
        equations->lower[W_B] += width * windup;
        equations->terms[WINDUP] += windup * deviation;
    }
}

float oc_likelihood(float x) {
    float power = 1.0f / (1.0f + x / 32.0f);
    for (int32_t k = 0; k < 5; ++k) {
        power *= power;
    }
    return power;
}

/* Share of the offset of an axle set up for the crown that the interval includes, 0 to 1: by Bayes over three normals
 * about m, m + c and m + 2 c (docs/method.md, "An axle set up for the crown"). `deviation` is a_0 - m; the
 * probabilities are of such an axle and of roads that fall to the other side, m + 2 c; `by_bends` is their log odds. */
static float crown_setup_share(float deviation, float crown, float variance, float set_up, float other_side,
                               float by_bends) {
    static const float probability_low = 0.025f, probability_high = 0.075f; /* one tail of 95 %, and three */
    const float per = crown / variance;
    const float ratio = oc_likelihood(oc_clamp(per * (crown - deviation), -8.0f, 8.0f)); /* of likelihoods */
    const float sides = (1.0f - set_up - other_side) / ratio + other_side * ratio;
    const float likely = set_up / (set_up + oc_likelihood(0.5f * per * crown + by_bends) * sides);
    return oc_clamp((likely - probability_low) / (probability_high - probability_low), 0.0f, 1.0f);
}

/* Log odds of an axle set up for the crown, by superelevated bends. They remove 3/4 of the crown: a healthy axle's is
 * the bank less a_0, and that of an axle set up is more or less than this by c. */
static float log_odds_by_bends(const oc_prior *prior, float fell) {
    static const float other_side = 0.7f; /* log 2: half of such axles are set up to the other side */
    const float shift = removed_share * prior->crown, per = shift * prior->removed_information;
    const float apart = fabsf(per * (prior->removed - removed_share * fell));
    return oc_clamp(apart - other_side, 0.0f, 8.0f) - 0.5f * per * shift;
}

/* The same of a hypothesis. Where the side of traffic is unknown, a_0 is compared with the mean bank, which a crown to
 * either side puts c away from a healthy axle's a_0, whatever the accelerometer's bias. */
static float set_up_share_of(const oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior) {
    const bool either_side = prior->bank_sd > 0.0f;
    const float set_up = design->known.set_up_probability;
    const float other_side = either_side ? 0.5f * (1.0f - set_up) : other_side_probability;
    const float sd = either_side ? prior->bank_sd : prior->unloading_sd;
    const float variance = sd * sd + design->pull_sd * design->pull_sd + h->variances.of[OC_OF_UNLOADING];
    const float mean = either_side ? prior->bank - prior->crown : prior->unloading_mean;
    const float by_bends = log_odds_by_bends(prior, prior->bank - h->unloading);
    return crown_setup_share(h->unloading - mean, prior->crown, variance, set_up, other_side, by_bends);
}

/* Variance of o = constant + i K (a_0 - pull) by the terms; the weights are its gradient. */
static float variance_of_offset(const oc_hypothesis *h, const oc_hypothesis_design *design, oc_equations *equations) {
    const float *scale = design->scale, *terms = equations->terms;
    const float unloading = h->play.unloading + terms[UNLOADING] * scale[UNLOADING] - design->known.pull;
    float *weights = equations->weights[OC_OF_OFFSET];
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        weights[k] = -h->means[k];
    }
    weights[UNLOADING] += design->steering_ratio * terms[GRADIENT] * scale[GRADIENT] * scale[UNLOADING];
    weights[GRADIENT] += design->steering_ratio * unloading * scale[GRADIENT];
    return oc_triangle_variance(equations->lower, equations->inverse, 0, weights);
}

/* Variance of pull and wind, (m/s^2)^2, by a mixture of two normals: those of one truck in ten have a wider one, the
 * more probable the farther a_0 is from its prior. `others`: variance of a_0 without pull and wind. */
static float pull_variance(const oc_hypothesis_design *design, float deviation, float others) {
    const float wider = wide_pull * wide_pull;
    const float narrow = design->pull_sd * design->pull_sd, tail = design->known.pull_tail;
    const float narrow_spread = others + narrow, wide_spread = others + wider * narrow;
    const float cost = 0.5f * deviation * deviation * (1.0f / narrow_spread - 1.0f / wide_spread);
    const float wide_density = tail * sqrtf(narrow_spread / wide_spread);
    const float wide = wide_density / (wide_density + (1.0f - tail) * oc_likelihood(cost));
    return narrow * (1.0f + wide * (wider - 1.0f));
}

/* o = constant + i K (a_0 - pull), with constant = mean(y) - mean(X) x for the solution x of the normal equations. */
static void find_offset(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                        const oc_equations *equations) {
    h->constant = h->target_mean;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        h->constant -= h->means[k] * h->terms[k];
    }
    h->offset = h->constant + design->steering_ratio * h->gradient * (h->unloading - design->known.pull);

    /* a_0 = accelerometer bias + pull + wind (docs/method.md, "Pull and wind"): bias is S^2, remaining V, pull P^2,
     * of_bias 1 - s. In little play V grows, since the lag of the steering has the effect of a_0. */
    const float scale = design->scale[UNLOADING];
    const float squared_scale = scale * scale;
    const float bias = squared_scale / (equations->information[UNLOADING] - prior->zero_information * squared_scale);
    const float little = oc_max(1.0f - 2.0f * h->play.half_width / oc_joint_little_play(), 0.0f);
    const float variance = h->variances.of[OC_OF_UNLOADING];
    const float deviation = h->unloading - prior->unloading_mean;
    const float others = prior->unloading_sd * prior->unloading_sd + variance;
    const float pull_prior = pull_variance(design, deviation, others);
    const float remaining = oc_min(variance + little * bias, bias);
    const float identified = 1.0f - remaining / bias;
    const float pull = pull_prior * identified;
    const float of_bias = bias / (bias + pull);
    const float beyond = oc_max(of_bias * (remaining + pull) - variance, 0.0f);
    const float spread = others + design->pull_sd * design->pull_sd;
    const float set_up = of_bias * identified * prior->crown; /* of such an axle, attributed to bias */
    const float likely_set_up = set_up_share_of(h, design, prior) * set_up;
    const bool either_side = prior->bank_sd > 0.0f; /* the interval reaches as far on both sides */
    const float set_up_variance = (either_side ? 2.0f : 1.0f) * two_ends_share * likely_set_up * set_up;
    const float per_pull = design->steering_ratio * oc_max(h->gradient, 0.0f);
    const float per_pull_squared = per_pull * per_pull;
    h->prior_cost = oc_min(0.5f * deviation * deviation / spread, (float)OC_SECOND_COST_MAX);
    h->set_up_lean = either_side ? 0.0f : -0.5f * per_pull * likely_set_up;
    h->lean = per_pull * (of_bias * deviation - deviation) + h->set_up_lean;
    h->per_acceleration = per_pull * identified;
    h->pull_variance = per_pull_squared * oc_min(beyond, pull);
    h->set_up_variance = per_pull_squared * set_up_variance;
    h->variances.of[OC_OF_OFFSET] += oc_hypothesis_noise(h) / oc_max(h->weight, weight_min) +
                                  per_pull_squared * oc_max(beyond - pull, 0.0f);
}

static void set_up_equations(const oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                             oc_equations *equations) {
    const float noise = oc_hypothesis_noise(h), weight = 1.0f / noise;
    for (int32_t k = 0; k < OC_TERMS_TRIANGLE; ++k) {
        equations->lower[k] = weight * h->scatter[k];
    }
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        equations->terms[k] = h->target_products[k] / noise;
    }
    add_priors(h, design, prior, equations->information, equations->terms);
    if (design->known.play_accuracy > 0.0f) {
        add_known_play(h, design, equations);
    }
}

/* Errors in variables (docs/method.md, "Noise in the regressors"): curvature and residual share the yaw rate's noise,
 * lateral acceleration has the accelerometer's. With the normal equations N = L L', the last two rows' block of L is M,
 * and S = M M' is what the other terms leave to l and K:
 *
 *     S <- S - diag(n_l, n_K), then M anew;   n = s/noise var(noise in the regressor), over s seconds
 *
 * Both n are limited, so that S stays positive definite and at least half of the gradient's information stays. */
static void remove_noise(const oc_hypothesis *h, const oc_hypothesis_design *design, const oc_second *second,
                           oc_equations *equations) {
    enum { BEND = WHEELBASE * (WHEELBASE + 3) / 2, BOTH = BEND + GRADIENT, FORCE };
    float *lower = equations->lower;
    const float seconds = h->learned_s / oc_hypothesis_noise(h);
    const float force = design->of_sum[GRADIENT];
    const float bend = design->of_sum[WHEELBASE] * h->means[YAW_RATE_BIAS] / design->of_sum[YAW_RATE_BIAS];
    const float acceleration = smoothed_noise * oc_noise_in_mean(&second->noise, OC_NOISE_OF_ACCELERATION);
    const float yaw_rate = oc_noise_in_mean(&second->noise, OC_NOISE_OF_YAW_RATE);

    const float across = lower[BOTH] * lower[BEND];
    const float bends = lower[BEND] * lower[BEND], forces = lower[FORCE] * lower[FORCE];
    const float both = lower[BOTH] * lower[BOTH];
    const float prior_information = equations->information[GRADIENT];
    const float force_min = oc_max(0.5f * (forces - prior_information), 0.0f); /* the remaining part of forces */
    const float shared = both + force_min;
    const float needed = shared > 0.0f ? across * across / shared : bends;
    const float max = oc_clamp(design->scale[WHEELBASE] * bends, 0.0f, oc_max(bends - needed, 0.0f));
    const float bend_noise = oc_clamp(seconds * yaw_rate * bend * bend, 0.0f, max); /* max: moves l by its prior's sd */
    lower[BEND] = sqrtf(oc_max(bends - bend_noise, equations->information[WHEELBASE]));
    equations->inverse[WHEELBASE] = 1.0f / lower[BEND];
    lower[BOTH] = across * equations->inverse[WHEELBASE];
    const float left = both + forces - lower[BOTH] * lower[BOTH];
    const float spare = oc_max(left - (forces - force_min), 0.0f);
    const float force_noise = oc_clamp(seconds * acceleration * force * force, 0.0f, spare);
    lower[FORCE] = sqrtf(oc_max(left - force_noise, forces - force_min)); /* against rounding */
    equations->inverse[GRADIENT] = 1.0f / lower[FORCE];
    equations->terms[WHEELBASE] += bend_noise / design->scale[WHEELBASE];
}

/* A quantity is one term (`first` equals `second`), or the sum of two. */
static void find_variances(oc_hypothesis *h, const oc_hypothesis_design *design, oc_equations *equations) {
    static const struct {
        int32_t first, second;
    } terms_of[OC_OF_OFFSET] = {
        [OC_OF_GRADIENT] = {GRADIENT, GRADIENT},
        [OC_OF_UNLOADING] = {UNLOADING, UNLOADING},
        [OC_OF_WIDTH] = {WIDTH, WINDUP},
        [OC_OF_WHEELBASE] = {WHEELBASE, WHEELBASE},
    };
    h->variances.of[OC_OF_OFFSET] = variance_of_offset(h, design, equations);
    for (int32_t k = 0; k < OC_OF_OFFSET; ++k) {
        const int32_t first = terms_of[k].first, second = terms_of[k].second;
        float *weights = equations->weights[k];
        for (int32_t term = first; term < OC_TERMS; ++term) {
            weights[term] = 0.0f;
        }
        weights[first] = design->scale[first];
        weights[second] = design->scale[second];
        h->variances.of[k] = oc_triangle_variance(equations->lower, equations->inverse, first, weights);
        h->offset_covariance[k] = oc_triangle_covariance(weights, equations->weights[OC_OF_OFFSET], first);
    }
}

static void find_parameters(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                     const oc_equations *equations) {
    h->gradient = solved(h, design, GRADIENT);
    h->unloading = h->play.unloading + solved(h, design, UNLOADING);
    h->wheelbase = solved(h, design, WHEELBASE);
    find_offset(h, design, prior, equations);
}

void oc_hypothesis_solve(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                         const oc_second *second, oc_equations *equations) {
    set_up_equations(h, design, prior, equations);
    oc_triangle_factor(equations->lower, equations->information, equations->inverse);
    remove_noise(h, design, second, equations);
    oc_triangle_solve_lower(equations->lower, equations->inverse, 0, equations->terms);
    oc_triangle_solve_upper(equations->lower, equations->inverse, equations->terms);
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        h->terms[k] = equations->terms[k];
    }
    find_variances(h, design, equations);
    find_parameters(h, design, prior, equations);
}

#include "hypothesis.h"

#include <math.h>
#include <stddef.h>

/* The terms, in this order: the play's as oc_slope has them, and late whose variance is asked for, since the later a
 * term, the fewer equations tell it. */
enum { YAW_ACCELERATION, JERK, YAW_RATE_BIAS, WIND, WIND_ACROSS, CREEP, FRICTION, UNLOADING, WIDTH, UNWINDING, WINDUP,
       WHEELBASE, GRADIENT };

/* Priors. Trucks have 0 to 15 deg of play, most of them little; king-pin friction holds some 0.1 m/s^2 of side force;
 * K_us/g is 4.2's, give or take as much. */
static const float rad_per_deg = 0.017453292f;
static const float width_mean = 4.0f * 0.017453292f;    /* rad */
static const float windup_mean = 1.0f * 0.017453292f;   /* rad */
static const float gradient_mean = 0.4f * 0.017453292f; /* rad/(m/s^2) */
static const float least_gradient = 0.2f * 0.017453292f; /* rad/(m/s^2), that an interval may rest on */
static const float friction_mean = 0.1f;                /* m/s^2 */
static const float creep_mean = 100.0f * 0.017453292f;  /* rad/s per m/s^2 */

/* The most by which a second may move the hypothesis: as far as the model is linear. */
static const float unloading_step = 0.03f;              /* m/s^2 */
static const float friction_step = 0.03f;               /* m/s^2 */
static const float creep_step = 0.3f;                   /* share */
static const float unwinding_step = 0.2f;               /* 1/s */
static const float little_width = 2.0f * 0.017453292f;  /* rad */
static const float least_variance = 1e-7f;              /* rad^2, of a second: what J1939's steps of the angle leave */
static const float least_weight = 1e-6f;                /* s: less tells no more of an offset that was moved */
static const float smoothed = 0.71f; /* of white noise in a second, by joint.c's 0.3 s: 1 - 0.3 (1 - exp(-1 / 0.3)) */
static const float newborn_handicap = 16.0f;            /* of cost: two wild seconds do not make it the best */

void oc_hypothesis_setup(oc_hypothesis_design *design, double step_s, double steering_ratio,
                         double ratio_times_wheelbase, float pull_sd) {
    float apart[OC_SLOPE_COUNT];
    oc_play_apart(&(oc_play){0}, apart);
    *design = (oc_hypothesis_design){
        .step_s = (float)step_s,
        .steering_ratio = (float)steering_ratio,
        .ratio_times_wheelbase = (float)ratio_times_wheelbase,
        .per_unloading = 1.0f / apart[OC_SLOPE_UNLOADING],
        .pull_sd = pull_sd,
        .scale = {
            [GRADIENT] = 0.4f * rad_per_deg,
            [YAW_ACCELERATION] = 100.0f * rad_per_deg,
            [JERK] = 10.0f * rad_per_deg,
            [WHEELBASE] = 0.05f,
            [YAW_RATE_BIAS] = 1.0f * rad_per_deg,
            [WIDTH] = 6.0f * rad_per_deg,
            [UNLOADING] = 0.15f,
            [FRICTION] = 0.15f,
            [CREEP] = 0.7f,
            [WINDUP] = 2.0f * rad_per_deg,
            [UNWINDING] = 0.6f,
            [WIND] = 0.05f,
            [WIND_ACROSS] = 0.05f,
        },
    };
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        design->of_sum[k] = design->scale[k];
    }
    design->of_sum[GRADIENT] *= design->steering_ratio;
    design->of_sum[WHEELBASE] *= design->ratio_times_wheelbase;
    design->of_sum[YAW_RATE_BIAS] *= -design->ratio_times_wheelbase;
}

static float within_range(float value, float low, float high) {
    if (value < low) {
        return low;
    }
    return value > high ? high : value;
}

static float larger(float a, float b) {
    return a > b ? a : b;
}

static bool creeps(const oc_play *play) {
    return play->friction >= 0.0f;
}

/* What a wind of 1 m/s^2 would add: it takes side force from the tyres, and unloads the play as a_0 does. Returns what
 * the one believed in adds, rad. */
static float add_wind(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_motion_sample *sample,
                      float unloads) {
    const float slope = design->steering_ratio * h->gradient;
    float blown = 0.0f;
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        h->sums[WIND + k] += (unloads - slope) * sample->wind[k];
        blown -= slope * h->play.wind[k] * sample->wind[k];
    }
    return blown;
}

static void add_motion(float *sums, const oc_motion_sample *sample) {
    sums[GRADIENT] += sample->lateral_acceleration;
    sums[YAW_ACCELERATION] += sample->yaw_acceleration;
    sums[JERK] += sample->jerk;
    sums[WHEELBASE] += sample->curvature;
    sums[YAW_RATE_BIAS] += sample->per_speed;
}

/* What a second showed that was not foretold, rad. */
static float surprise(const oc_hypothesis *h, const float *terms, float target) {
    float error = target - h->constant;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        error -= terms[k] * h->terms[k];
    }
    return error;
}

/* What a second says of the hypothesis itself. What is far off counts by its sign only (Huber). */
static void judge_second(oc_hypothesis *h, const oc_second *second) {
    const float squared = h->error * h->error;
    const float limit = 4.0f * h->variance;
    h->trust = squared > limit ? sqrtf(limit / squared) : 1.0f;

    const float keep = second->memory_share;
    const float quick = larger(1.0f / (2.0f + h->age / second->second_s), 0.02f);
    const float varied = h->variance + (within_range(squared, 0.0f, 9.0f * h->variance) - h->variance) * quick;
    h->variance = larger(varied, least_variance);
    h->blocks.sum += h->trust * h->error;
    h->long_blocks.sum += h->trust * h->error;
    h->age += second->second_s;
    if (oc_hypothesis_is_newborn(h, second)) {
        h->cost = keep * second->best_cost + newborn_handicap;
    } else {
        h->cost = keep * h->cost + 0.5f * within_range(squared / second->reference, 0.0f, 16.0f);
    }
}

/* A second's means have less of the sensors' noise, which flattens slopes, than its samples. */
static float means_of_second(const oc_hypothesis *h, const oc_hypothesis_design *design, int32_t samples,
                             float *terms) {
    const float share = 1.0f / (float)samples;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        terms[k] = design->of_sum[k] * share * h->sums[k];
    }
    return h->target_sum * share;
}

/* Recursive least squares about the means. Deviations and not plain products: a term that hardly varies could not be
 * told from the constant in single precision. */
static void regress(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_second *second, int32_t samples) {
    float apart[OC_TERMS];
    const float keep = second->memory_share;
    const float target = means_of_second(h, design, samples, apart);
    h->weight = keep * h->weight + h->trust;
    h->learned_s = keep * h->learned_s + h->trust;
    const float share = h->trust / h->weight;
    const float target_apart = target - h->target_mean;
    h->target_mean += share * target_apart;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        apart[k] -= h->means[k];
        h->means[k] += share * apart[k];
    }
    const float added = h->trust * (1.0f - share);
    float *cell = h->scatter;
    for (int32_t row = 0; row < OC_TERMS; ++row) {
        const float weighted = added * apart[row];
        h->toward[row] = keep * h->toward[row] + weighted * target_apart;
        for (int32_t column = 0; column <= row; ++column, ++cell) {
            *cell = keep * *cell + weighted * apart[column];
        }
    }
}

static void correlate(oc_correlation *correlation, float variance, int32_t seconds, int32_t blocks) {
    const float ratio = within_range(correlation->sum * correlation->sum / ((float)seconds * variance), 0.0f, 60.0f);
    correlation->factor += (ratio - correlation->factor) * larger(1.0f / (5.0f + (float)blocks), 0.01f);
    correlation->sum = 0.0f;
}

bool oc_hypothesis_is_newborn(const oc_hypothesis *h, const oc_second *second) {
    return h->age <= second->trial_s && second->used_s > second->trial_s;
}

float oc_hypothesis_noise(const oc_hypothesis *h) {
    return h->variance * larger(larger(h->blocks.factor, h->long_blocks.factor), 1.0f);
}

/* A parameter of the play was moved by that much: what is left to be found is less by it. */
static void shift(oc_hypothesis *h, const oc_hypothesis_design *design, int32_t term, float by) {
    const float scaled = by / design->scale[term];
    oc_triangle_subtract_row(h->scatter, term, scaled, h->toward);
    h->target_mean -= h->means[term] * scaled;
    h->terms[term] -= scaled;
}

static float found(const oc_hypothesis *h, const oc_hypothesis_design *design, int32_t term) {
    return h->terms[term] * design->scale[term];
}

/* All that was gathered of a term as if it had shown only by that share. */
static void fade(oc_hypothesis *h, int32_t term, float share) {
    oc_triangle_scale(h->scatter, term, share);
    h->toward[term] *= share;
}

/* Where a parameter goes that is to be moved by so much, a step at most. */
static float stepped(float value, float by, float step, float low, float high) {
    return within_range(value + within_range(by, -step, step), low, high);
}

/* Within a narrower play or wind-up all that happens shows less: so would it have before. */
static void narrow(oc_hypothesis *h, int32_t first, int32_t last, float share) {
    for (int32_t term = first; term <= last; ++term) {
        fade(h, term, share);
        h->means[term] *= share;
    }
}

/* The hypothesis goes where its terms point, a little at a time, and keeps its evidence. */
static void relinearise(oc_hypothesis *h, const oc_hypothesis_design *design) {
    oc_play *play = &h->play;
    const oc_play before = *play;
    play->half_width = stepped(before.half_width, 0.5f * found(h, design, WIDTH), oc_play_width_step(before.half_width),
                               0.05f * rad_per_deg, 12.5f * rad_per_deg);
    shift(h, design, WIDTH, 2.0f * (play->half_width - before.half_width));
    if (play->half_width < before.half_width) {
        narrow(h, CREEP, UNLOADING, play->half_width / before.half_width);
    }
    play->unloading = stepped(before.unloading, found(h, design, UNLOADING), unloading_step, -1.0f, 1.0f);
    shift(h, design, UNLOADING, play->unloading - before.unloading);
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        play->wind[k] = stepped(before.wind[k], found(h, design, WIND + k), unloading_step, -0.5f, 0.5f);
        shift(h, design, WIND + k, play->wind[k] - before.wind[k]);
    }
    if (!creeps(play)) {
        return;
    }
    play->friction = stepped(before.friction, found(h, design, FRICTION), friction_step, 0.0f, 2.0f);
    shift(h, design, FRICTION, play->friction - before.friction);
    play->creep = stepped(before.creep, before.creep * found(h, design, CREEP), before.creep * creep_step,
                          0.05f * creep_mean, 10.0f * creep_mean);
    shift(h, design, CREEP, play->creep / before.creep - 1.0f);
    play->windup = stepped(before.windup, 0.5f * found(h, design, WINDUP), oc_play_width_step(before.windup),
                           0.02f * rad_per_deg, 12.5f * rad_per_deg);
    shift(h, design, WINDUP, 2.0f * (play->windup - before.windup));
    if (play->windup < before.windup) {
        narrow(h, UNWINDING, UNWINDING, play->windup / before.windup);
    }
    play->unwinding = stepped(before.unwinding, found(h, design, UNWINDING), unwinding_step, 0.0f, 10.0f);
    shift(h, design, UNWINDING, play->unwinding - before.unwinding);
}

/* The priors' information, and their pull on what is left to be found. */
static void add_priors(const oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                       float *information, float *terms) {
    const float *scale = design->scale;
    const oc_play *play = &h->play;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        information[k] = 1.0f;
    }
    const float unloading = scale[UNLOADING] / prior->unloading_sd;
    const float bias = scale[YAW_RATE_BIAS] / prior->yaw_rate_bias_sd;
    information[UNLOADING] = unloading * unloading;
    information[YAW_RATE_BIAS] = bias * bias;
    terms[UNLOADING] += information[UNLOADING] * (prior->unloading_mean - play->unloading) / scale[UNLOADING];
    terms[GRADIENT] += gradient_mean / scale[GRADIENT];
    terms[WIDTH] += (width_mean - 2.0f * play->half_width) / scale[WIDTH];
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        terms[WIND + k] -= play->wind[k] / scale[WIND + k];
    }
    if (creeps(play)) {
        const float share = creep_mean / play->creep;
        terms[FRICTION] += (friction_mean - play->friction) / scale[FRICTION];
        terms[UNWINDING] -= play->unwinding / scale[UNWINDING];
        terms[WINDUP] += (windup_mean - 2.0f * play->windup) / scale[WINDUP];
        terms[CREEP] += (share > 1.0f ? share - 1.0f : 1.0f - 1.0f / share) / scale[CREEP];
    }
}

/* The offset is what the sensor reads at a = a_0, where no side force acts but for pull and wind: of its variance what
 * the terms make. */
static float variance_of_offset(const oc_hypothesis *h, const oc_hypothesis_design *design,
                                const oc_solving *solving) {
    const float *scale = design->scale, *terms = solving->terms;
    const float unloading = h->play.unloading + terms[UNLOADING] * scale[UNLOADING];
    float weights[OC_TERMS] = {
        [UNLOADING] = design->steering_ratio * terms[GRADIENT] * scale[GRADIENT] * scale[UNLOADING],
        [GRADIENT] = design->steering_ratio * unloading * scale[GRADIENT],
    };
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        weights[k] -= h->means[k];
    }
    return oc_triangle_variance(solving->lower, solving->inverse, 0, weights);
}

static void conclude_offset(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                            const oc_solving *solving) {
    h->constant = h->target_mean;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        h->constant -= h->means[k] * h->terms[k];
    }
    h->offset = h->constant + design->steering_ratio * h->gradient * h->unloading;

    /* pull and wind part a_0 from the accelerometer's bias, which its own prior bounds; in little play the lag of
     * whatever gives way passes for a_0 */
    const float bias = prior->unloading_sd * prior->unloading_sd;
    const float pull = design->pull_sd * design->pull_sd;
    const float little = within_range(1.0f - 2.0f * h->play.half_width / little_width, 0.0f, 1.0f);
    const float parted = h->unloading_variance + pull + little * bias;
    const float beyond = larger((parted < bias ? parted : bias) - h->unloading_variance, 0.0f);
    /* what pull does to a truck that understeers a little at least, whatever bends and play are taken for */
    const float pulled = design->steering_ratio * larger(h->gradient, least_gradient);
    h->pulled_variance = pulled * pulled * (beyond < pull ? beyond : pull);
    h->offset_variance = oc_hypothesis_noise(h) / larger(h->weight, least_weight) +
                         solving->variances[OC_OF_OFFSET] +
                         pulled * pulled * beyond;
}

static void conclude(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                     const oc_solving *solving) {
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        h->terms[k] = solving->terms[k];
    }
    h->gradient = found(h, design, GRADIENT);
    h->gradient_variance = solving->variances[OC_OF_GRADIENT];
    h->unloading = h->play.unloading + found(h, design, UNLOADING);
    h->unloading_variance = solving->variances[OC_OF_UNLOADING];
    h->width_variance = solving->variances[OC_OF_WIDTH];
    h->wheelbase = found(h, design, WHEELBASE);
    h->wheelbase_variance = solving->variances[OC_OF_WHEELBASE];
    conclude_offset(h, design, prior, solving);
}

void oc_hypothesis_restart(oc_hypothesis *h, double angle) {
    h->places.wound = h->places.inner = (float)angle;
    for (int32_t k = 0; k < OC_BESIDE; ++k) {
        h->places.played[k] = h->places.loaded[k] = h->places.unwound[k] = h->places.wound_beside[k] = (float)angle;
    }
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        narrow(h, WIND + k, WIND + k, 0.0f);
        h->terms[WIND + k] = h->play.wind[k] = 0.0f;
    }
}

void oc_hypothesis_start(oc_hypothesis *h, const oc_play *play, double angle) {
    *h = (oc_hypothesis){
        .play = *play,
        .variance = rad_per_deg * rad_per_deg,
        .blocks.factor = 3.0f,
        .long_blocks.factor = 3.0f,
    };
    oc_hypothesis_restart(h, angle);
}

void oc_hypothesis_sample(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_motion_sample *sample,
                          bool begins_second) {
    const oc_play_motion by = {(float)sample->angle, h->offset, oc_play_load(&h->play, sample), design->step_s};
    if (begins_second) {
        h->target_sum = 0.0f;
        for (int32_t k = 0; k < OC_TERMS; ++k) {
            h->sums[k] = 0.0f;
        }
    }
    const float by_unloading = oc_places_move(&h->places, &h->play, &by, &h->sums[CREEP]);
    if (!sample->usable) { /* the second begins anew */
        return;
    }
    add_motion(h->sums, sample);
    const float shifted = by.angle - h->places.inner; /* (B/2) c + (W/2) d, rad */
    const float unloads = by_unloading * design->per_unloading;
    h->target_sum += sample->residual - shifted - add_wind(h, design, sample, unloads);
}

void oc_hypothesis_foretell(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_second *second,
                            int32_t samples) {
    float terms[OC_TERMS], apart[OC_SLOPE_COUNT];
    oc_play_apart(&h->play, apart); /* as far as it was for all samples of the second */
    for (int32_t k = 0; k < OC_SLOPE_COUNT; ++k) {
        h->sums[CREEP + k] /= apart[k];
    }
    const float target = means_of_second(h, design, samples, terms);
    h->error = surprise(h, terms, target);
    h->curvature = h->sums[WHEELBASE] / (float)samples;
    if (second->learns) {
        judge_second(h, second);
    }
}

static void take_second_in(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_second *second,
                           int32_t samples) {
    regress(h, design, second, samples);
    if (second->block_ends) {
        correlate(&h->blocks, h->variance, OC_SECONDS_PER_BLOCK, second->blocks);
    }
    if (second->long_block_ends) {
        correlate(&h->long_blocks, h->variance, OC_SECONDS_PER_LONG_BLOCK, second->long_blocks);
    }
}

static void set_up_equations(const oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                             oc_solving *solving) {
    const float noise = oc_hypothesis_noise(h);
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        solving->terms[k] = h->toward[k] / noise;
    }
    add_priors(h, design, prior, solving->information, solving->terms);
}

static void factor_rows(const oc_hypothesis *h, oc_solving *solving, int32_t first, int32_t end) {
    oc_triangle_factor(h->scatter, solving->information, oc_hypothesis_noise(h), first, end, solving->lower,
                       solving->inverse);
}

/* Noise in what a slope is of flattens it, the more the gentler the bends are: deviations are larger by it than the
 * truck's were (errors in variables). Bends have the yaw rate's, as has the residual, side force the accelerometer's.
 * It is taken out of the factor, whose last rows these terms are: what was gathered stays a sum of squares. Half of
 * what tells the gradient stays in any case. */
static void take_noise_out(const oc_hypothesis *h, const oc_hypothesis_design *design, const oc_second *second,
                           oc_solving *solving) {
    enum { BEND = WHEELBASE * (WHEELBASE + 3) / 2, BOTH = BEND + GRADIENT, FORCE };
    float *lower = solving->lower;
    const float seconds = h->learned_s / oc_hypothesis_noise(h);
    const float force = design->of_sum[GRADIENT];
    const float bend = design->of_sum[WHEELBASE] * h->means[YAW_RATE_BIAS] / design->of_sum[YAW_RATE_BIAS];
    const float acceleration = smoothed * oc_noise_in_mean(&second->noise, OC_NOISE_OF_ACCELERATION);
    const float yaw_rate = oc_noise_in_mean(&second->noise, OC_NOISE_OF_YAW_RATE);

    const float across = lower[BOTH] * lower[BEND];
    const float bends = lower[BEND] * lower[BEND], forces = lower[FORCE] * lower[FORCE];
    const float both = lower[BOTH] * lower[BOTH];
    const float parted = larger(0.5f * (forces - solving->information[GRADIENT]), 0.0f); /* so much stays of forces */
    const float shared = both + parted; /* at most, for which bends need */
    const float needed = shared > 0.0f ? across * across / shared : bends;
    const float most = within_range(design->scale[WHEELBASE] * bends, 0.0f, larger(bends - needed, 0.0f));
    const float of_bend = within_range(seconds * yaw_rate * bend * bend, 0.0f, most); /* moves it by its prior's sd */
    lower[BEND] = sqrtf(bends - of_bend);
    solving->inverse[WHEELBASE] = 1.0f / lower[BEND];
    lower[BOTH] = across * solving->inverse[WHEELBASE];
    const float left = both + forces - lower[BOTH] * lower[BOTH];
    const float spare = larger(left - (forces - parted), 0.0f);
    const float of_force = within_range(seconds * acceleration * force * force, 0.0f, spare);
    lower[FORCE] = sqrtf(left - of_force);
    solving->inverse[GRADIENT] = 1.0f / lower[FORCE];
    solving->terms[WHEELBASE] += of_bend / design->scale[WHEELBASE];
}

/* Variances of parameters that are two terms together, or one: then the second is the same as the first. */
static void solve_equations(const oc_hypothesis *h, const oc_hypothesis_design *design, oc_solving *solving) {
    static const struct {
        int32_t first, second;
    } asked[OC_OF_OFFSET] = {
        [OC_OF_GRADIENT] = {GRADIENT, GRADIENT},
        [OC_OF_UNLOADING] = {UNLOADING, UNLOADING},
        [OC_OF_WIDTH] = {WIDTH, WINDUP},
        [OC_OF_WHEELBASE] = {WHEELBASE, WHEELBASE},
    };
    oc_triangle_solve_upper(solving->lower, solving->inverse, solving->terms);
    for (int32_t k = 0; k < OC_OF_OFFSET; ++k) {
        const int32_t first = asked[k].first, second = asked[k].second;
        float weights[OC_TERMS] = {0};
        weights[first] = design->scale[first];
        weights[second] = design->scale[second];
        solving->variances[k] = oc_triangle_variance(solving->lower, solving->inverse, first, weights);
    }
    solving->variances[OC_OF_OFFSET] = variance_of_offset(h, design, solving);
}

bool oc_hypothesis_learn(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                         const oc_second *second, int32_t samples, oc_solving *solving) {
    static const int32_t few_rows = 9; /* of the factor, so that */
    const bool learns = solving->learns != 0;
    switch (solving->step++) { /* each takes about as long as the others */
    case 0:
        if (learns) {
            take_second_in(h, design, second, samples);
        }
        if (!solving->due) {
            return true;
        }
        set_up_equations(h, design, prior, solving);
        factor_rows(h, solving, 0, few_rows);
        return false;
    case 1:
        factor_rows(h, solving, few_rows, OC_TERMS);
        take_noise_out(h, design, second, solving);
        oc_triangle_solve_lower(solving->lower, solving->inverse, 0, solving->terms);
        return false;
    case 2: solve_equations(h, design, solving); return false;
    default:
        conclude(h, design, prior, solving);
        if (learns) {
            relinearise(h, design);
        }
        return true;
    }
}

void oc_hypothesis_correct(oc_hypothesis *h, const oc_hypothesis_design *design, float rad_s) {
    shift(h, design, YAW_RATE_BIAS, rad_s);
}

void oc_hypothesis_remounted(oc_hypothesis *h, float by, float seconds) {
    h->target_mean += by;
    h->constant += by;
    h->offset += by;
    h->weight = seconds;
}

/* A term is another from now on, by so much (variance, in units of its prior's): what was seen of it counts less, and
 * so does what was seen of the constant where its mean was not zero. */
static void wander(oc_hypothesis *h, int32_t term, float variance) {
    float row[OC_TERMS];
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        row[k] = oc_triangle_cell(h->scatter, term, k);
    }
    const float noise = oc_hypothesis_noise(h);
    const float mean = h->means[term], toward = h->toward[term];
    const float share = variance / (noise + variance * row[term]);
    const float of_constant = h->weight * mean * mean;
    h->weight *= 1.0f - variance * of_constant / (noise + variance * (row[term] + of_constant));
    h->target_mean -= share * mean * toward;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        h->means[k] -= share * mean * row[k];
        h->toward[k] -= share * toward * row[k];
    }
    oc_triangle_subtract_product(h->scatter, row, share);
}

void oc_hypothesis_loaded(oc_hypothesis *h) {
    /* a fifth of the gradient, a twentieth of the wheelbase, in units of the terms */
    wander(h, GRADIENT, 0.04f);
    wander(h, WHEELBASE, 1.0f);
}

#include "hypothesis.h"

#include <math.h>

/* The terms, in this order. */
enum { YAW_ACCELERATION, JERK, WHEELBASE, YAW_RATE_BIAS, WIDTH, UNLOADING, FRICTION, CREEP, WINDUP, UNWINDING,
       WIND, WIND_ACROSS, GRADIENT };

/* Priors. Trucks have 0 to 15 deg of play, most of them little; king-pin friction holds some 0.1 m/s^2 of side force;
 * K_us/g is 4.2's, give or take as much. */
static const float rad_per_deg = 0.017453292f;
static const float width_mean = 4.0f * 0.017453292f;    /* rad */
static const float windup_mean = 1.0f * 0.017453292f;   /* rad */
static const float gradient_mean = 0.4f * 0.017453292f; /* rad/(m/s^2) */
static const float friction_mean = 0.1f;                /* m/s^2 */
static const float creep_mean = 100.0f * 0.017453292f;  /* rad/s per m/s^2 */

/* The most by which a second may move the hypothesis: as far as the model is linear. */
static const float unloading_step = 0.03f;              /* m/s^2 */
static const float friction_step = 0.03f;               /* m/s^2 */
static const float creep_step = 0.3f;                   /* share */
static const float unwinding_step = 0.2f;               /* 1/s */
static const float little_width = 2.0f * 0.017453292f;  /* rad */
static const float newborn_handicap = 16.0f;            /* of cost: two wild seconds do not make it the best */

void oc_hypothesis_setup(oc_hypothesis_design *design, double step_s, double steering_ratio,
                         double ratio_times_wheelbase, double pull_sd) {
    *design = (oc_hypothesis_design){
        .step_s = (float)step_s,
        .steering_ratio = (float)steering_ratio,
        .ratio_times_wheelbase = (float)ratio_times_wheelbase,
        .pull_sd = (float)pull_sd,
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

/* Moves all operators on; the model's slopes go to `terms`. Returns (B/2) c + (W/2) d, rad. */
static float place(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_motion_sample *sample,
                   float *terms) {
    const float angle = (float)sample->angle, centre = h->offset, step_s = design->step_s;
    h->place.wound = oc_place_wound(h->place.wound, &h->play, angle, centre, step_s);
    h->place.inner = oc_place_inner(h->place.inner, &h->play, h->place.wound, oc_play_load(&h->play, sample), step_s);
    const int32_t slopes = oc_play_slopes(&h->play);
    for (int32_t k = 0; k < slopes; ++k) {
        const oc_play more = oc_play_moved(&h->play, (oc_slope)k, 1.0f);
        const oc_play less = oc_play_moved(&h->play, (oc_slope)k, -1.0f);
        oc_place *at_more = &h->more[k], *at_less = &h->less[k];
        at_more->wound = oc_place_wound(at_more->wound, &more, angle, centre, step_s);
        at_less->wound = oc_place_wound(at_less->wound, &less, angle, centre, step_s);
        at_more->inner = oc_place_inner(at_more->inner, &more, at_more->wound, oc_play_load(&more, sample), step_s);
        at_less->inner = oc_place_inner(at_less->inner, &less, at_less->wound, oc_play_load(&less, sample), step_s);
        terms[WIDTH + k] = h->per_difference[k] * (at_less->inner - at_more->inner);
    }
    for (int32_t k = slopes; k < OC_SLOPE_COUNT; ++k) {
        terms[WIDTH + k] = 0.0f;
    }
    return angle - h->place.inner;
}

/* What a wind of 1 m/s^2 would add: it takes side force from the tyres, and unloads the play as a_0 does. Returns what the
 * one believed in adds, rad. */
static float wind_terms(const oc_hypothesis *h, const oc_hypothesis_design *design, const oc_motion_sample *sample,
                        float *terms) {
    const float slope = design->steering_ratio * h->gradient;
    const float unloads = terms[UNLOADING] / design->scale[UNLOADING];
    float blown = 0.0f;
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        terms[WIND + k] = design->scale[WIND + k] * (unloads - slope) * sample->wind[k];
        blown -= slope * h->play.wind[k] * sample->wind[k];
    }
    return blown;
}

static void motion_terms(const oc_hypothesis_design *design, const oc_motion_sample *sample, float *terms) {
    const float *scale = design->scale;
    terms[GRADIENT] = scale[GRADIENT] * design->steering_ratio * sample->lateral_acceleration;
    terms[YAW_ACCELERATION] = scale[YAW_ACCELERATION] * sample->yaw_acceleration;
    terms[JERK] = scale[JERK] * sample->jerk;
    terms[WHEELBASE] = scale[WHEELBASE] * design->ratio_times_wheelbase * sample->curvature;
    terms[YAW_RATE_BIAS] = -scale[YAW_RATE_BIAS] * design->ratio_times_wheelbase / larger(sample->speed, 1.0f);
}

/* What a second showed that was not foretold, rad. */
static float surprise(const oc_hypothesis *h, const float *terms, float target) {
    float error = target - h->constant;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        error -= terms[k] * h->terms[k];
    }
    return error;
}

/* Recursive least squares about the means; what is far off counts by its sign only (Huber). Deviations and not plain
 * products: a term that hardly varies could not be told from the constant in single precision. */
static void regress(oc_hypothesis *h, const oc_second *second, const float *terms, float target) {
    const float squared = h->error * h->error;
    const float limit = 4.0f * h->variance;
    const float weight = squared > limit ? sqrtf(limit / squared) : 1.0f;

    const float keep = second->memory_share;
    const float quick = larger(1.0f / (2.0f + h->age / second->second_s), 0.02f);
    h->variance += (within_range(squared, 0.0f, 9.0f * h->variance) - h->variance) * quick;
    h->blocks.sum += weight * h->error;
    h->long_blocks.sum += weight * h->error;
    h->age += second->second_s;
    if (h->age <= second->trial_s && second->used_s > second->trial_s) {
        h->cost = keep * second->best_cost + newborn_handicap;
    } else {
        h->cost = keep * h->cost + 0.5f * within_range(squared / second->reference, 0.0f, 16.0f);
    }

    float apart[OC_TERMS];
    h->weight = keep * h->weight + weight;
    const float share = weight / h->weight;
    const float target_apart = target - h->target_mean;
    h->target_mean += share * target_apart;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        apart[k] = terms[k] - h->means[k];
        h->means[k] += share * apart[k];
    }
    const float added = weight * (1.0f - share);
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

float oc_hypothesis_noise(const oc_hypothesis *h) {
    return h->variance * larger(larger(h->blocks.factor, h->long_blocks.factor), 1.0f);
}

/* A parameter of the play was moved by that much: what is left to be found is less by it. */
static void shift(oc_hypothesis *h, const oc_hypothesis_design *design, int32_t term, float by) {
    const float scaled = by / design->scale[term];
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        h->toward[k] -= oc_triangle_cell(h->scatter, k, term) * scaled;
    }
    h->target_mean -= h->means[term] * scaled;
    h->terms[term] -= scaled;
}

static float found(const oc_hypothesis *h, const oc_hypothesis_design *design, int32_t term) {
    return h->terms[term] * design->scale[term];
}

/* All that was gathered of a term as if it had shown only by that share. */
static void fade(oc_hypothesis *h, int32_t term, float share) {
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        float *cell = k <= term ? &h->scatter[term * (term + 1) / 2 + k] : &h->scatter[k * (k + 1) / 2 + term];
        *cell *= k == term ? share * share : share;
    }
    h->toward[term] *= share;
}

/* What is found stays so, whatever became of the evidence. */
static void keep_found(oc_hypothesis *h) {
    for (int32_t row = 0; row < OC_TERMS; ++row) {
        h->toward[row] = 0.0f;
        for (int32_t column = 0; column < OC_TERMS; ++column) {
            h->toward[row] += oc_triangle_cell(h->scatter, row, column) * h->terms[column];
        }
    }
}

/* Where a parameter goes that is to be moved by so much, a step at most. */
static float stepped(float value, float by, float step, float low, float high) {
    return within_range(value + within_range(by, -step, step), low, high);
}

/* What turns differences of operators into slopes, wherever the play is now. */
static void measure(oc_hypothesis *h, const oc_hypothesis_design *design) {
    const int32_t slopes = oc_play_slopes(&h->play);
    for (int32_t k = 0; k < slopes; ++k) {
        const oc_play more = oc_play_moved(&h->play, (oc_slope)k, 1.0f);
        const oc_play less = oc_play_moved(&h->play, (oc_slope)k, -1.0f);
        h->per_difference[k] = design->scale[WIDTH + k] / oc_play_between(&more, &less, (oc_slope)k);
    }
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
        narrow(h, UNLOADING, CREEP, play->half_width / before.half_width);
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
static void add_priors(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                       float *information) {
    const float *scale = design->scale;
    const oc_play *play = &h->play;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        information[k] = 1.0f;
    }
    const float unloading = scale[UNLOADING] / prior->unloading_sd;
    const float bias = scale[YAW_RATE_BIAS] / prior->yaw_rate_bias_sd;
    information[UNLOADING] = unloading * unloading;
    information[YAW_RATE_BIAS] = bias * bias;
    h->terms[UNLOADING] += information[UNLOADING] * (prior->unloading_mean - play->unloading) / scale[UNLOADING];
    h->terms[GRADIENT] += gradient_mean / scale[GRADIENT];
    h->terms[WIDTH] += (width_mean - 2.0f * play->half_width) / scale[WIDTH];
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        h->terms[WIND + k] -= play->wind[k] / scale[WIND + k];
    }
    if (creeps(play)) {
        const float share = creep_mean / play->creep;
        h->terms[FRICTION] += (friction_mean - play->friction) / scale[FRICTION];
        h->terms[UNWINDING] -= play->unwinding / scale[UNWINDING];
        h->terms[WINDUP] += (windup_mean - 2.0f * play->windup) / scale[WINDUP];
        h->terms[CREEP] += (share > 1.0f ? share - 1.0f : 1.0f - 1.0f / share) / scale[CREEP];
    }
}

/* The offset is what the sensor reads at a = a_0, where no side force acts but for pull and wind. */
static void conclude(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior, const float *lower,
                     float noise) {
    const float *scale = design->scale;
    const float slope = design->steering_ratio * found(h, design, GRADIENT);
    const float a_0 = h->play.unloading + found(h, design, UNLOADING);
    float of_unloading[OC_TERMS] = {[UNLOADING] = scale[UNLOADING]};
    float of_gradient[OC_TERMS] = {[GRADIENT] = scale[GRADIENT]};
    float of_width[OC_TERMS] = {[WIDTH] = scale[WIDTH], [WINDUP] = scale[WINDUP]};
    float of_wheelbase[OC_TERMS] = {[WHEELBASE] = scale[WHEELBASE]};
    float of_offset[OC_TERMS] = {
        [UNLOADING] = slope * scale[UNLOADING],
        [GRADIENT] = scale[GRADIENT] * design->steering_ratio * a_0,
    };
    h->constant = h->target_mean;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        h->constant -= h->means[k] * h->terms[k];
        of_offset[k] -= h->means[k];
    }
    h->offset = h->constant + slope * a_0;
    h->gradient = found(h, design, GRADIENT);
    h->unloading = a_0;
    h->unloading_variance = oc_triangle_variance(lower, UNLOADING, of_unloading);
    h->gradient_variance = oc_triangle_variance(lower, GRADIENT, of_gradient);
    h->width_variance = oc_triangle_variance(lower, WIDTH, of_width);
    h->wheelbase = found(h, design, WHEELBASE);
    h->wheelbase_variance = oc_triangle_variance(lower, WHEELBASE, of_wheelbase);

    /* pull and wind part a_0 from the accelerometer's bias, which its own prior bounds; in little play the lag of whatever
     * gives way passes for a_0 */
    const float bias = prior->unloading_sd * prior->unloading_sd;
    const float little = within_range(1.0f - 2.0f * h->play.half_width / little_width, 0.0f, 1.0f);
    const float parted = h->unloading_variance + design->pull_sd * design->pull_sd + little * bias;
    const float beyond = larger((parted < bias ? parted : bias) - h->unloading_variance, 0.0f);
    h->offset_variance = noise / larger(h->weight, 1.0f) + oc_triangle_variance(lower, 0, of_offset) + slope * slope * beyond;
}

static void solve(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior) {
    float information[OC_TERMS], lower[OC_TERMS_TRIANGLE];
    const float noise = oc_hypothesis_noise(h);
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        h->terms[k] = h->toward[k] / noise;
    }
    add_priors(h, design, prior, information);
    oc_triangle_factor(h->scatter, information, noise, lower);
    oc_triangle_solve_lower(lower, 0, h->terms);
    oc_triangle_solve_upper(lower, h->terms);
    conclude(h, design, prior, lower, noise);
}

void oc_hypothesis_restart(oc_hypothesis *h, double angle) {
    const oc_place there = {(float)angle, (float)angle};
    h->place = there;
    for (int32_t k = 0; k < OC_SLOPE_COUNT; ++k) {
        h->more[k] = h->less[k] = there;
    }
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        narrow(h, WIND + k, WIND + k, 0.0f);
        h->terms[WIND + k] = h->play.wind[k] = 0.0f;
    }
}

void oc_hypothesis_start(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_play *play, double angle) {
    *h = (oc_hypothesis){
        .play = *play,
        .variance = rad_per_deg * rad_per_deg,
        .blocks.factor = 3.0f,
        .long_blocks.factor = 3.0f,
    };
    measure(h, design);
    oc_hypothesis_restart(h, angle);
}

void oc_hypothesis_sample(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_motion_sample *sample,
                          bool begins_second) {
    float terms[OC_TERMS];
    const float shifted = place(h, design, sample, terms);
    if (begins_second) {
        h->target_sum = 0.0f;
        for (int32_t k = 0; k < OC_TERMS; ++k) {
            h->sums[k] = 0.0f;
        }
    }
    if (!sample->usable) {
        return;
    }
    motion_terms(design, sample, terms);
    const float blown = wind_terms(h, design, sample, terms);
    h->target_sum += sample->residual - shifted - blown;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        h->sums[k] += terms[k];
    }
}

void oc_hypothesis_second(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior,
                          const oc_second *second, int32_t samples) {
    /* a second's means have less of the sensors' noise, which flattens slopes, than its samples */
    float terms[OC_TERMS];
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        terms[k] = h->sums[k] / (float)samples;
    }
    const float target = h->target_sum / (float)samples;
    h->error = surprise(h, terms, target);
    h->curvature = terms[WHEELBASE] / (design->scale[WHEELBASE] * design->ratio_times_wheelbase);
    if (!second->learns) {
        return;
    }
    regress(h, second, terms, target);
    if (second->block_ends) {
        correlate(&h->blocks, h->variance, OC_SECONDS_PER_BLOCK, second->blocks);
    }
    if (second->long_block_ends) {
        correlate(&h->long_blocks, h->variance, OC_SECONDS_PER_LONG_BLOCK, second->long_blocks);
    }
    solve(h, design, prior);
    relinearise(h, design);
    measure(h, design);
}

void oc_hypothesis_correct(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_prior *prior, float rad_s) {
    shift(h, design, YAW_RATE_BIAS, rad_s);
    solve(h, design, prior);
}

void oc_hypothesis_remounted(oc_hypothesis *h, float by, float seconds) {
    h->target_mean += by;
    h->constant += by;
    h->offset += by;
    h->weight = seconds;
}

void oc_hypothesis_loaded(oc_hypothesis *h) {
    static const float share = 0.1f;
    fade(h, GRADIENT, share);
    fade(h, WHEELBASE, share);
    keep_found(h);
}

#include <math.h>
#include <string.h>

#include "between_drives.h"
#include "bounds.h"
#include "hypothesis.h"
#include "joint_model.h"

/* Derived. */
static const float variance_min = 7.6e-7f;     /* rad^2, (0.05 deg)^2: model error, limit of single precision */
static const float probation_cost = 2.0f * OC_SECOND_COST_MAX; /* two outliers do not decide */

/* Tuned, in tuned.toml: hypothesis */
static const float walk_sd = 0.8f * 0.017453292f; /* rad: random walk of an offset that walks, in a minute */
/* end */

void oc_hypothesis_setup(oc_hypothesis_design *design, double step_s, double steering_ratio,
                         double ratio_times_wheelbase, float pull_sd) {
    float divisors[OC_SLOPE_COUNT];
    oc_play_divisors(&(oc_play){0}, divisors);
    *design = (oc_hypothesis_design){
        .step_s = (float)step_s,
        .steering_ratio = (float)steering_ratio,
        .ratio_times_wheelbase = (float)ratio_times_wheelbase,
        .per_unloading = 1.0f / divisors[OC_SLOPE_UNLOADING],
        .pull_sd = pull_sd,
    };
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        design->scale[k] = design->of_sum[k] = oc_joint_priors()[k].sd;
    }
    const oc_term_prior *gradient = &oc_joint_priors()[GRADIENT];
    design->known = (oc_known_truck){
        .width_sd = oc_joint_priors()[WIDTH].sd,
        .wheelbase = {1.0f, 0.0f},
        .gradient = {1.0f, gradient->mean / gradient->sd},
    };
    /* terms.toml: weights */
    design->of_sum[UNEVEN] *= design->ratio_times_wheelbase;
    design->of_sum[YAW_RATE_BIAS] *= -design->ratio_times_wheelbase;
    design->of_sum[WHEELBASE] *= design->ratio_times_wheelbase;
    design->of_sum[GRADIENT] *= design->steering_ratio;
    /* end */
}

/* Adds the wind's regressors: a wind reduces the tyres' lateral force and shifts the play's load, as a_0 does. Returns
 * the contribution of the estimated wind, rad. */
static float add_wind(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_motion_sample *sample,
                      float unloading_slope) {
    const float slope = design->steering_ratio * h->gradient;
    float by_wind = 0.0f;
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        h->sums[WIND + k] += (unloading_slope - slope) * sample->wind[k];
        by_wind -= slope * h->play.wind[k] * sample->wind[k];
    }
    return by_wind;
}

static void add_motion(float *sums, const oc_motion_sample *sample) {
    /* terms.toml: sums */
    sums[YAW_ACCELERATION] += sample->yaw_acceleration;
    sums[JERK] += sample->jerk;
    sums[FIFTH_WHEEL] += sample->fifth_wheel;
    sums[UNEVEN] += fabsf(sample->curvature);
    sums[YAW_RATE_BIAS] += sample->per_speed;
    sums[WHEELBASE] += sample->curvature;
    sums[GRADIENT] += sample->lateral_acceleration;
    /* end */
}

/* rad */
static float prediction_error(const oc_hypothesis *h, const float *terms, float target) {
    float error = target - h->constant;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        error -= terms[k] * h->terms[k];
    }
    return error;
}

/* Updates noise, cost and age by the prediction error. An error beyond 2 sd has a reduced weight (Huber). */
static void score_second(oc_hypothesis *h, const oc_second *second) {
    const float squared = second->weight * h->error * h->error;
    const float limit = 4.0f * h->variance;
    h->huber_weight = squared > limit ? second->weight * sqrtf(limit / squared) : second->weight;

    const float keep = second->memory_share;
    const float quick = oc_max(1.0f / (2.0f + h->age / second->second_s), 0.02f);
    const float varied = h->variance + (oc_clamp(squared, 0.0f, 9.0f * h->variance) - h->variance) * quick;
    h->variance = oc_max(varied, variance_min);
    h->blocks.sum += h->huber_weight * h->error;
    h->long_blocks.sum += h->huber_weight * h->error;
    h->age += second->second_s;
    if (oc_hypothesis_is_on_probation(h, second)) {
        h->cost = keep * second->best_cost + probation_cost;
    } else {
        h->cost = keep * h->cost + 0.5f * oc_clamp(squared / second->reference, 0.0f, 2.0f * OC_SECOND_COST_MAX);
    }
}

/* Means of a second have less noise than samples: noise in the regressors flattens the slopes. */
static float means_of_second(const oc_hypothesis *h, const oc_hypothesis_design *design, int32_t samples,
                             float *terms) {
    const float share = 1.0f / (float)samples;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        terms[k] = design->of_sum[k] * share * h->sums[k];
    }
    return h->target_sum * share;
}

/* Recursive least squares about the means. In single precision, plain products would lose a term that hardly varies
 * beside the constant. */
static void regress(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_second *second, int32_t samples) {
    float deviations[OC_TERMS];
    const float keep = second->memory_share;
    const float target = means_of_second(h, design, samples, deviations);
    h->weight = keep * h->weight + h->huber_weight;
    h->learned_s = keep * h->learned_s + h->huber_weight;
    const float share = h->huber_weight / h->weight;
    const float target_deviation = target - h->target_mean;
    h->target_mean += share * target_deviation;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        deviations[k] -= h->means[k];
        h->means[k] += share * deviations[k];
    }
    const float added = h->huber_weight * (1.0f - share);
    float *cell = h->scatter;
    for (int32_t row = 0; row < OC_TERMS; ++row) {
        const float weighted = added * deviations[row];
        h->target_products[row] = keep * h->target_products[row] + weighted * target_deviation;
        for (int32_t column = 0; column <= row; ++column, ++cell) {
            *cell = keep * *cell + weighted * deviations[column];
        }
    }
}

static void correlate(oc_correlation *correlation, float variance, int32_t seconds, int32_t blocks) {
    const float ratio = oc_clamp(correlation->sum * correlation->sum / ((float)seconds * variance), 0.0f, 60.0f);
    correlation->factor += (ratio - correlation->factor) * oc_max(1.0f / (5.0f + (float)blocks), 0.01f);
    correlation->sum = 0.0f;
}

bool oc_hypothesis_is_on_probation(const oc_hypothesis *h, const oc_second *second) {
    return h->age <= second->probation_s && second->used_s > second->probation_s;
}

bool oc_hypothesis_counts(const oc_hypothesis *h, const oc_second *second) {
    return (h->walks == 0 || h->walks == OC_WALK_PROVED) && !oc_hypothesis_is_on_probation(h, second);
}

float oc_hypothesis_noise(const oc_hypothesis *h) {
    return h->variance * oc_max(oc_max(h->blocks.factor, h->long_blocks.factor), 1.0f);
}

void oc_hypothesis_shift(oc_hypothesis *h, const oc_hypothesis_design *design, int32_t term, float by) {
    const float scaled = by / design->scale[term];
    oc_triangle_subtract_row(h->scatter, term, scaled, h->target_products);
    h->target_mean -= h->means[term] * scaled;
    h->terms[term] -= scaled;
}

/* Scales a term's regressor in all evidence. */
static void scale_term(oc_hypothesis *h, int32_t term, float share) {
    oc_triangle_scale(h->scatter, term, share);
    h->target_products[term] *= share;
}

void oc_hypothesis_scale_slopes(oc_hypothesis *h, int32_t first, int32_t last, float share) {
    for (int32_t term = first; term <= last; ++term) {
        scale_term(h, term, share);
        h->means[term] *= share;
    }
}

void oc_hypothesis_restart(oc_hypothesis *h, double angle) {
    h->places.wound = h->places.inner = (float)angle;
    for (int32_t k = 0; k < OC_VARIED; ++k) {
        h->places.played[k] = h->places.loaded[k] = h->places.unwound[k] = h->places.wound_varied[k] = (float)angle;
    }
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        oc_hypothesis_scale_slopes(h, WIND + k, WIND + k, 0.0f);
        h->terms[WIND + k] = h->play.wind[k] = 0.0f;
    }
}

void oc_hypothesis_start(oc_hypothesis *h, const oc_play *play, double angle) {
    memset(h, 0, sizeof *h); /* not a struct, which takes a kilobyte of stack at -O0 */
    h->play = *play;
    h->width_mean = 2.0f * play->half_width;
    h->variance = 0.017453292f * 0.017453292f; /* (1 deg)^2 */
    h->blocks.factor = 3.0f;
    h->long_blocks.factor = 3.0f;
    oc_hypothesis_restart(h, angle);
}

oc_play_motion oc_hypothesis_motion(const oc_hypothesis *h, const oc_hypothesis_design *design,
                                    const oc_motion_sample *sample) {
    const float centre = h->offset + sample->rear_part;
    return (oc_play_motion){sample->angle, centre, oc_play_load(&h->play, sample), design->step_s};
}

void oc_hypothesis_sample(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_motion_sample *sample) {
    const oc_play_motion by = oc_hypothesis_motion(h, design, sample);
    if (sample->in_second == 0) {
        h->target_sum = 0.0f;
        for (int32_t k = 0; k < OC_TERMS; ++k) {
            h->sums[k] = 0.0f;
        }
    }
    const float by_unloading = oc_places_move(&h->places, &h->play, &by, &h->sums[CREEP]);
    if (sample->in_second < 0) {
        return;
    }
    add_motion(h->sums, sample);
    const float shifted = by.angle - h->places.inner; /* (B/2) c + (W/2) d, rad */
    const float unloading_slope = by_unloading * design->per_unloading;
    h->target_sum += sample->residual - shifted - add_wind(h, design, sample, unloading_slope);
}

void oc_hypothesis_predict(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_second *second,
                           int32_t samples) {
    float terms[OC_TERMS], divisors[OC_SLOPE_COUNT];
    oc_play_divisors(&h->play, divisors); /* constant within a second */
    for (int32_t k = 0; k < OC_SLOPE_COUNT; ++k) {
        h->sums[CREEP + k] /= divisors[k];
    }
    const float target = means_of_second(h, design, samples, terms);
    h->error = prediction_error(h, terms, target);
    if (second->learns) {
        score_second(h, second);
    }
}

/* Prediction step of a Kalman filter: the term's variance grows by `variance`, in units of its prior's. The constant
 * changes with it by `by_constant` per unit (docs/method.md, "Steps of time"). */
static void add_process_noise(oc_hypothesis *h, int32_t term, float by_constant, float variance) {
    float row[OC_TERMS] = {0}; /* stays 0 where rounding has left no variance */
    for (int32_t k = 0; k < OC_TERMS && oc_triangle_cell(h->scatter, term, term) > 0.0f; ++k) {
        row[k] = oc_triangle_cell(h->scatter, term, k);
    }
    const float noise = oc_hypothesis_noise(h);
    const float at_mean = h->means[term] + by_constant;
    const float target_product = row[term] > 0.0f ? h->target_products[term] : 0.0f;
    const float own = row[term];
    const float share = variance / (noise + variance * own);
    const float of_constant = h->weight * at_mean * at_mean;
    h->weight *= 1.0f - variance * of_constant / (noise + variance * (own + of_constant));
    h->target_mean -= share * at_mean * target_product;
    for (int32_t k = 0; k < OC_TERMS; ++k) {
        h->means[k] -= share * at_mean * row[k];
        h->target_products[k] -= share * target_product * row[k];
    }
    oc_triangle_subtract_product(h->scatter, row, share);
}

/* The same of the constant, by `variance`, rad^2. */
static void add_noise_to_constant(oc_hypothesis *h, float variance) {
    const float noise = oc_hypothesis_noise(h);
    h->weight *= noise / (noise + h->weight * variance);
}

/* Random walk of the accelerometer's zero: of a_0, and of the constant by -i K times that. */
static void wander(oc_hypothesis *h, const oc_hypothesis_design *design) {
    const float scale = design->scale[UNLOADING];
    const float by_constant = -design->steering_ratio * oc_max(h->gradient, 0.0f) * scale;
    add_process_noise(h, UNLOADING, by_constant, design->wander / (scale * scale));
}

void oc_hypothesis_take_in(oc_hypothesis *h, const oc_hypothesis_design *design, const oc_second *second,
                           int32_t samples) {
    if (h->wanders) {
        wander(h, design);
    }
    if (h->walks) {
        add_noise_to_constant(h, walk_sd * walk_sd * second->second_s / 60.0f);
    }
    regress(h, design, second, samples);
    if (second->block_ends) {
        correlate(&h->blocks, h->variance, OC_SECONDS_PER_BLOCK, second->blocks);
    }
    if (second->long_block_ends) {
        correlate(&h->long_blocks, h->variance, OC_SECONDS_PER_LONG_BLOCK, second->long_blocks);
    }
}

/* Adds `share` of the yaw rate bias's regressor to l's in all evidence: the curvature in it had that bias. */
static void correct_curvature(oc_hypothesis *h, float share) {
    const float product = oc_triangle_cell(h->scatter, WHEELBASE, YAW_RATE_BIAS);
    const float square = oc_triangle_cell(h->scatter, YAW_RATE_BIAS, YAW_RATE_BIAS);
    float *row = &h->scatter[WHEELBASE * (WHEELBASE + 1) / 2];
    for (int32_t k = 0; k < WHEELBASE; ++k) {
        row[k] += share * oc_triangle_cell(h->scatter, YAW_RATE_BIAS, k);
    }
    row[WHEELBASE] += share * (2.0f * product + share * square);
    const float with_gradient = oc_triangle_cell(h->scatter, GRADIENT, YAW_RATE_BIAS);
    h->scatter[GRADIENT * (GRADIENT + 1) / 2 + WHEELBASE] += share * with_gradient;
    h->target_products[WHEELBASE] += share * h->target_products[YAW_RATE_BIAS];
    h->means[WHEELBASE] += share * h->means[YAW_RATE_BIAS];
}

void oc_hypothesis_correct(oc_hypothesis *h, const oc_hypothesis_design *design, float rad_s) {
    oc_hypothesis_shift(h, design, YAW_RATE_BIAS, rad_s);
    if (design->known.product_doubt > 0.0f) { /* else l is near 0, and so is the effect */
        correct_curvature(h, rad_s * design->scale[WHEELBASE] / design->scale[YAW_RATE_BIAS]);
    }
}

void oc_hypothesis_shift_offset(oc_hypothesis *h, float by, float seconds) {
    h->target_mean += by;
    h->constant += by;
    h->offset += by;
    h->weight = seconds;
}

/* rad or m/s^2 in units of a term's prior, as a variance */
static float in_units(const oc_hypothesis_design *design, int32_t term, float variance) {
    return variance / (design->scale[term] * design->scale[term]);
}

void oc_hypothesis_change_between_drives(oc_hypothesis *h, const oc_hypothesis_design *design, float off_s) {
    const float per_unloading = -design->steering_ratio * oc_max(h->gradient, 0.0f) * design->scale[UNLOADING];
    const float unloading = oc_variance_between_drives(OC_BETWEEN_ACCELEROMETER_ZERO, off_s) +
                            oc_variance_between_drives(OC_BETWEEN_PULL, off_s);
    add_process_noise(h, UNLOADING, per_unloading, in_units(design, UNLOADING, unloading));
    const float play = oc_variance_between_drives(OC_BETWEEN_PLAY, off_s);
    add_process_noise(h, WIDTH, 0.0f, in_units(design, WIDTH, play));
    /* another load shows in bends (change.c): until then K and l are those of the last one */
    add_noise_to_constant(h, oc_variance_between_drives(OC_BETWEEN_OFFSET, off_s));
}

void oc_hypothesis_change_play(oc_hypothesis *h, const oc_play *to) {
    static const float any = 1e6f; /* in units of the terms: no evidence of the widths stays */
    add_process_noise(h, WIDTH, 0.0f, any);
    add_process_noise(h, WINDUP, 0.0f, any);
    if (2.0f * h->play.half_width < oc_joint_little_play()) { /* in which creep and friction are not identifiable */
        oc_hypothesis_scale_slopes(h, CREEP, FRICTION, 0.0f);
        h->play.friction = to->friction;
        h->play.creep = to->creep;
        h->play.windup = to->windup;
        h->play.unwinding = to->unwinding;
    }
    h->play.half_width = to->half_width;
    h->width_mean = 2.0f * to->half_width;
}

void oc_hypothesis_change_load(oc_hypothesis *h) {
    /* in units of the terms: 0.08 deg/(m/s^2) and 5 % (docs/method.md, "Change") */
    add_process_noise(h, GRADIENT, 0.0f, 0.04f);
    add_process_noise(h, WHEELBASE, 0.0f, 1.0f);
}

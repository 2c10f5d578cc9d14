#ifndef OC_HYPOTHESIS_H
#define OC_HYPOTHESIS_H
/* One hypothesis: a free play of the steering, and all parameters estimated with it by least squares (docs/method.md,
 * "The joint method").
 *
 * docs/method.md, "Model", has the equation of the measured angle less i*L*r/v. Operators (play.h) give the place c in
 * the play of width B and the place d in the column's wind-up of width W. Twelve more operators run at slightly larger
 * and smaller parameters. Their differences are the model's slopes. Recursive least squares are linearised anew each
 * second.
 *
 * Single precision, so that the whole hypothesis set fits a microcontroller. */

#include <stdbool.h>
#include <stdint.h>

#include "play.h"
#include "sensor_noise.h"
#include "triangle.h"

enum { OC_SECOND_COST_MAX = 8 }; /* of a second: one that is 4 standard deviations or more from its prediction */

/* Priors from params, standstill and other filters. */
typedef struct {
    float unloading_mean;   /* m/s^2, of a_0: accelerometer bias plus a given pull */
    float unloading_sd;     /* m/s^2 */
    float zero_information; /* 1/(m/s^2)^2, of a_0 about 0, by a torque sensor's zero; 0: none */
    float crown;            /* m/s^2, for which an axle may be set up; its size where the side of traffic is unknown */
    float bank;             /* m/s^2, mean of a_y - r v on straights */
    float removed;          /* m/s^2, the same less that in superelevated bends, which removes some of the crown */
    float removed_information; /* 1/(m/s^2)^2; 0: no such bends */
    float bank_sd;          /* m/s^2, sd of the crown in `bank`; 0: the side is known */
    float yaw_rate_bias_sd; /* rad/s, of the yaw rate bias that was corrected */
} oc_prior;

/* A term's prior in the normal equations: information, and information times mean, in units of the term's scale. */
typedef struct {
    float information, right_side;
} oc_term_information;

/* Given values of the truck; without them the model's priors. */
typedef struct {
    float play, play_accuracy; /* rad, width of play plus wind-up; 1/rad, 1 over its sd, 0: not given */
    float width_sd;            /* rad, of the width while only one flank was loaded */
    float pull;                /* m/s^2, mean */
    float pull_tail;           /* probability of a wide pull or wind; 0: the pull is given */
    float set_up_probability;  /* of an axle set up for the crown, or of another one than given; 0: the pull is given */
    float set_up_sign;         /* of the crown by which that axle's a_0 differs */
    float product_doubt;       /* share, 2 sd, by which i L may differ from the vehicle's; 0: a vehicle file's error */
    oc_term_information wheelbase, gradient;
} oc_known_truck;

typedef struct {
    float step_s;                                 /* between samples */
    float steering_ratio, ratio_times_wheelbase;  /* 1, m */
    float scale[OC_TERMS];                        /* unit of each term: its prior's standard deviation */
    float of_sum[OC_TERMS];                       /* regressor per unit of a second's sum */
    float per_unloading;                          /* s^2/m, a_0's slope per difference of its operators */
    float pull_sd;                                /* m/s^2, of wheel alignment and mean wind */
    float wander;                                 /* (m/s^2)^2, variance of a_0's random change in a second */
    float prior_discount_max;                     /* maximum divisor of a_0's prior information */
    oc_known_truck known;
} oc_hypothesis_design;

/* Variance of a block's summed errors over that of independent seconds. */
typedef struct {
    float sum;    /* rad, over the growing block */
    float factor;
} oc_correlation;

/* The estimated quantities. */
enum { OC_OF_GRADIENT, OC_OF_UNLOADING, OC_OF_WIDTH, OC_OF_WHEELBASE, OC_OF_OFFSET, OC_OF_COUNT };

typedef struct {
    float of[OC_OF_COUNT];
} oc_variances;

enum { OC_WALK_SETTLED = 4, OC_WALK_PROVED };

typedef struct {
    oc_play play;
    oc_places places;
    float sums[OC_TERMS], target_sum;    /* over the growing second: of the operators' differences (slopes once the
                                          * second is predicted) and of motion; rad */
    float learned_s;                     /* s of evidence after forgetting */
    float weight;                        /* s of it that identify the constant; the next four members are over these */
    float target_mean;                   /* rad */
    float means[OC_TERMS];
    float scatter[OC_TERMS_TRIANGLE];    /* sums of products of deviations from the means */
    float target_products[OC_TERMS];     /* the same, of terms and target */
    float constant;                      /* rad, of the model */
    float terms[OC_TERMS];               /* the solution, in units of `scale` */
    float variance;                      /* rad^2, of the prediction errors */
    oc_correlation blocks, long_blocks;
    float width_mean;                    /* rad, prior mean of the play's width: the start's */
    float huber_weight;                  /* of the last second, 1 at most */
    float error;                         /* rad, prediction error of the last second */
    float cost;                          /* negative log likelihood after forgetting; from the end of probation on */
    float prior_cost;                    /* cost in addition: of a_0 far from its prior mean */
    float offset;                        /* rad */
    float lean;                          /* rad, middle of the offset's interval less the offset: pull's share in a_0 */
    float set_up_lean;                   /* rad, part of it by an axle set up for the crown */
    float per_acceleration;              /* rad/(m/s^2), offset per pull: i K as far as a_0 is identified */
    float gradient;                      /* rad/(m/s^2) */
    float wheelbase;                     /* l, share */
    float unloading;                     /* m/s^2, a_0 */
    float age;                           /* s of driving in its evidence */
    float began;                         /* rad, the offset where its walk began */
    float left_before, right_before;     /* s on either flank before its start */
    float offset_covariance[OC_OF_OFFSET]; /* covariances of the offset with the others */
    float set_up_variance;               /* rad^2, of the offset, in addition: by an axle set up for the crown */
    float pull_variance;                 /* rad^2, of the offset, in addition: by pull and wind */
    oc_variances variances;              /* squares of the units above, and of the width's, rad */
    int32_t wanders;                     /* 1: models the accelerometer's zero, and so a_0, as a random walk */
    int32_t walks;                       /* not 0: models the offset as a random walk: a sensor that slips; long blocks
                                          * since it began, up to OC_WALK_SETTLED, or OC_WALK_PROVED */
} oc_hypothesis;

/* A second's context, the same for all hypotheses. The noise keeps changing while equations are solved. */
typedef struct {
    int32_t learns;     /* 0: a change is suspected: the second is predicted, not learned from */
    int32_t block_ends, long_block_ends;
    int32_t blocks, long_blocks; /* complete blocks before it */
    oc_noise noise;     /* of the sensors, in a second's mean */
    float used_s;       /* of driving before it */
    float probation_s;  /* until this age a hypothesis is on probation: it learns, but is not in the answer */
    float best_cost;    /* minimum over the hypotheses */
    float second_s;     /* its length */
    float memory_share; /* factor of the evidence before it */
    float reference;    /* rad^2, the best hypothesis's noise, the unit of costs */
    float weight;       /* of this second, 1 at most: the model is less accurate in tight bends and at low speed */
} oc_second;

/* The equations of one hypothesis. */
typedef struct {
    float information[OC_TERMS];    /* of the priors */
    float inverse[OC_TERMS];        /* 1 over the factor's diagonal */
    float lower[OC_TERMS_TRIANGLE]; /* the normal equations, then Cholesky's factor */
    float terms[OC_TERMS];          /* right side, then solution */
    float weights[OC_OF_COUNT][OC_TERMS]; /* of each quantity as a sum of terms; here to save stack */
} oc_equations;

enum { OC_SECONDS_PER_BLOCK = 5, OC_SECONDS_PER_LONG_BLOCK = 40 };

void oc_hypothesis_setup(oc_hypothesis_design *design, double step_s, double steering_ratio,
                         double ratio_times_wheelbase, float pull_sd);

void oc_hypothesis_start(oc_hypothesis *hypothesis, const oc_play *play, double angle);

/* Place in the play and heading are unknown: operators and wind start anew, all other evidence stays. */
void oc_hypothesis_restart(oc_hypothesis *hypothesis, double angle);

/* The operators' input at a sample. */
oc_play_motion oc_hypothesis_motion(const oc_hypothesis *hypothesis, const oc_hypothesis_design *design,
                                    const oc_motion_sample *sample);

/* Advances all operators and adds a usable sample to the growing second. */
void oc_hypothesis_sample(oc_hypothesis *hypothesis, const oc_hypothesis_design *design,
                          const oc_motion_sample *sample);

/* The prediction error of a whole second; `samples`: their number in it. */
void oc_hypothesis_predict(oc_hypothesis *hypothesis, const oc_hypothesis_design *design, const oc_second *second,
                           int32_t samples);

/* Adds the predicted second to the evidence. */
void oc_hypothesis_take_in(oc_hypothesis *hypothesis, const oc_hypothesis_design *design, const oc_second *second,
                           int32_t samples);

/* Solves the normal equations. */
void oc_hypothesis_solve(oc_hypothesis *hypothesis, const oc_hypothesis_design *design, const oc_prior *prior,
                         const oc_second *second, oc_equations *equations);

/* Moves the linearisation point toward the solution by limited steps; the evidence moves along. */
void oc_hypothesis_relinearise(oc_hypothesis *hypothesis, const oc_hypothesis_design *design);

bool oc_hypothesis_is_on_probation(const oc_hypothesis *hypothesis, const oc_second *second);

/* Whether it is in the answer: not on probation, and if its offset walks, proved to. */
bool oc_hypothesis_counts(const oc_hypothesis *hypothesis, const oc_second *second);

/* exp(-x) by (1 + x/32)^-32, accurate enough for a weight; x > -32. */
float oc_likelihood(float x);

/* rad^2, variance of a second's mean; includes the correlation between seconds. */
float oc_hypothesis_noise(const oc_hypothesis *hypothesis);

/* Corrects the evidence where the yaw rates so far were corrected by `rad_s` too little. Takes effect at the next
 * solution. */
void oc_hypothesis_correct(oc_hypothesis *hypothesis, const oc_hypothesis_design *design, float rad_s);

/* The sensor reads `by` rad more from now on. `seconds`: weight of the constant after it. */
void oc_hypothesis_shift_offset(oc_hypothesis *hypothesis, float by, float seconds);

/* Bends need another angle from now on: adds process noise to gradient and wheelbase. */
void oc_hypothesis_change_load(oc_hypothesis *hypothesis);

/* A new drive, after `off_s` seconds without ignition: adds what may have changed (between_drives.h). */
void oc_hypothesis_change_between_drives(oc_hypothesis *hypothesis, const oc_hypothesis_design *design, float off_s);

/* The play has another width from now on: all evidence of its width is lost, that of the other quantities stays. After
 * little play, it creeps as `to` does. */
void oc_hypothesis_change_play(oc_hypothesis *hypothesis, const oc_play *to);

/* Shared by hypothesis.c, which gathers evidence, and hypothesis_equations.c, which solves it: */

/* The linearisation point of a term moved by `by`, so its remaining solution shrinks by that. */
void oc_hypothesis_shift(oc_hypothesis *hypothesis, const oc_hypothesis_design *design, int32_t term, float by);

/* Scales the slopes of the terms from first to last in all evidence, as a narrower play does. */
void oc_hypothesis_scale_slopes(oc_hypothesis *hypothesis, int32_t first, int32_t last, float share);

#endif

#ifndef OC_HYPOTHESIS_H
#define OC_HYPOTHESIS_H
/* One hypothesis: the free play of the steering, and all parameters that follow by least squares (docs/method.md, "The
 * joint method").
 *
 * The model of the measured angle less i*L*r/v is in joint_model.h. Operators (play.h) give the places c in a play of
 * width B and d in a wind-up of width W. Twelve more operators run at a little more and less of each parameter. Their
 * differences are the model's slopes, and one recursive least squares is linearised anew each second.
 *
 * Single precision, so that the whole hypothesis set fits a microcontroller. */

#include <stdbool.h>
#include <stdint.h>

#include "play.h"
#include "sensor_noise.h"
#include "triangle.h"

/* Priors: from params, standstill and other filters. */
typedef struct {
    float unloading_mean;   /* m/s^2, of a_0: the accelerometer's bias and a known pull */
    float unloading_sd;     /* m/s^2 */
    float zero_information; /* 1/(m/s^2)^2, of a_0 about 0 by a torque sensor's zero; 0: none */
    float crown;            /* m/s^2, for which an axle may be set up */
    float yaw_rate_bias_sd; /* rad/s, of the yaw rate's correction */
} oc_prior;

/* A term's prior as the equations take it: in units of the term's scale, as an observation of that accuracy. */
typedef struct {
    float information, toward;
} oc_term_information;

/* What the truck is known to be; without that knowledge the model's priors. */
typedef struct {
    float play, play_accuracy; /* rad, width of play and wind-up together; 1/rad, 1 over its sd, 0: unknown */
    float width_sd;            /* rad, of play whose other flank was not loaded */
    float pull;                /* m/s^2, mean */
    float set_up_share;        /* 1: an axle may be set up for the crown; 0: the pull is known */
    oc_term_information wheelbase, gradient;
} oc_known_truck;

typedef struct {
    float step_s;                                 /* between samples */
    float steering_ratio, ratio_times_wheelbase;  /* 1, m */
    float scale[OC_TERMS];                        /* each term's unit: its prior's standard deviation */
    float of_sum[OC_TERMS];                       /* a term per unit of a second's sum */
    float per_unloading;                          /* s^2/m, a_0's slope per difference */
    float pull_sd;                                /* m/s^2, of wheel alignment and mean wind */
    float wander;                                 /* (m/s^2)^2, variance of a_0's random change in a second */
    float most_doubt;                             /* maximum divisor of a_0's prior information */
    oc_known_truck known;
} oc_hypothesis_design;

/* Variance of a block's summed errors, relative to that of independent seconds. */
typedef struct {
    float sum;    /* rad, over the block that fills */
    float factor;
} oc_correlation;

/* The estimated quantities, and their variances. */
enum { OC_OF_GRADIENT, OC_OF_UNLOADING, OC_OF_WIDTH, OC_OF_WHEELBASE, OC_OF_OFFSET, OC_OF_COUNT };

typedef struct {
    float of[OC_OF_COUNT];
} oc_variances;

typedef struct {
    oc_play play;
    oc_places places;
    float sums[OC_TERMS], target_sum;    /* over the second that fills: of the play's differences (slopes once the
                                          * second is predicted) and of motion; rad */
    float learned_s;                     /* s, forgetting, in the products */
    float weight;                        /* s of them that identify the constant; what follows is over them */
    float target_mean;                   /* rad */
    float means[OC_TERMS];
    float scatter[OC_TERMS_TRIANGLE];    /* sums of products of deviations from the means */
    float toward[OC_TERMS];              /* the same with the target's */
    float constant;                      /* rad, of the model */
    float terms[OC_TERMS];               /* the solution, in units of `scale` */
    float variance;                      /* rad^2, of the prediction errors */
    oc_correlation blocks, long_blocks;
    float width_mean;                    /* rad, of the prior of its play's width: where it began */
    float huber_weight;                  /* of the last second, 1 or less */
    float error;                         /* rad, prediction error of the last second */
    float cost;                          /* negative log likelihood, forgetting; after probation */
    float doubt;                         /* cost beside: of a_0 so far from its prior's mean */
    float offset;                        /* rad */
    float lean;                          /* rad, from the offset to the middle of its interval: pull's share in a_0 */
    float set_up_lean;                   /* rad, of it by an axle set up for the crown */
    float per_acceleration;              /* rad/(m/s^2), of the offset by a pull: i K, as far as a_0 is identified */
    float gradient;                      /* rad/(m/s^2) */
    float wheelbase;                     /* l, share */
    float unloading;                     /* m/s^2, a_0 */
    float age;                           /* s of driving learned from */
    float left_before, right_before;     /* s on either flank before it began */
    float with_offset[OC_OF_OFFSET];     /* covariances of the offset with the others */
    float set_up_variance;               /* rad^2, of the offset by an axle set up for the crown, beside its own */
    float pulled_variance;               /* rad^2, likewise by pull and wind */
    oc_variances variances;              /* squares of the units above, and of the width's, rad */
    int32_t wanders;                     /* 1: the accelerometer's zero does, and a_0 with it */
} oc_hypothesis;

/* A second's context, the same for all hypotheses; the noise goes on while equations are solved. */
typedef struct {
    int32_t learns;     /* 0: a change is suspected, the second is only predicted */
    int32_t block_ends, long_block_ends;
    int32_t blocks, long_blocks; /* whole ones before */
    oc_noise noise;     /* of the sensors, in its means */
    float used_s;       /* of driving before it */
    float trial_s;      /* until this age a hypothesis is on probation: it learns, and does not count */
    float best_cost;    /* of all hypotheses */
    float second_s;     /* its length */
    float memory_share; /* by which evidence is multiplied */
    float reference;    /* rad^2, the best hypothesis's noise, the unit of costs */
    float weight;       /* of this second, 1 or less: in tight bends and at low speed the model errs more */
} oc_second;

/* The equations of one hypothesis. */
typedef struct {
    float information[OC_TERMS];    /* of the priors */
    float inverse[OC_TERMS];        /* of the factor's diagonal */
    float lower[OC_TERMS_TRIANGLE]; /* Cholesky's factor */
    float terms[OC_TERMS];          /* right side, then solution */
    float weights[OC_OF_COUNT][OC_TERMS]; /* of the sums of terms whose variances are sought; here to save stack */
} oc_equations;

enum { OC_SECONDS_PER_BLOCK = 5, OC_SECONDS_PER_LONG_BLOCK = 40 };

void oc_hypothesis_setup(oc_hypothesis_design *design, double step_s, double steering_ratio,
                         double ratio_times_wheelbase, float pull_sd);

void oc_hypothesis_start(oc_hypothesis *hypothesis, const oc_play *play, double angle);

/* Wheel and heading are unknown: the operators start anew, the wind is unknown, all other evidence stays. */
void oc_hypothesis_restart(oc_hypothesis *hypothesis, double angle);

/* The operators' input at a sample. */
oc_play_motion oc_hypothesis_motion(const oc_hypothesis *hypothesis, const oc_hypothesis_design *design,
                                    const oc_motion_sample *sample);

/* Moves all operators on and, where the sample is usable, adds it to the second that fills. */
void oc_hypothesis_sample(oc_hypothesis *hypothesis, const oc_hypothesis_design *design,
                          const oc_motion_sample *sample);

/* The prediction error of a whole second of so many samples. */
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

/* exp(-x), near enough for a weight, for x > -32. */
float oc_likelihood(float x);

/* rad^2, of a second's mean, correlation between seconds included. */
float oc_hypothesis_noise(const oc_hypothesis *hypothesis);

/* The yaw rates so far were corrected by rad/s too little: corrects the evidence. The next solution has it. */
void oc_hypothesis_correct(oc_hypothesis *hypothesis, const oc_hypothesis_design *design, float rad_s);

/* The sensor reads `by` rad more from now on, as sure as so many seconds make it. */
void oc_hypothesis_remounted(oc_hypothesis *hypothesis, float by, float seconds);

/* Bends take another angle from now on: gradient and wheelbase may be others. */
void oc_hypothesis_loaded(oc_hypothesis *hypothesis);

#endif

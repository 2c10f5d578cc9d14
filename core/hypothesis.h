#ifndef OC_HYPOTHESIS_H
#define OC_HYPOTHESIS_H
/* One hypothesis of how the steering plays, and all that follows from it by least squares.
 *
 * The measured angle less i*L*r/v is
 *
 *     y = offset + K (i a) + (B/2) c + (W/2) d + what changes of motion add,
 *
 * c and d in [-1, 1] being the places in a play of width B and in a wind-up of width W. Where they are, operators say
 * (play.h). Twelve more run beside the hypothesis's own, at a little more and less of each parameter: their differences
 * are the slopes of the model, so that all is found by one recursive least squares, which is linearised anew each
 * second. A steady wind adds to a what its part across the truck's heading carries.
 *
 * Single precision, so that the whole bank fits a microcontroller. */

#include <stdbool.h>
#include <stdint.h>

#include "play.h"
#include "sensor_noise.h"
#include "triangle.h"

/* What is known before the drive, or from other sensors; standard deviations. */
typedef struct {
    float unloading_mean;   /* m/s^2, where the accelerometer's bias is believed to be */
    float unloading_sd;     /* m/s^2 */
    float crown;            /* m/s^2, for which an axle may have been set up */
    float yaw_rate_bias_sd; /* rad/s, of what correction the yaw rate had */
} oc_prior;

typedef struct {
    float step_s;                                 /* between samples */
    float steering_ratio, ratio_times_wheelbase;  /* 1, m */
    float scale[OC_TERMS];                        /* each term's unit: its prior's standard deviation */
    float of_sum[OC_TERMS];                       /* a term, by what a second sums up for it */
    float per_unloading;                          /* s^2/m, makes a difference by the unloading a slope */
    float pull_sd;                                /* m/s^2, of wheel alignment and mean wind */
    float most_doubt;                             /* of the prior of a_0: by how much less it may tell */
} oc_hypothesis_design;

/* How much more a block of what is left varies than it would if seconds told new things each. */
typedef struct {
    float sum;    /* rad, over the block that fills */
    float factor;
} oc_correlation;

/* What is asked for, and how sure it is. */
enum { OC_OF_GRADIENT, OC_OF_UNLOADING, OC_OF_WIDTH, OC_OF_WHEELBASE, OC_OF_OFFSET, OC_ASKED };

typedef struct {
    float of[OC_ASKED];
} oc_variances;

typedef struct {
    oc_play play;
    oc_places places;
    float sums[OC_TERMS], target_sum;    /* over the second that fills: of the play's differences, which are slopes once
                                          * it is foretold, and of motion; rad */
    float learned_s;                     /* s, forgetting, of which products were gathered */
    float weight;                        /* of them those that tell the constant; what follows is over them */
    float target_mean;                   /* rad */
    float means[OC_TERMS];
    float scatter[OC_TERMS_TRIANGLE];    /* sums of products of deviations from the means */
    float toward[OC_TERMS];              /* the same with the target's */
    float constant;                      /* rad, of the model */
    float terms[OC_TERMS];               /* what is sought, in units of `scale` */
    float variance;                      /* rad^2, of what a second's mean leaves */
    oc_correlation blocks, long_blocks;
    float trust;                         /* in the last second, 1 or less where it was far off */
    float error;                         /* rad, of the last second, foretold before it was learned from */
    float cost;                          /* minus its logarithmic likelihood, forgetting; once it is no newborn */
    float offset;                        /* rad */
    float lean;                          /* rad, to where it is if pull and wind have their share in where a_0 is */
    float gradient;                      /* rad/(m/s^2) */
    float wheelbase;                     /* share by which the truck turns as if it were longer */
    float unloading;                     /* m/s^2 */
    float age;                           /* s of driving learned from */
    float left_before, right_before;     /* s, for which either flank was seen before it began */
    oc_variances variances;              /* squares of the units above, and of the width's, rad */
    float pulled_variance;               /* rad^2, of the offset's what pull and wind make */
} oc_hypothesis;

/* Where a second stands among the others, the same for all hypotheses; the noise goes on while equations are solved. */
typedef struct {
    oc_noise noise;     /* of the sensors, in its means */
    float used_s;       /* of driving before it */
    float trial_s;      /* until a hypothesis is so old it only learns: it is newborn, and its word does not count */
    float best_cost;    /* of all hypotheses */
    float second_s;     /* its length */
    float memory_share; /* 1 less what it makes be forgotten */
    float reference;    /* rad^2, the best hypothesis's noise, by which errors are judged */
    int32_t learns;     /* 0: what was learned is in doubt, the second is only foretold */
    int32_t block_ends, long_block_ends;
    int32_t blocks, long_blocks; /* whole ones before */
} oc_second;

/* The equations of one hypothesis. */
typedef struct {
    float information[OC_TERMS];    /* of the priors */
    float inverse[OC_TERMS];        /* of the factor's diagonal */
    float lower[OC_TERMS_TRIANGLE]; /* Cholesky's factor */
    float terms[OC_TERMS];          /* right side, then solution */
} oc_equations;

enum { OC_SECONDS_PER_BLOCK = 5, OC_SECONDS_PER_LONG_BLOCK = 40 };

void oc_hypothesis_setup(oc_hypothesis_design *design, double step_s, double steering_ratio,
                         double ratio_times_wheelbase, float pull_sd);

void oc_hypothesis_start(oc_hypothesis *hypothesis, const oc_play *play, double angle);

/* The wheel was elsewhere when last seen, and the heading another: the operators start anew, the wind is unknown, what
 * else was learned stays. */
void oc_hypothesis_restart(oc_hypothesis *hypothesis, double angle);

/* What moves the operators at a sample. */
oc_play_motion oc_hypothesis_motion(const oc_hypothesis *hypothesis, const oc_hypothesis_design *design,
                                    const oc_motion_sample *sample);

/* Moves all operators on and, where the sample is usable, adds it to the second that fills. */
void oc_hypothesis_sample(oc_hypothesis *hypothesis, const oc_hypothesis_design *design,
                          const oc_motion_sample *sample);

/* How far a whole second of so many samples is from what was expected. */
void oc_hypothesis_predict(oc_hypothesis *hypothesis, const oc_hypothesis_design *design, const oc_second *second,
                           int32_t samples);

/* Takes the second that was predicted in among what was gathered. */
void oc_hypothesis_take_in(oc_hypothesis *hypothesis, const oc_hypothesis_design *design, const oc_second *second,
                           int32_t samples);

/* Solves the equations of all that was gathered, whose solution is what is sought. */
void oc_hypothesis_solve(oc_hypothesis *hypothesis, const oc_hypothesis_design *design, const oc_prior *prior,
                         const oc_second *second, oc_equations *equations);

/* Goes where its terms point, a little at a time, and keeps its evidence. */
void oc_hypothesis_relinearise(oc_hypothesis *hypothesis, const oc_hypothesis_design *design);

/* Whether its word does not count yet. */
bool oc_hypothesis_is_on_probation(const oc_hypothesis *hypothesis, const oc_second *second);

/* exp(-x), near enough for a weight, for x > -32. */
float oc_likelihood(float x);

/* rad^2, of a second's mean as if seconds told new things each. */
float oc_hypothesis_noise(const oc_hypothesis *hypothesis);

/* The yaw rates so far were corrected by rad/s too little: what was gathered from them is set right. What follows from
 * it is concluded when equations are solved again. */
void oc_hypothesis_correct(oc_hypothesis *hypothesis, const oc_hypothesis_design *design, float rad_s);

/* The sensor reads `by` rad more from now on; so many seconds tell how much. */
void oc_hypothesis_remounted(oc_hypothesis *hypothesis, float by, float seconds);

/* Bends take another angle from now on: gradient and wheelbase may be others. */
void oc_hypothesis_loaded(oc_hypothesis *hypothesis);

#endif

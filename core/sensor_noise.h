#ifndef OC_SENSOR_NOISE_H
#define OC_SENSOR_NOISE_H
/* How much of accelerometer's and gyro's noise is left in a second's means, where it flattens what is fitted to them.
 *
 * Second differences of the filtered signals from sample to sample tell it: a truck bends hardly anything so quickly.
 * What is faster than a truck is taken to be noise, and as strong where a truck is slow (white). */

#include <stdint.h>

#include "preprocess.h"

/* Lateral acceleration less r*v, m/s^2, and yaw rate, rad/s. */
enum { OC_NOISE_OF_BANK, OC_NOISE_OF_YAW_RATE, OC_NOISY };

typedef struct {
    float of_mean; /* variance of a second's mean, by that of a second difference */
} oc_noise_design;

/* The signals at the two samples before. */
typedef struct {
    float last[OC_NOISY], before[OC_NOISY];
} oc_noise_watch;

void oc_noise_setup(oc_noise_design *design, const oc_lowpass *lowpass, double rate_hz, int32_t ticks_per_sample);

/* One sample more, which counts by that share (0: not at all) in the variances of a second's means. */
void oc_noise_update(oc_noise_watch *watch, const oc_noise_design *design, const float *signals, float share,
                     float *variances);

#endif

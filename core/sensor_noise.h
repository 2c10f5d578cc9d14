#ifndef OC_SENSOR_NOISE_H
#define OC_SENSOR_NOISE_H
/* How much of accelerometer's and gyro's noise is left in a second's means, where it flattens what is fitted to them.
 *
 * A truck bends no signal within three samples of a tenth of a second, nor within three ticks: second differences are
 * noise, of filtered signals what is at 2 to 4 Hz, of raw ones what is near half the tick's rate. Where both say the
 * same it is white, and as strong below 1 Hz; what shakes a truck is mostly in one of them, so that the lesser counts.
 * Slower ticks than 80 Hz tell none. */

#include <stdint.h>

#include "preprocess.h"

enum { OC_NOISE_OF_ACCELERATION, OC_NOISE_OF_YAW_RATE, OC_NOISY };

typedef struct {
    float by_samples, by_ticks; /* variance of a second's mean, by that of a second difference */
} oc_noise_design;

/* The two signals at the two times before: lateral acceleration, m/s^2, as a sample less r*v, and yaw rate, rad/s. */
typedef struct {
    float last[OC_NOISY], before[OC_NOISY];
} oc_noise_past;

/* Lost at ignition. */
typedef struct {
    oc_noise_past samples, ticks;
} oc_noise_watch;

/* (m/s^2)^2 and (rad/s)^2, in a second's mean. */
typedef struct {
    float by_samples[OC_NOISY], by_ticks[OC_NOISY];
} oc_noise;

void oc_noise_setup(oc_noise_design *design, const oc_lowpass *lowpass, double rate_hz, int32_t ticks_per_sample);

/* The raw signals at one of the two ticks before a sample's. */
void oc_noise_tick(oc_noise_watch *watch, const float *raw);

/* At a sample's tick, which counts by that share; 0: not at all. */
void oc_noise_update(oc_noise *noise, oc_noise_watch *watch, const oc_noise_design *design, const float *filtered,
                     const float *raw, float share);

/* Variance in a second's mean. */
float oc_noise_in_mean(const oc_noise *noise, int32_t signal);

#endif

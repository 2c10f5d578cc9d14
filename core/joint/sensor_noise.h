#ifndef OC_SENSOR_NOISE_H
#define OC_SENSOR_NOISE_H
/* The noise of accelerometer and gyro in a second's means, where it flattens fitted slopes.
 *
 * A truck's motion is linear over three samples of 0.1 s and over three ticks, so second differences are noise: of
 * filtered signals at 2 to 4 Hz, of raw ones near half the tick rate. White noise has the same variance in both, and
 * below 1 Hz. A truck's vibration is mostly in one of them, so the minimum counts. Held
 * values have no noise between ticks, so then the samples' counts. */

#include <stdint.h>

#include "preprocess.h"

enum { OC_NOISE_OF_ACCELERATION, OC_NOISE_OF_YAW_RATE, OC_NOISY };

typedef struct {
    float by_samples, by_ticks; /* variance of a second's mean over that of a second difference */
} oc_noise_design;

/* Both signals at the last two times: lateral acceleration, m/s^2 (of samples less r*v), and yaw rate, rad/s. */
typedef struct {
    float last[OC_NOISY], before[OC_NOISY];
} oc_noise_past;

/* Lost at ignition. */
typedef struct {
    oc_noise_past samples, ticks;
} oc_noise_watch;

/* (m/s^2)^2 and (rad/s)^2, in a second's mean. `held`: share of the samples at which the raw signal repeats itself. */
typedef struct {
    float by_samples[OC_NOISY], by_ticks[OC_NOISY], held[OC_NOISY];
} oc_noise;

void oc_noise_setup(oc_noise_design *design, const oc_lowpass *lowpass, double rate_hz, int32_t ticks_per_sample);

/* The raw signals at either of the two ticks before a sample's. */
void oc_noise_tick(oc_noise_watch *watch, const float *raw);

/* At a sample's tick; `share`: its weight in the variance, 0: none. */
void oc_noise_update(oc_noise *noise, oc_noise_watch *watch, const oc_noise_design *design, const float *filtered,
                     const float *raw, float share);

/* Variance in a second's mean; by the samples where the raw signal is held for several ticks. */
float oc_noise_in_mean(const oc_noise *noise, int32_t signal);

#endif

#include "sensor_noise.h"

#include <stdbool.h>

#include "bounds.h"

/* Tuned, in tuned.toml: sensor_noise */
static const float kick_min[OC_NOISY] = {0.01f, 3e-06f}; /* (m/s^2)^2, (rad/s)^2: squares of 0.1 m/s^2 and 0.1 deg/s */
static const float held_share = 0.8f; /* share of samples after a constant raw signal from which it is held */
/* end */

void oc_noise_setup(oc_noise_design *design, const oc_lowpass *lowpass, double rate_hz, int32_t ticks_per_sample) {
    design->by_samples = (float)(1.0 / (rate_hz * oc_lowpass_second_difference(lowpass, ticks_per_sample)));
    design->by_ticks = (float)(1.0 / (rate_hz * 6.0)); /* 1 + 4 + 1 */
}

static void shift_past(oc_noise_past *past, const float *now) {
    for (int32_t k = 0; k < OC_NOISY; ++k) {
        past->before[k] = past->last[k];
        past->last[k] = now[k];
    }
}

static void average_noise(float *variances, const oc_noise_past *past, const float *now, float of_mean, float share) {
    for (int32_t k = 0; k < OC_NOISY; ++k) {
        const float difference = now[k] - 2.0f * past->last[k] + past->before[k];
        const float variance = of_mean * difference * difference;
        const float outlying = (float)(OC_OUTLIER_SDS * OC_OUTLIER_SDS) * variances[k]; /* beyond: by a kerb */
        const float variance_max = of_mean * kick_min[k] + outlying;
        variances[k] += share * (oc_min(variance, variance_max) - variances[k]);
    }
}

void oc_noise_tick(oc_noise_watch *watch, const float *raw) {
    shift_past(&watch->ticks, raw);
}

void oc_noise_update(oc_noise *noise, oc_noise_watch *watch, const oc_noise_design *design, const float *filtered,
                     const float *raw, float share) {
    average_noise(noise->by_samples, &watch->samples, filtered, design->by_samples, share);
    average_noise(noise->by_ticks, &watch->ticks, raw, design->by_ticks, share);
    for (int32_t k = 0; k < OC_NOISY; ++k) {
        const float last = watch->ticks.last[k];
        const bool is_held = raw[k] == last || last == watch->ticks.before[k];
        noise->held[k] += share * ((is_held ? 1.0f : 0.0f) - noise->held[k]);
    }
    shift_past(&watch->samples, filtered);
}

float oc_noise_in_mean(const oc_noise *noise, int32_t signal) {
    const float by_samples = noise->by_samples[signal];
    return noise->held[signal] > held_share ? by_samples : oc_min(by_samples, noise->by_ticks[signal]);
}

#include "sensor_noise.h"

#include "bounds.h"

/* At slower ticks their second differences see what shakes a truck as well, and tell nothing. */
static const double fast_hz = 80.0;

/* A second difference is a kerb's beyond three standard deviations, and never below 0.1 m/s^2 or 0.1 deg/s. */
static const float kick_share = 9.0f;
static const float least_kick[OC_NOISY] = {[OC_NOISE_OF_ACCELERATION] = 1e-2f, [OC_NOISE_OF_YAW_RATE] = 3e-6f};

void oc_noise_setup(oc_noise_design *design, const oc_lowpass *lowpass, double rate_hz, int32_t ticks_per_sample) {
    design->by_samples = (float)(1.0 / (rate_hz * oc_lowpass_bent(lowpass, ticks_per_sample)));
    design->by_ticks = rate_hz < fast_hz ? 0.0f : (float)(1.0 / (rate_hz * 6.0)); /* 1 + 4 + 1 */
}

static void remember(oc_noise_past *past, const float *now) {
    for (int32_t k = 0; k < OC_NOISY; ++k) {
        past->before[k] = past->last[k];
        past->last[k] = now[k];
    }
}

static void learn(float *variances, const oc_noise_past *past, const float *now, float of_mean, float share) {
    for (int32_t k = 0; k < OC_NOISY; ++k) {
        const float bent = now[k] - 2.0f * past->last[k] + past->before[k];
        const float seen = of_mean * bent * bent;
        const float most = of_mean * least_kick[k] + kick_share * variances[k];
        variances[k] += share * (oc_min(seen, most) - variances[k]);
    }
}

void oc_noise_tick(oc_noise_watch *watch, const float *raw) {
    remember(&watch->ticks, raw);
}

void oc_noise_update(oc_noise *noise, oc_noise_watch *watch, const oc_noise_design *design, const float *filtered,
                     const float *raw, float share) {
    learn(noise->by_samples, &watch->samples, filtered, design->by_samples, share);
    learn(noise->by_ticks, &watch->ticks, raw, design->by_ticks, share);
    remember(&watch->samples, filtered);
}

float oc_noise_in_mean(const oc_noise *noise, int32_t signal) {
    return oc_min(noise->by_samples[signal], noise->by_ticks[signal]);
}

#include "sensor_noise.h"

/* A second difference is a kerb's beyond three standard deviations, and never below 0.1 m/s^2 or 0.1 deg/s. */
static const float kick_share = 9.0f;
static const float least_kick[OC_NOISY] = {[OC_NOISE_OF_BANK] = 1e-2f, [OC_NOISE_OF_YAW_RATE] = 3e-6f}; /* squared */

void oc_noise_setup(oc_noise_design *design, const oc_lowpass *lowpass, double rate_hz, int32_t ticks_per_sample) {
    design->of_mean = (float)(1.0 / (rate_hz * oc_lowpass_bent(lowpass, ticks_per_sample)));
}

void oc_noise_update(oc_noise_watch *watch, const oc_noise_design *design, const float *signals, float share,
                     float *variances) {
    for (int32_t k = 0; k < OC_NOISY; ++k) {
        const float bent = signals[k] - 2.0f * watch->last[k] + watch->before[k];
        const float seen = design->of_mean * bent * bent;
        const float most = design->of_mean * least_kick[k] + kick_share * variances[k];
        variances[k] += share * ((seen < most ? seen : most) - variances[k]);
        watch->before[k] = watch->last[k];
        watch->last[k] = signals[k];
    }
}

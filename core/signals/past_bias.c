#include "past_bias.h"

#include <math.h>

/* Numerical. */
static const float mean_variance_min = 1e-12f; /* (rad/s)^2, against a variance that is negative by rounding */

void oc_past_bias_grow(oc_past_bias *past, const double *of_bias) {
    if (!(past->waiting_s > 0.0f)) {
        return;
    }
    const float all_s = past->used_s + past->waiting_s;
    past->used_s = past->memory_s > 0.0f && past->memory_s < all_s ? past->memory_s : all_s;
    const float share = past->waiting_s / past->used_s, rest = 1.0f - share;
    past->bias *= rest; /* the waiting yaw rates have the present correction */
    past->variance = rest * (rest * past->variance + 2.0f * share * past->covariance[0]) +
                     share * share * (float)of_bias[0];
    for (int k = 0; k < OC_GYRO_BIAS_STATES; ++k) {
        past->covariance[k] = rest * past->covariance[k] + share * (float)of_bias[k];
    }
    past->waiting_s = 0.0f;
}

void oc_past_bias_correct(oc_past_bias *past, float with, const double *with_states, float innovation,
                          float per_variance) {
    const float gain = with * per_variance;
    past->bias += gain * innovation;
    past->variance -= gain * with;
    for (int k = 0; k < OC_GYRO_BIAS_STATES; ++k) {
        past->covariance[k] -= gain * (float)with_states[k];
    }
}

float oc_past_bias_sd(const oc_past_bias *past, float otherwise) {
    const float variance = past->variance > mean_variance_min ? past->variance : mean_variance_min;
    return past->used_s > 0.0f ? sqrtf(variance) : otherwise;
}

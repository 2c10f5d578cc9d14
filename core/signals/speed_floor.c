#include "speed_floor.h"

#include <math.h>

/* Derived. */
/* m/s: a step of 1 km/h, and twice as wide each; sensors of pole wheels begin at 0.5 to 2.5 km/h */
static const float range_ends[OC_LOW_SPEEDS] = {0.28f, 0.56f, 1.11f, 2.22f};

/* Tuned, in tuned.toml: speed_floor */
static const float floor_before = 0.6f; /* m/s: speed below which the signal may read zero, without evidence */
static const float evidence_s = 4.0f; /* s: minimum time at low speed */
/* end */

void oc_speed_floor_update(oc_speed_floor *state, float speed, float tick_s) {
    const float v = fabsf(speed);
    if (!(v > 0.0f) || v >= range_ends[OC_LOW_SPEEDS - 1]) {
        return;
    }
    int k = 0;
    while (v >= range_ends[k]) {
        ++k;
    }
    state->low_s[k] += tick_s;
}

static float width_of(int k) {
    return range_ends[k] - (k > 0 ? range_ends[k - 1] : 0.0f);
}

float oc_speed_floor_get(const oc_speed_floor *state) {
    float whole_s = 0.0f, found = 0.0f;
    for (int k = 0; k < OC_LOW_SPEEDS; ++k) {
        whole_s += state->low_s[k];
    }
    if (whole_s < evidence_s) {
        return floor_before;
    }
    for (int k = 0; k + 1 < OC_LOW_SPEEDS; ++k) {
        const float below = state->low_s[k] / width_of(k), above = state->low_s[k + 1] / width_of(k + 1);
        found = below < 0.5f * above ? range_ends[k] : found;
    }
    return found;
}

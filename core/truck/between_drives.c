#include "between_drives.h"

#include "bounds.h"

/* 1 deg is the constant 0.017453292 rad, so that all machines have the same bits. */
static const struct {
    float at_ignition, per_root_day; /* standard deviations */
} spreads[OC_BETWEEN_COUNT] = {
    /* between_drives.toml: spreads */
    [OC_BETWEEN_OFFSET] = {0.1f * 0.017453292f, 0.0f},
    [OC_BETWEEN_WHEEL_RADIUS] = {0.003f, 0.0003f},
    [OC_BETWEEN_YAW_RATE_BIAS] = {0.0f, 0.02f * 0.017453292f},
    [OC_BETWEEN_ACCELEROMETER_ZERO] = {0.01f, 0.01f},
    [OC_BETWEEN_PULL] = {0.0f, 0.003f},
    [OC_BETWEEN_GRADIENT] = {0.1f * 0.017453292f, 0.002f * 0.017453292f},
    [OC_BETWEEN_WHEELBASE] = {0.03f, 0.001f},
    [OC_BETWEEN_CROWN] = {0.07f, 0.0f},
    [OC_BETWEEN_PLAY] = {0.3f * 0.017453292f, 0.1f * 0.017453292f},
    /* end */
};

float oc_variance_between_drives(int32_t quantity, float off_s) {
    static const float day_s = 86400.0f, off_s_max = 3.2e8f; /* ten years, also against what is no number */
    const float days = (off_s > 0.0f ? oc_min(off_s, off_s_max) : 0.0f) / day_s;
    const float at_ignition = spreads[quantity].at_ignition, per_root_day = spreads[quantity].per_root_day;
    return at_ignition * at_ignition + per_root_day * per_root_day * days;
}

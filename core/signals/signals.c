#include "signals.h"

#include <math.h>

/* Numerical. */
/* Against implausible values and NaN; in the order of the signals and their bits. */
static const float signal_limits[OC_SIGNAL_COUNT] = {
    100.0f,                                 /* rad, 16 turns */
    10.0f,                                  /* rad/s */
    150.0f,                                 /* m/s */
    100.0f,                                 /* m/s^2 */
    150.0f, 150.0f, 150.0f, 150.0f, 150.0f, /* m/s: wheels, lateral */
    1e5f,                                   /* N m, or N of a rod's force */
    1.5f, 1.5f, 1.5f, 1.5f, 1.5f,           /* status: 0 or 1 */
    1.5f,                                   /* rad */
};

uint32_t oc_signals_true(const oc_signals *tick) {
    const double *signal = &tick->steering_wheel_angle;
    uint32_t found = tick->valid & OC_STATUSES;
    for (uint32_t k = 0; found >> k != 0; ++k) {
        if (!(signal[k] > 0.5)) {
            found &= ~(1u << k);
        }
    }
    return found;
}

uint32_t oc_signals_measured(const oc_signals *tick) {
    const double *signal = &tick->steering_wheel_angle;
    uint32_t measured = tick->valid;
    for (uint32_t k = 0; k < OC_SIGNAL_COUNT && tick->valid >> k != 0; ++k) {
        if (!(fabs(signal[k]) < (double)signal_limits[k])) {
            measured &= ~(1u << k);
        }
    }
    return measured;
}

bool oc_signals_has(uint32_t valid, int32_t needed) {
    return ((uint32_t)needed & ~valid) == 0;
}

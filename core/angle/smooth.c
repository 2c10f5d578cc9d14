#include "smooth.h"

#include <math.h>

#include "angle.h"

/* Derived. */
static const double sensor_fade_s = 1.0;      /* s: as in angle.c, with which the sensor's last angle fades */

/* Tuned, in tuned.toml: smooth */
static const double hand_acceleration = 0.35; /* rad/s^2/sqrt(Hz): white angular acceleration of drivers */
static const double noise_s = 0.02; /* s: sd^2 times this: white part of the estimate's error */
/* end */

/* For white acceleration and white noise the steady-state Kalman smoother is a second-order Butterworth low-pass, run
 * forward and backward. */
static void pass(double *angle, double *rate, const double *sd, const uint8_t *measured, size_t count, double tick_s,
                 int backward) {
    double x = 0.0, v = 0.0;
    for (size_t n = 0; n < count; ++n) {
        const size_t k = backward ? count - 1 - n : n;
        const double w_tick = tick_s * sqrt(hand_acceleration / (sd[k] * sqrt(noise_s) + 1e-9));
        if (n == 0) {
            x = angle[k];
        }
        if (measured[k] || w_tick > 0.5) {
            v += ((angle[k] - x) / tick_s - v) * tick_s / (oc_angle_rate_s() + tick_s);
            x = angle[k];
        } else { /* implicit in the damping */
            v = (v + w_tick * w_tick / tick_s * (angle[k] - x)) / (1.0 + 1.4142135623730951 * w_tick + w_tick * w_tick);
            x += v * tick_s;
        }
        angle[k] = x;
        rate[k] = backward ? -v : v;
    }
}

void oc_smooth_angle(double *angle, double *rate, const double *sd, const uint8_t *measured, size_t count,
                     double tick_s, const double *delay_s) {
    pass(angle, rate, sd, measured, count, tick_s, 0);
    pass(angle, rate, sd, measured, count, tick_s, 1);
    double ahead_s = count > 0 ? delay_s[0] : 0.0, gap = 0.0;
    for (size_t k = 0; k < count; ++k) {
        const double fading = measured[k] ? 1.0 : tick_s / (sensor_fade_s + tick_s);
        if (k > 0 && measured[k - 1] && !measured[k]) {
            gap = angle[k - 1] - angle[k];
        }
        ahead_s += (delay_s[k] - ahead_s) * fading;
        gap -= gap * fading;
        angle[k] += measured[k] ? 0.0 : ahead_s * rate[k] + gap;
    }
}

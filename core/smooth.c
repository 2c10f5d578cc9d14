#include "smooth.h"

#include <math.h>

static const double hand_acceleration = 1.0; /* rad/s^2 over sqrt(Hz): what drivers do in bends */
static const double correlated_s = 0.2;      /* errors of the estimate last so long */

/* A critically damped tracker of second order that runs along the column one way; its bandwidth is the steady Kalman
 * filter's for this sd. */
static void track(double *angle, double *rate, const double *sd, size_t count, double tick_s, int backward) {
    double x = 0.0, v = 0.0;
    for (size_t n = 0; n < count; ++n) {
        const size_t k = backward ? count - 1 - n : n;
        const double noise = sd[k] * sqrt(correlated_s);
        const double w = sqrt(hand_acceleration / (noise > 1e-3 ? noise : 1e-3)); /* 1/s */
        const double share = w * tick_s;
        if (n == 0) {
            x = angle[k];
        }
        x += v * tick_s;
        const double error = angle[k] - x;
        const double gain = 1.4142135623730951 * share;
        x += error * (gain < 1.0 ? gain : 1.0);
        v += error * (share < 1.0 ? share * share : 1.0) / tick_s;
        angle[k] = x;
        rate[k] = backward ? -v : v;
    }
}

void oc_smooth_angle(double *angle, double *rate, const double *sd, size_t count, double tick_s) {
    track(angle, rate, sd, count, tick_s, 0);
    track(angle, rate, sd, count, tick_s, 1);
}

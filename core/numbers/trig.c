#include "trig.h"

#include <math.h>
#include <stdint.h>

/* Derived. */
static const double half_pi_high = 1.57079632679489655800e+00; /* pi/2 as a double */
static const double half_pi_low = 6.12323399573676603587e-17;  /* pi/2 less that */

/* The nearest quarter turn, modulo 4, and the rest of the angle. */
static int32_t quarter_turns(double angle, double *rest) {
    if (!(fabs(angle) <= 1e6)) { /* beyond the range, or NaN */
        *rest = 0.0;
        return 0;
    }
    const int32_t turns = (int32_t)(angle / half_pi_high + (angle < 0.0 ? -0.5 : 0.5));
    *rest = (angle - turns * half_pi_high) - turns * half_pi_low;
    return (int32_t)((uint32_t)turns & 3u);
}

/* Lambert's continued fraction, |angle| <= pi/4: the first omitted part is below 1e-19. */
static double tangent_near_zero(double angle) {
    const double z = angle * angle;
    double sum = 21.0;
    for (int32_t k = 19; k > 0; k -= 2) {
        sum = k - z / sum;
    }
    return angle / sum;
}

double oc_tan(double angle) {
    double rest;
    const int32_t quadrant = quarter_turns(angle, &rest);
    const double tangent = tangent_near_zero(rest);
    return (quadrant % 2 == 0) ? tangent : -1.0 / tangent;
}

/* |ratio| <= 1/2; rational approximation of fdlibm (Sun Microsystems, 1993). */
static double arcsine_near_zero(double ratio) {
    const double z = ratio * ratio;
    const double p = z * (1.66666666666666657415e-01 +
                          z * (-3.25565818622400915405e-01 +
                               z * (2.01212532134862925881e-01 +
                                    z * (-4.00555345006794114027e-02 +
                                         z * (7.91534994289814532176e-04 + z * 3.47933107596021167570e-05)))));
    const double q = 1.0 + z * (-2.40339491173441421878e+00 +
                                z * (2.02094576023350569471e+00 +
                                     z * (-6.88283971605453293030e-01 + z * 7.70381505559019352791e-02)));
    return ratio + ratio * (p / q);
}

double oc_asin(double ratio) {
    const double size = fabs(ratio) < 1.0 ? fabs(ratio) : 1.0;
    const double angle =
        size <= 0.5 ? arcsine_near_zero(size) : half_pi_high - 2.0 * arcsine_near_zero(sqrt(0.5 * (1.0 - size)));
    return ratio < 0.0 ? -angle : angle;
}

#ifndef OC_SMOOTH_H
#define OC_SMOOTH_H
/* 4.3: a Kalman smoother over an estimated steering wheel angle, for whole drives. The steering acceleration is assumed
 * white. It uses no memory but the given columns, and compensates the estimate's delay. */

#include <stddef.h>
#include <stdint.h>

/* angle (rad) is smoothed in place and gives rate (rad/s); sd (rad) is its standard deviation. An angle with measured
 * not 0 is the sensor's and stays. All have `count` rows. late_s: oc_angle_late_s. */
void oc_smooth_angle(double *angle, double *rate, const double *sd, const uint8_t *measured, size_t count,
                     double tick_s, double delay_s);

#endif

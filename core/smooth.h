#ifndef OC_SMOOTH_H
#define OC_SMOOTH_H
/* 4.3: a Kalman smoother over an estimated steering wheel angle, for whole drives. The hand's acceleration is taken as
 * white; no memory but the columns given. Where the sd is small, as with a sensor, hardly anything changes. */

#include <stddef.h>

/* angle (rad) is smoothed in place, rate (rad/s) is what comes of it, sd (rad) how far off each angle is; all of
 * `count`. */
void oc_smooth_angle(double *angle, double *rate, const double *sd, size_t count, double tick_s);

#endif

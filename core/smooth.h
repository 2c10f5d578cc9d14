#ifndef OC_SMOOTH_H
#define OC_SMOOTH_H
/* 4.3: a Kalman smoother over an estimated steering wheel angle, for whole drives. The hand's acceleration is taken as
 * white; no memory but the columns given. It also undoes what the estimate is late by. */

#include <stddef.h>
#include <stdint.h>

/* angle (rad) is smoothed in place, rate (rad/s) is what comes of it, sd (rad) how far off each angle is, measured
 * not 0 where a sensor tells it, which stays; all of `count`. late_s: oc_angle_late_s. */
void oc_smooth_angle(double *angle, double *rate, const double *sd, const uint8_t *measured, size_t count,
                     double tick_s, double late_s);

#endif

#ifndef OC_SMOOTH_H
#define OC_SMOOTH_H
/* 4.3: a Kalman smoother for an estimated steering wheel angle, for whole drives. The steering acceleration is modelled
 * as white noise. Compensates the estimate's delay. Needs no memory except the given columns. */

#include <stddef.h>
#include <stdint.h>

/* Smooths `angle` (rad) in place and fills `rate` (rad/s). sd: rad, the angle's standard deviation. Where `measured` is
 * not 0 the angle is the sensor's and does not change. delay_s: the angle's. All have `count` rows. */
void oc_smooth_angle(double *angle, double *rate, const double *sd, const uint8_t *measured, size_t count,
                     double tick_s, const double *delay_s);

#endif

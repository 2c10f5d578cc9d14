#ifndef OC_SIDE_SLIP_H
#define OC_SIDE_SLIP_H
/* (23) and (24): the front wheel angle by side slip over ground, with the front tyres' slip learned from the sensor.
 *
 * The thesis leaves alpha_f open: it is not identifiable without the sensor. With it, least squares give
 *     delta - v_y/v = a + b r/v + c a_y
 * a is the yaw misalignment of the receiver, b its distance behind the front axle, c the slip of the front tyres per
 * lateral acceleration. */

#include "front_wheel.h"

enum { OC_SIDE_SLIP_TERMS = 3 }; /* rad; m; rad/(m/s^2) */

typedef struct {
    double information[OC_SIDE_SLIP_TERMS][OC_SIDE_SLIP_TERMS]; /* in units of the noise */
    double sums[OC_SIDE_SLIP_TERMS];
} oc_side_slip_evidence;

/* The motion of one tick. */
typedef struct {
    double speed, lateral_speed; /* m/s, over ground */
    double yaw_rate;             /* rad/s */
    double lateral_acceleration; /* m/s^2 */
} oc_side_slip;

/* front_wheel: rad, by the sensor; memory_s: time until a tick's weight is 1/e. */
void oc_side_slip_learn(oc_side_slip_evidence *evidence, const oc_side_slip *tick, double front_wheel, double tick_s,
                        double memory_s);

/* rad. Speed not 0; wheelbase (m) for the prior. */
double oc_side_slip_front_wheel(const oc_side_slip_evidence *evidence, const oc_side_slip *tick, double wheelbase);

#endif

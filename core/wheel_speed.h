#ifndef OC_WHEEL_SPEED_H
#define OC_WHEEL_SPEED_H
/* 5.5.4: the motion from the two wheel speeds of one axle alone.
 *
 * Speeds hold for a nominal wheel radius, (20); mismatch is r_l/r_r - 1, the left wheel's radius over the right's. A
 * mismatch looks like a bend of radius track/mismatch. Without a gyro only the net turn identifies it: over a long
 * distance the sum of all turning is small against the distance. */

#include <stdint.h>

#include "estimate.h"
#include "params.h"

typedef struct {
    double difference; /* m, distance of the right wheel less the left's */
    double distance;   /* m, of the axle's middle */
    double time;       /* s */
} oc_wheel_speed;

/* (21) The front wheels' mean angle, rad, left positive; equal radii where mismatch is 0. Speeds in m/s. */
double oc_wheel_speed_front_angle(double wheelbase, double track, double left, double right, double mismatch);

/* 1/m; 5.5.4's second bullet. Rear: the difference over track and speed; 0 where no wheel turns. */
double oc_wheel_speed_rear_curvature(double track, double left, double right, double mismatch);

/* 1/m; tan of (21) over the wheelbase. */
double oc_wheel_speed_front_curvature(double wheelbase, double track, double left, double right, double mismatch);

void oc_wheel_speed_update(oc_wheel_speed *state, double left, double right, double tick_s);

/* The mismatch by its prior and the net turn's, for an axle of this track (m). Unobservable while the distance is short
 * and the prior dominates. */
oc_estimate oc_wheel_speed_mismatch(const oc_wheel_speed *state, const oc_params *params, double track);

#endif

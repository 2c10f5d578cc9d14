#ifndef OC_WHEEL_SPEED_H
#define OC_WHEEL_SPEED_H
/* 5.5.4: the motion by the two wheel speeds of one axle.
 *
 * Speeds are for a nominal wheel radius, (20); mismatch is r_l/r_r - 1, of the left and right radius. A mismatch has
 * the effect of a bend of radius track/mismatch. Without a gyro it is identifiable only by the net turn, which is small
 * over a long distance. */

#include <stdint.h>

#include "estimate.h"
#include "params.h"

typedef struct {
    double difference; /* m, distance of the right wheel less that of the left */
    double distance;   /* m, of the axle's centre */
    double time;       /* s */
} oc_wheel_speed;

/* (21) The front wheels' mean angle, rad, left positive; equal radii where mismatch is 0. Speeds in m/s. */
double oc_wheel_speed_front_angle(double wheelbase, double track, double left, double right, double mismatch);

/* 1/m; 5.5.4's second bullet. Rear: the difference over track and speed; 0 where no wheel turns. */
double oc_wheel_speed_rear_curvature(double track, double left, double right, double mismatch);

/* 1/m; tan of (21) over the wheelbase. */
double oc_wheel_speed_front_curvature(double wheelbase, double track, double left, double right, double mismatch);

void oc_wheel_speed_update(oc_wheel_speed *state, double left, double right, double tick_s);

/* The mismatch by its prior and that of the net turn; track: m. Unobservable while the distance is short and the prior
 * dominates. */
oc_estimate oc_wheel_speed_mismatch(const oc_wheel_speed *state, const oc_params *params, double track);

#endif

#ifndef OC_VEHICLE_H
#define OC_VEHICLE_H
/* The truck's data, and steady-state cornering. */

#include "front_wheel.h"

typedef struct {
    double wheelbase;      /* m, equivalent wheelbase where there are more than two axles (Winkler), 1 to 20 */
    double steering_ratio; /* steering wheel angle per front wheel angle near centre, 1 to 60 */
    double traffic_side;   /* of the road: 1 right, -1 left, 0 unknown; a crown falls to it */
    oc_ratio ratio;        /* from steering wheel to front wheels off centre; its terms 0 where it is constant */
    double track_width_front, track_width_rear; /* m, between the middles of left and right tyres, 1 to 3; 0: unknown */
} oc_vehicle;

/* (7) The Ackermann angle L/R at the front wheels, rad; curvature in 1/m. */
double oc_ackermann_angle(const oc_vehicle *vehicle, double curvature);

/* (10), (31), (37): the steering wheel angle that holds a steady state, rad, without offset. Understeer gradient is
 * K_us/g in rad/(m/s^2) at the road wheel, lateral acceleration in m/s^2. Tyres are linear here: below some 4 m/s^2. */
double oc_steady_state_angle(const oc_vehicle *vehicle, double curvature, double understeer_gradient,
                             double lateral_acceleration);

#endif

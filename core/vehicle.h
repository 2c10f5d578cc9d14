#ifndef OC_VEHICLE_H
#define OC_VEHICLE_H
/* The truck's data. */

#include "front_wheel.h"

typedef struct {
    double wheelbase;      /* m, equivalent wheelbase where there are more than two axles (Winkler), 1 to 20 */
    double steering_ratio; /* steering wheel angle per front wheel angle near centre, 1 to 60 */
    double traffic_side;   /* of the road: 1 right, -1 left, 0 unknown; a crown falls to it */
    oc_ratio ratio;        /* from steering wheel to front wheels off centre; its terms 0 where it is constant */
    double track_width_front, track_width_rear; /* m, between the middles of left and right tyres, 1 to 3; 0: unknown */
} oc_vehicle;

#endif

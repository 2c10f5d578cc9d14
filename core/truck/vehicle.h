#ifndef OC_VEHICLE_H
#define OC_VEHICLE_H
/* The truck's data. */

#include "front_wheel.h"

typedef struct {
    double wheelbase;      /* m, 1 to 20; equivalent wheelbase of more than two axles (Winkler) */
    double steering_ratio; /* steering wheel angle over front wheel angle near the centre, 1 to 60 */
    double traffic_side;   /* 1 right, -1 left, 0 unknown; the crown falls to it */
    oc_ratio ratio;        /* as a function of the steering wheel angle; its terms are 0 where it is constant */
    double track_width_front, track_width_rear; /* m, 1 to 3, between the centres of left and right tyres; 0: unknown */
} oc_vehicle;

#endif

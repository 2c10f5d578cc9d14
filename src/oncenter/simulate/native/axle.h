#ifndef SIM_AXLE_H
#define SIM_AXLE_H
/* An axle: where it is, what steers it, and tyres whose force follows the slip angle over some rolling, (5) (6). */

#include "tyre.h"

typedef struct {
    double distance;          /* m, ahead of the truck's centre of gravity, or of a trailer's hitch */
    double steer_share;       /* of the front wheel angle; 0: not steered */
    double compliance;        /* rad/N, how far its side force turns the wheels back */
    double relaxation_length; /* m, sigma_r of (6); 0: force at once, for linear tyres only */
    double scrub_stiffness;   /* N m^2, yaw moment against a curvature (1/m) of dual tyres, which roll as one */
    sim_tyre tyre;
} sim_axle;

/* N/rad: how hard the axle answers a small angle between steering and motion, its compliance included. */
double sim_axle_stiffness(const sim_axle *axle);

/* N, now: `lagging`, or what the linear tyres give at once. front_wheel_angle: rad, as the steering sets it; direction:
 * rad, in which the axle moves. */
double sim_axle_force(const sim_axle *axle, double lagging, double front_wheel_angle, double direction);

/* N/s, how the lagging force changes at speed (m/s); 0 where there is no lag. */
double sim_axle_force_slope(const sim_axle *axle, double lagging, double front_wheel_angle, double direction,
                            double speed);

#endif

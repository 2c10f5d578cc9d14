#ifndef SIM_AXLE_H
#define SIM_AXLE_H
/* An axle: place, share of the steering, and tyres whose force lags the slip angle by a rolling distance, (5), (6). */

#include "tyre.h"

typedef struct {
    double distance;          /* m, ahead of the truck's centre of gravity or of a trailer's hitch */
    double steer_share;       /* of the front wheel angle; 0: not steered */
    double compliance;        /* rad/N, by which its lateral force turns the wheels back */
    double relaxation_length; /* m, sigma_r of (6); 0: no lag, for linear tyres only */
    double scrub_stiffness;   /* N m^2, yaw moment of dual tyres per curvature, against it */
    sim_tyre tyre;
} sim_axle;

/* N/rad, lateral force per small angle between steering and motion; includes the compliance. */
double sim_axle_stiffness(const sim_axle *axle);

/* N, lateral force: `lagging`, or that of linear tyres without lag. front_wheel_angle: rad, as set by the steering;
 * direction: rad, of the axle's motion. */
double sim_axle_force(const sim_axle *axle, double lagging, double front_wheel_angle, double direction);

/* N/s, rate of the lagging force at speed (m/s); 0 without lag. */
double sim_axle_force_slope(const sim_axle *axle, double lagging, double front_wheel_angle, double direction,
                            double speed);

#endif

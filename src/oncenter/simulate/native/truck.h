#ifndef SIM_TRUCK_H
#define SIM_TRUCK_H
/* The dynamic single-track truck (13) with lagging tyres (5), (6), for several axles, with or without a semitrailer.
 *
 * Slip angles are small, the speed is given. Below walking speed slip angles are undefined: there, and backwards, the
 * truck rolls as its axles point, by (7) with the equivalent wheelbase. Between 0.5 and 2 m/s the time derivatives of
 * both models are blended. */

#include <stdint.h>

#include "axle.h"
#include "trailer.h"

enum { SIM_AXLES_MAX = 4 };

typedef struct {
    double mass;        /* kg, without trailer */
    double yaw_inertia; /* kg m^2, about the centre of gravity */
    int32_t axle_count; /* 2 to SIM_AXLES_MAX */
    sim_axle axles[SIM_AXLES_MAX];
    double roll_per_acceleration; /* rad/(m/s^2), body roll in a steady bend; 0: none */
    double roll_frequency;        /* rad/s, natural */
    double roll_damping;          /* 1, share of critical */
    double hitch_distance;        /* m, ahead of the centre of gravity, thus negative */
    sim_trailer trailer;
} sim_truck;

typedef struct {
    double lateral_speed; /* m/s, of the centre of gravity */
    double yaw_rate;      /* rad/s */
    double axle_forces[SIM_AXLES_MAX]; /* N, lateral forces, left positive */
    double roll;          /* rad, of the body against the road, right side down positive */
    double roll_rate;     /* rad/s */
    sim_trailer_state trailer;
} sim_truck_state;

/* External inputs of the truck, constant over a step. */
typedef struct {
    double front_wheel_angle; /* rad, as set by the steering, without the axle's compliance */
    double speed;             /* m/s, negative backwards: there the truck rolls as its axles point */
    double gravity_to_left;   /* m/s^2, component of gravity to the left on a banked road */
    double wind_force;        /* N, from the side, left positive */
    double wind_arm;          /* m, its place ahead of the centre of gravity */
    double brake_moment;      /* N m, yaw moment of brakes on one side, to the left */
} sim_truck_input;

/* One Runge-Kutta step. */
void sim_truck_step(sim_truck_state *state, const sim_truck *truck, const sim_truck_input *input, double step_s);

/* m/s^2, specific force at the centre of gravity along the road's surface. */
double sim_truck_lateral_acceleration(const sim_truck_state *state, const sim_truck *truck,
                                      const sim_truck_input *input);

/* Steady motion with linear tyres: (10) for several axles, by superposition of a curvature (1/m) at zero speed and a
 * lateral acceleration (m/s^2, specific force) on a straight. */
typedef struct {
    double front_wheel_angle; /* rad */
    double direction;         /* rad, of the centre of gravity's motion relative to the truck */
    double steered_force;     /* N, of all steered wheels */
} sim_stance;

sim_stance sim_truck_stance(const sim_truck *truck, double curvature, double lateral_acceleration);

/* N, lateral force of all steered wheels. */
double sim_truck_steered_force(const sim_truck_state *state, const sim_truck *truck);

/* For another ground: multiplies the cornering stiffness of all steered axles by `front`, that of all others, including
 * the trailer's, by `rear`. */
void sim_truck_scale_stiffness(sim_truck *truck, double front, double rear);

/* Interpolates between two trucks with the same axles and tyre models but different loads, as while an axle is lifted:
 * share 0 is `first`, 1 is `second`. */
sim_truck sim_truck_between(const sim_truck *first, const sim_truck *second, double share);

#endif

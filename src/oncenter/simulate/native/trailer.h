#ifndef SIM_TRAILER_H
#define SIM_TRAILER_H
/* A semitrailer behind its hitch, at any articulation short of a right angle. It brakes and is drawn without pushing
 * the truck aside: only the side force at the hitch and the fifth wheel's dry friction pass between the two. */

#include <stdint.h>

#include "axle.h"

enum { SIM_TRAILER_AXLES_MAX = 3 };

typedef struct {
    double mass;                    /* kg */
    double yaw_inertia;             /* kg m^2, about its centre of gravity */
    double gravity_centre_distance; /* m, of its centre of gravity behind the hitch */
    int32_t axle_count;             /* 0: no trailer */
    sim_axle axles[SIM_TRAILER_AXLES_MAX]; /* distance: ahead of the hitch, thus negative */
    double friction;                /* N m, of the fifth wheel against articulation; 0: none */
} sim_trailer;

typedef struct {
    double yaw_rate;     /* rad/s */
    double articulation; /* rad, truck's heading less trailer's */
    double axle_forces[SIM_TRAILER_AXLES_MAX]; /* N */
    double friction_share; /* -1 to 1, of the friction that is at work; positive turns the trailer to the left */
} sim_trailer_state;

/* How the hitch moves, in the truck's axes. */
typedef struct {
    double speed;         /* m/s, forward */
    double lateral_speed; /* m/s */
    double yaw_rate;      /* rad/s, the truck's */
    double lateral_acceleration; /* m/s^2, as it would be without trailer */
    double mobility;      /* 1/kg, how much of that each N of side force at the hitch takes away */
    double gravity_to_left; /* m/s^2 */
} sim_hitch;

/* What a trailer asks of its hitch in steady motion: a share of its mass there, force per curvature, per moment. */
typedef struct {
    double mass;   /* kg, N per m/s^2 of lateral acceleration */
    double scrub;  /* N m, N per 1/m of curvature: what turning several axles or dual tyres takes */
    double per_moment; /* 1/m, N that it takes off the hitch per N m that turns it to the left */
} sim_trailer_load;

sim_trailer_load sim_trailer_load_of(const sim_trailer *trailer);

/* N m, by which the fifth wheel turns the trailer to the left and the truck to the right. */
double sim_trailer_friction(const sim_trailer_state *state, const sim_trailer *trailer);

/* Slope of the state with tyres at work; returns the side force by which the hitch pulls the truck to the right, N. */
double sim_trailer_slope(const sim_trailer_state *state, const sim_trailer *trailer, const sim_hitch *hitch,
                         sim_trailer_state *slope);

/* Slope at walking speed: the trailer rolls where its axles point, and settles to that within settling_s. */
void sim_trailer_rolling_slope(const sim_trailer_state *state, const sim_trailer *trailer, const sim_hitch *hitch,
                               double settling_s, sim_trailer_state *slope);

#endif

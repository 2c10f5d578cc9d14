#ifndef SIM_TRAILER_H
#define SIM_TRAILER_H
/* A semitrailer behind its hitch, at any articulation below a right angle. Only the lateral force at the hitch and the
 * dry friction of the fifth wheel act between truck and trailer; longitudinal forces do not. */

#include <stdint.h>

#include "axle.h"

enum { SIM_TRAILER_AXLES_MAX = 3 };

typedef struct {
    double mass;                    /* kg */
    double yaw_inertia;             /* kg m^2, about its centre of gravity */
    double gravity_centre_distance; /* m, centre of gravity behind the hitch */
    int32_t axle_count;             /* 0: no trailer */
    sim_axle axles[SIM_TRAILER_AXLES_MAX]; /* distance: ahead of the hitch, thus negative */
    double friction;                /* N m, of the fifth wheel against articulation; 0: none */
} sim_trailer;

typedef struct {
    double yaw_rate;     /* rad/s */
    double articulation; /* rad, truck's heading less trailer's */
    double axle_forces[SIM_TRAILER_AXLES_MAX]; /* N */
    double friction_share; /* -1 to 1, of the full friction; positive turns the trailer to the left */
} sim_trailer_state;

/* Motion of the hitch, in the truck's axes. */
typedef struct {
    double speed;         /* m/s, forward */
    double lateral_speed; /* m/s */
    double yaw_rate;      /* rad/s, the truck's */
    double lateral_acceleration; /* m/s^2, without the trailer's force */
    double mobility;      /* 1/kg, reduction of it per N of lateral force at the hitch */
    double gravity_to_left; /* m/s^2 */
} sim_hitch;

/* Load of the hitch in steady motion: by lateral acceleration, curvature and moment. */
typedef struct {
    double mass;   /* kg, N per m/s^2 of lateral acceleration */
    double scrub;  /* N m, N per 1/m of curvature, by several axles or dual tyres */
    double per_moment; /* 1/m, reduction in N per N m that turns the trailer to the left */
} sim_trailer_load;

sim_trailer_load sim_trailer_load_of(const sim_trailer *trailer);

/* N m, by which the fifth wheel turns the trailer to the left and the truck to the right. */
double sim_trailer_friction(const sim_trailer_state *state, const sim_trailer *trailer);

/* Time derivative of the state, by tyre forces. Returns the lateral force of the hitch on the truck, N to the right. */
double sim_trailer_slope(const sim_trailer_state *state, const sim_trailer *trailer, const sim_hitch *hitch,
                         sim_trailer_state *slope);

/* Time derivative at walking speed: the trailer rolls in the direction of its axles, with the time constant
 * settling_s. */
void sim_trailer_rolling_slope(const sim_trailer_state *state, const sim_trailer *trailer, const sim_hitch *hitch,
                               double settling_s, sim_trailer_state *slope);

#endif

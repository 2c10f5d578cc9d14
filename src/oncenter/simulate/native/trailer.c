#include "trailer.h"

#include <math.h>

static const double COSINE_MIN = 0.1; /* the model holds up to nearly a right angle */
static const double SLIDES_BY_RAD = 0.0035; /* 0.2 deg of articulation, from zero to full friction */

/* Of all axles: sum of stiffness, mean distance behind the hitch by stiffness, moment per curvature. */
typedef struct {
    double stiffness; /* N/rad */
    double distance;  /* m */
    double scrub;     /* N m^2 */
} axle_group;

static axle_group group_of(const sim_trailer *trailer)
{
    axle_group group = {0.0, 0.0, 0.0};
    for (int32_t k = 0; k < trailer->axle_count; ++k) {
        const double C = sim_axle_stiffness(&trailer->axles[k]);
        group.stiffness += C;
        group.distance -= C * trailer->axles[k].distance;
    }
    group.distance /= group.stiffness;
    for (int32_t k = 0; k < trailer->axle_count; ++k) {
        const double off = trailer->axles[k].distance + group.distance;
        group.scrub += sim_axle_stiffness(&trailer->axles[k]) * off * off + trailer->axles[k].scrub_stiffness;
    }
    return group;
}

double sim_trailer_friction(const sim_trailer_state *state, const sim_trailer *trailer)
{
    return trailer->friction * state->friction_share;
}

/* 1/s; Dahl: elastic until it slides, constant at rest. */
static double friction_slope(const sim_trailer_state *state, const sim_trailer *trailer, double articulation_rate)
{
    if (trailer->friction <= 0.0)
        return 0.0;
    return (articulation_rate - fabs(articulation_rate) * state->friction_share) / SLIDES_BY_RAD;
}

sim_trailer_load sim_trailer_load_of(const sim_trailer *trailer)
{
    const axle_group group = group_of(trailer);
    const sim_trailer_load load = {
        trailer->mass * (1.0 - trailer->gravity_centre_distance / group.distance),
        group.scrub / group.distance,
        1.0 / group.distance,
    };
    return load;
}

double sim_trailer_slope(const sim_trailer_state *state, const sim_trailer *trailer, const sim_hitch *hitch,
                         sim_trailer_state *slope)
{
    const double sine = sin(state->articulation), cosine = fmax(cos(state->articulation), COSINE_MIN);
    const double forward = hitch->speed * cosine - hitch->lateral_speed * sine;
    const double sideways = hitch->speed * sine + hitch->lateral_speed * cosine;
    const double c = trailer->gravity_centre_distance;

    double force = 0.0, moment = sim_trailer_friction(state, trailer); /* about the centre of gravity */
    for (int32_t k = 0; k < trailer->axle_count; ++k) {
        const sim_axle *axle = &trailer->axles[k];
        const double direction = (sideways + axle->distance * state->yaw_rate) / forward;
        const double lagging = state->axle_forces[k];
        const double now = sim_axle_force(axle, lagging, 0.0, direction);
        force += now;
        moment += (axle->distance + c) * now - axle->scrub_stiffness * state->yaw_rate / forward;
        slope->axle_forces[k] = sim_axle_force_slope(axle, lagging, 0.0, direction, forward);
    }

    /* The hitch force, across the trailer, for equal acceleration of truck and trailer there. */
    const double free = cosine * hitch->lateral_acceleration - sine * hitch->lateral_speed * hitch->yaw_rate;
    const double missing = free - c * moment / trailer->yaw_inertia - force / trailer->mass
                           - cosine * hitch->gravity_to_left;
    const double hitch_force = missing
                               / (1.0 / trailer->mass + cosine * cosine * hitch->mobility
                                  + c * c / trailer->yaw_inertia);
    slope->yaw_rate = (moment + c * hitch_force) / trailer->yaw_inertia;
    slope->articulation = hitch->yaw_rate - state->yaw_rate;
    slope->friction_share = friction_slope(state, trailer, slope->articulation);
    return cosine * hitch_force;
}

void sim_trailer_rolling_slope(const sim_trailer_state *state, const sim_trailer *trailer, const sim_hitch *hitch,
                               double settling_s, sim_trailer_state *slope)
{
    const axle_group group = group_of(trailer);
    const double sideways = hitch->speed * sin(state->articulation) + hitch->lateral_speed * cos(state->articulation);
    const double length = group.distance + group.scrub / (group.stiffness * group.distance);
    slope->yaw_rate = (sideways / length - state->yaw_rate) / settling_s;
    slope->articulation = hitch->yaw_rate - state->yaw_rate;
    slope->friction_share = friction_slope(state, trailer, slope->articulation);

    const double a_y = hitch->speed * state->yaw_rate - hitch->gravity_to_left;
    const double carried = trailer->mass * a_y * trailer->gravity_centre_distance / group.distance
                           + sim_trailer_friction(state, trailer) / group.distance;
    for (int32_t k = 0; k < trailer->axle_count; ++k) {
        const double share = sim_axle_stiffness(&trailer->axles[k]) / group.stiffness;
        slope->axle_forces[k] = (share * carried - state->axle_forces[k]) / settling_s;
    }
}

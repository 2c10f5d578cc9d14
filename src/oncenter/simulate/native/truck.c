#include "truck.h"

static const double ROLLS_BELOW_M_S = 0.5;   /* below it only the wheels' direction counts */
static const double SLIPS_ABOVE_M_S = 2.0;   /* above it only tyre forces count */
static const double ROLLING_SETTLES_S = 0.1; /* time constant of a rolling truck */

/* Share of the dynamic model, 0 to 1, smooth at both ends. */
static double dynamic_share(double speed)
{
    const double x = (speed - ROLLS_BELOW_M_S) / (SLIPS_ABOVE_M_S - ROLLS_BELOW_M_S);
    if (x <= 0.0)
        return 0.0;
    if (x >= 1.0)
        return 1.0;
    return x * x * (3.0 - 2.0 * x);
}

static sim_hitch hitch_of(const sim_truck_state *state, const sim_truck *truck, const sim_truck_input *input)
{
    const sim_hitch hitch = {
        .speed = input->speed,
        .lateral_speed = state->lateral_speed + truck->hitch_distance * state->yaw_rate,
        .yaw_rate = state->yaw_rate,
        .mobility = 1.0 / truck->mass + truck->hitch_distance * truck->hitch_distance / truck->yaw_inertia,
        .gravity_to_left = input->gravity_to_left,
    };
    return hitch;
}

/* (15) with (5), (6), (16) to (18), for any number of axles. */
static void dynamic_slope(const sim_truck_state *state, const sim_truck *truck, const sim_truck_input *input,
                          sim_truck_state *slope)
{
    const double v = input->speed, r = state->yaw_rate;
    double force = input->wind_force, moment = input->wind_force * input->wind_arm + input->brake_moment;
    for (int32_t k = 0; k < truck->axle_count; ++k) {
        const sim_axle *axle = &truck->axles[k];
        const double direction = (state->lateral_speed + axle->distance * r) / v;
        const double now = sim_axle_force(axle, state->axle_forces[k], input->front_wheel_angle, direction);
        force += now;
        moment += axle->distance * now - axle->scrub_stiffness * r / v;
        slope->axle_forces[k] =
            sim_axle_force_slope(axle, state->axle_forces[k], input->front_wheel_angle, direction, v);
    }
    if (truck->trailer.axle_count > 0) {
        sim_hitch hitch = hitch_of(state, truck, input);
        moment -= sim_trailer_friction(&state->trailer, &truck->trailer);
        hitch.lateral_acceleration = force / truck->mass + input->gravity_to_left
                                     + truck->hitch_distance * moment / truck->yaw_inertia;
        const double pull = sim_trailer_slope(&state->trailer, &truck->trailer, &hitch, &slope->trailer);
        force -= pull;
        moment -= truck->hitch_distance * pull;
    }
    slope->lateral_speed = force / truck->mass + input->gravity_to_left - v * r;
    slope->yaw_rate = moment / truck->yaw_inertia;
}

/* Sums over the axles: C stiffness, x place, s steer share. */
typedef struct {
    double C, Cx, Cxx; /* Cxx includes the dual tyres' scrub */
    double Cs, Csx;
} axle_sums;

static axle_sums sums_of(const sim_truck *truck)
{
    axle_sums sums = {0.0, 0.0, 0.0, 0.0, 0.0};
    for (int32_t k = 0; k < truck->axle_count; ++k) {
        const sim_axle *axle = &truck->axles[k];
        const double C = sim_axle_stiffness(axle), x = axle->distance;
        sums.C += C;
        sums.Cx += C * x;
        sums.Cxx += C * x * x + axle->scrub_stiffness;
        sums.Cs += C * axle->steer_share;
        sums.Csx += C * axle->steer_share * x;
    }
    return sums;
}

/* The stance in which the tyres have this lateral force (N) and yaw moment (N m) at this curvature. */
static sim_stance stance_of(const axle_sums *s, double curvature, double force, double moment)
{
    const double f = force + s->Cx * curvature;
    const double g = moment + s->Cxx * curvature;
    const double determinant = s->Csx * s->C - s->Cs * s->Cx;
    const sim_stance result = {
        .front_wheel_angle = (s->C * g - s->Cx * f) / determinant,
        .direction = (s->Cs * g - s->Csx * f) / determinant,
    };
    return result;
}

static double force_in(const sim_stance *stance, const sim_axle *axle, double curvature)
{
    const double slip =
        axle->steer_share * stance->front_wheel_angle - stance->direction - axle->distance * curvature;
    return sim_axle_stiffness(axle) * slip;
}

static sim_trailer_load trailer_load(const sim_truck *truck)
{
    const sim_trailer_load none = {0.0, 0.0, 0.0};
    return truck->trailer.axle_count > 0 ? sim_trailer_load_of(&truck->trailer) : none;
}

sim_stance sim_truck_stance(const sim_truck *truck, double curvature, double lateral_acceleration)
{
    const axle_sums sums = sums_of(truck);
    const sim_trailer_load load = trailer_load(truck);
    const double hitch_force = load.mass * lateral_acceleration + load.scrub * curvature;
    sim_stance stance = stance_of(&sums, curvature, truck->mass * lateral_acceleration + hitch_force,
                                  truck->hitch_distance * hitch_force);
    for (int32_t k = 0; k < truck->axle_count; ++k)
        if (truck->axles[k].steer_share > 0.0)
            stance.steered_force += force_in(&stance, &truck->axles[k], curvature);
    return stance;
}

/* (7): the truck rolls as its axles point; the axle forces follow by stiffness and place. */
static void rolling_slope(const sim_truck_state *state, const sim_truck *truck, const sim_truck_input *input,
                          sim_truck_state *slope)
{
    const axle_sums sums = sums_of(truck);
    const sim_trailer_load load = trailer_load(truck);
    const double x = truck->hitch_distance;

    const sim_stance in_bend = stance_of(&sums, 1.0, load.scrub, x * load.scrub); /* of 1/m, at zero speed */
    const double curvature = input->front_wheel_angle / in_bend.front_wheel_angle;
    slope->yaw_rate = (input->speed * curvature - state->yaw_rate) / ROLLING_SETTLES_S;
    slope->lateral_speed = (input->speed * curvature * in_bend.direction - state->lateral_speed) / ROLLING_SETTLES_S;

    const double a_y = input->speed * state->yaw_rate - input->gravity_to_left;
    const double friction = sim_trailer_friction(&state->trailer, &truck->trailer);
    const double hitch_force = load.mass * a_y + load.scrub * curvature - friction * load.per_moment;
    const sim_stance now = stance_of(&sums, curvature, truck->mass * a_y + hitch_force - input->wind_force,
                                 x * hitch_force + friction - input->wind_force * input->wind_arm
                                     - input->brake_moment);
    for (int32_t k = 0; k < truck->axle_count; ++k) {
        const double force = force_in(&now, &truck->axles[k], curvature);
        slope->axle_forces[k] = (force - state->axle_forces[k]) / ROLLING_SETTLES_S;
    }
    if (truck->trailer.axle_count == 0)
        return;
    const sim_hitch hitch = hitch_of(state, truck, input);
    sim_trailer_rolling_slope(&state->trailer, &truck->trailer, &hitch, ROLLING_SETTLES_S, &slope->trailer);
}

/* a + weight * b, of all members that Runge-Kutta integrates: all except roll. */
static void add(const sim_truck *truck, const sim_truck_state *a, double weight, const sim_truck_state *b,
                sim_truck_state *sum)
{
    sum->lateral_speed = a->lateral_speed + weight * b->lateral_speed;
    sum->yaw_rate = a->yaw_rate + weight * b->yaw_rate;
    for (int32_t k = 0; k < truck->axle_count; ++k)
        sum->axle_forces[k] = a->axle_forces[k] + weight * b->axle_forces[k];
    if (truck->trailer.axle_count == 0)
        return;
    sum->trailer.yaw_rate = a->trailer.yaw_rate + weight * b->trailer.yaw_rate;
    sum->trailer.articulation = a->trailer.articulation + weight * b->trailer.articulation;
    sum->trailer.friction_share = a->trailer.friction_share + weight * b->trailer.friction_share;
    for (int32_t k = 0; k < truck->trailer.axle_count; ++k)
        sum->trailer.axle_forces[k] = a->trailer.axle_forces[k] + weight * b->trailer.axle_forces[k];
}

static void slope_of(const sim_truck_state *state, const sim_truck *truck, const sim_truck_input *input,
                     sim_truck_state *slope)
{
    const double share = dynamic_share(input->speed);
    if (share >= 1.0) {
        dynamic_slope(state, truck, input, slope);
        return;
    }
    rolling_slope(state, truck, input, slope);
    if (share <= 0.0)
        return;
    sim_truck_state dynamic = {0}, difference = {0};
    dynamic_slope(state, truck, input, &dynamic);
    add(truck, &dynamic, -1.0, slope, &difference);
    add(truck, slope, share, &difference, slope);
}

static double acceleration_of(const sim_truck_state *state, const sim_truck_state *slope,
                              const sim_truck_input *input)
{
    return slope->lateral_speed + input->speed * state->yaw_rate - input->gravity_to_left;
}

/* The body rolls outward on its springs by the axles' lateral force. */
static void roll_step(sim_truck_state *state, const sim_truck *truck, double lateral_acceleration, double step_s)
{
    const double w = truck->roll_frequency;
    const double rest = truck->roll_per_acceleration * lateral_acceleration;
    state->roll_rate += (w * w * (rest - state->roll) - 2.0 * truck->roll_damping * w * state->roll_rate) * step_s;
    state->roll += state->roll_rate * step_s;
}

/* For tyres without lag. */
static void settle_forces(sim_truck_state *state, const sim_truck *truck, const sim_truck_input *input)
{
    const double v = input->speed;
    for (int32_t k = 0; k < truck->axle_count; ++k) {
        const double direction = (state->lateral_speed + truck->axles[k].distance * state->yaw_rate) / v;
        state->axle_forces[k] =
            sim_axle_force(&truck->axles[k], state->axle_forces[k], input->front_wheel_angle, direction);
    }
}

void sim_truck_step(sim_truck_state *state, const sim_truck *truck, const sim_truck_input *input, double step_s)
{
    sim_truck_state k1, k2, k3, k4, at;
    slope_of(state, truck, input, &k1);
    add(truck, state, 0.5 * step_s, &k1, &at);
    slope_of(&at, truck, input, &k2);
    add(truck, state, 0.5 * step_s, &k2, &at);
    slope_of(&at, truck, input, &k3);
    add(truck, state, step_s, &k3, &at);
    slope_of(&at, truck, input, &k4);

    if (truck->roll_per_acceleration > 0.0)
        roll_step(state, truck, acceleration_of(state, &k1, input), step_s);
    add(truck, &k1, 1.0, &k4, &k1);
    add(truck, &k2, 1.0, &k3, &k2);
    add(truck, &k1, 2.0, &k2, &k1);
    add(truck, state, step_s / 6.0, &k1, state);
    if (input->speed > ROLLS_BELOW_M_S)
        settle_forces(state, truck, input);
}

double sim_truck_lateral_acceleration(const sim_truck_state *state, const sim_truck *truck,
                                      const sim_truck_input *input)
{
    sim_truck_state slope;
    slope_of(state, truck, input, &slope);
    return acceleration_of(state, &slope, input);
}

double sim_truck_steered_force(const sim_truck_state *state, const sim_truck *truck)
{
    double force = 0.0;
    for (int32_t k = 0; k < truck->axle_count; ++k)
        if (truck->axles[k].steer_share > 0.0)
            force += state->axle_forces[k];
    return force;
}

static double between(double first, double second, double share)
{
    return first + share * (second - first);
}

static void axle_between(sim_axle *axle, const sim_axle *second, double share)
{
    axle->distance = between(axle->distance, second->distance, share);
    axle->scrub_stiffness = between(axle->scrub_stiffness, second->scrub_stiffness, share);
    axle->tyre.cornering_stiffness = between(axle->tyre.cornering_stiffness, second->tyre.cornering_stiffness, share);
    axle->tyre.D = between(axle->tyre.D, second->tyre.D, share);
}

static void trailer_between(sim_trailer *trailer, const sim_trailer *second, double share)
{
    trailer->mass = between(trailer->mass, second->mass, share);
    trailer->yaw_inertia = between(trailer->yaw_inertia, second->yaw_inertia, share);
    trailer->gravity_centre_distance =
        between(trailer->gravity_centre_distance, second->gravity_centre_distance, share);
    for (int32_t k = 0; k < trailer->axle_count; ++k)
        axle_between(&trailer->axles[k], &second->axles[k], share);
}

sim_truck sim_truck_between(const sim_truck *first, const sim_truck *second, double share)
{
    sim_truck truck = *first;
    truck.mass = between(first->mass, second->mass, share);
    truck.yaw_inertia = between(first->yaw_inertia, second->yaw_inertia, share);
    truck.hitch_distance = between(first->hitch_distance, second->hitch_distance, share);
    for (int32_t k = 0; k < truck.axle_count; ++k)
        axle_between(&truck.axles[k], &second->axles[k], share);
    trailer_between(&truck.trailer, &second->trailer, share);
    return truck;
}

void sim_truck_scale_stiffness(sim_truck *truck, double front, double rear)
{
    for (int32_t k = 0; k < truck->axle_count; ++k)
        truck->axles[k].tyre.cornering_stiffness *= truck->axles[k].steer_share > 0.0 ? front : rear;
    for (int32_t k = 0; k < truck->trailer.axle_count; ++k)
        truck->trailer.axles[k].tyre.cornering_stiffness *= rear;
}

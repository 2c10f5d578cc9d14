#include "truck.h"

static const double ROLLS_BELOW_M_S = 0.5;   /* only the wheels' direction counts */
static const double SLIPS_ABOVE_M_S = 2.0;   /* only the tyres' forces count */
static const double ROLLING_SETTLES_S = 0.1; /* how soon rolling truck follows its wheels */

/* Share of the dynamic model: 0 to 1 with level ends. */
static double dynamic_share(double speed)
{
    const double x = (speed - ROLLS_BELOW_M_S) / (SLIPS_ABOVE_M_S - ROLLS_BELOW_M_S);
    if (x <= 0.0)
        return 0.0;
    if (x >= 1.0)
        return 1.0;
    return x * x * (3.0 - 2.0 * x);
}

/* (16), (18): the axle's force once the tyres have rolled in. */
static double settled_front_force(const sim_truck_state *state, const sim_truck *truck, double angle, double speed)
{
    const double slip = (state->lateral_speed + truck->front_axle_distance * state->yaw_rate) / speed - angle;
    return -truck->front_cornering_stiffness * slip;
}

/* (17), (18) */
static double settled_rear_force(const sim_truck_state *state, const sim_truck *truck, double speed)
{
    const double slip = (state->lateral_speed - truck->rear_axle_distance * state->yaw_rate) / speed;
    return -truck->rear_cornering_stiffness * slip;
}

/* (15) with (5) and (6) */
static sim_truck_state dynamic_slope(const sim_truck_state *state, const sim_truck *truck, double angle,
                                     double speed, double gravity_to_left)
{
    const double settled_front = settled_front_force(state, truck, angle, speed);
    const double settled_rear = settled_rear_force(state, truck, speed);
    const double front = truck->front_relaxation_length > 0.0 ? state->front_force : settled_front;
    const double rear = truck->rear_relaxation_length > 0.0 ? state->rear_force : settled_rear;

    sim_truck_state slope = {0};
    slope.lateral_speed = (front + rear) / truck->mass + gravity_to_left - speed * state->yaw_rate;
    slope.yaw_rate = (truck->front_axle_distance * front - truck->rear_axle_distance * rear) / truck->yaw_inertia;
    if (truck->front_relaxation_length > 0.0)
        slope.front_force = (settled_front - front) * speed / truck->front_relaxation_length;
    if (truck->rear_relaxation_length > 0.0)
        slope.rear_force = (settled_rear - rear) * speed / truck->rear_relaxation_length;
    return slope;
}

/* (7): the truck rolls as its wheels point; the axles carry what that takes, by their lever arms. */
static sim_truck_state rolling_slope(const sim_truck_state *state, const sim_truck *truck, double angle, double speed,
                                     double gravity_to_left)
{
    const double wheelbase = truck->front_axle_distance + truck->rear_axle_distance;
    const double yaw_rate = speed * angle / wheelbase;
    const double lateral_speed = truck->rear_axle_distance * yaw_rate;
    const double force = truck->mass * (speed * state->yaw_rate - gravity_to_left);

    sim_truck_state slope;
    slope.lateral_speed = (lateral_speed - state->lateral_speed) / ROLLING_SETTLES_S;
    slope.yaw_rate = (yaw_rate - state->yaw_rate) / ROLLING_SETTLES_S;
    slope.front_force = (force * truck->rear_axle_distance / wheelbase - state->front_force) / ROLLING_SETTLES_S;
    slope.rear_force = (force * truck->front_axle_distance / wheelbase - state->rear_force) / ROLLING_SETTLES_S;
    return slope;
}

static sim_truck_state sum(const sim_truck_state *a, double weight, const sim_truck_state *b)
{
    const sim_truck_state result = {
        a->lateral_speed + weight * b->lateral_speed,
        a->yaw_rate + weight * b->yaw_rate,
        a->front_force + weight * b->front_force,
        a->rear_force + weight * b->rear_force,
    };
    return result;
}

static sim_truck_state slope_of(const sim_truck_state *state, const sim_truck *truck, double angle, double speed,
                                double gravity_to_left)
{
    const double share = dynamic_share(speed);
    if (share >= 1.0)
        return dynamic_slope(state, truck, angle, speed, gravity_to_left);
    const sim_truck_state rolling = rolling_slope(state, truck, angle, speed, gravity_to_left);
    if (share <= 0.0)
        return rolling;
    const sim_truck_state dynamic = dynamic_slope(state, truck, angle, speed, gravity_to_left);
    const sim_truck_state difference = sum(&dynamic, -1.0, &rolling);
    return sum(&rolling, share, &difference);
}

void sim_truck_step(sim_truck_state *state, const sim_truck *truck, double front_wheel_angle, double speed,
                    double gravity_to_left, double step_s)
{
    const sim_truck_state k1 = slope_of(state, truck, front_wheel_angle, speed, gravity_to_left);
    const sim_truck_state at2 = sum(state, 0.5 * step_s, &k1);
    const sim_truck_state k2 = slope_of(&at2, truck, front_wheel_angle, speed, gravity_to_left);
    const sim_truck_state at3 = sum(state, 0.5 * step_s, &k2);
    const sim_truck_state k3 = slope_of(&at3, truck, front_wheel_angle, speed, gravity_to_left);
    const sim_truck_state at4 = sum(state, step_s, &k3);
    const sim_truck_state k4 = slope_of(&at4, truck, front_wheel_angle, speed, gravity_to_left);

    const sim_truck_state k14 = sum(&k1, 1.0, &k4);
    const sim_truck_state k23 = sum(&k2, 1.0, &k3);
    const sim_truck_state total = sum(&k14, 2.0, &k23);
    *state = sum(state, step_s / 6.0, &total);

    if (speed <= ROLLS_BELOW_M_S)
        return;
    if (truck->front_relaxation_length <= 0.0)
        state->front_force = settled_front_force(state, truck, front_wheel_angle, speed);
    if (truck->rear_relaxation_length <= 0.0)
        state->rear_force = settled_rear_force(state, truck, speed);
}

double sim_truck_lateral_acceleration(const sim_truck_state *state, const sim_truck *truck, double front_wheel_angle,
                                      double speed, double gravity_to_left)
{
    const sim_truck_state slope = slope_of(state, truck, front_wheel_angle, speed, gravity_to_left);
    return slope.lateral_speed + speed * state->yaw_rate - gravity_to_left;
}

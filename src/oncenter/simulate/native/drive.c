#include "drive.h"

#include <math.h>
#include <string.h>

static const double STANDARD_GRAVITY = 9.80665; /* m/s^2 */
static const double SPRINGS_MOVE_ABOVE_M_S = 0.5;
static const double REAR_FADES_SHARE = 0.25; /* 1, of the speed at which a steered rear axle is locked */

static double gravity_to_left(const sim_state *state, const sim_drive *drive)
{
    return -STANDARD_GRAVITY * sim_road_at(&drive->road, drive->road.cross_slope, state->station);
}

/* A column of the inputs that may be missing. */
static double given(const double *column, size_t tick)
{
    return column == NULL ? 0.0 : column[tick];
}

static double patch(const sim_state *state, const sim_drive *drive)
{
    return drive->road.patch == NULL ? 0.0 : sim_road_at(&drive->road, drive->road.patch, state->station);
}

/* 1, angle of the last axle per front wheel angle: it fades towards the speed from which on the axle is locked. */
static double rear_share(const sim_state *state, const sim_drive *drive)
{
    if (drive->rear_locks_speed <= 0.0)
        return drive->rear_share;
    const double unlocked = (1.0 - fabs(state->driver.speed) / drive->rear_locks_speed) / REAR_FADES_SHARE;
    return drive->rear_share * fmin(1.0, fmax(0.0, unlocked));
}

static sim_truck truck_now(const sim_state *state, const sim_drive *drive, const sim_inputs *inputs, size_t tick)
{
    const double share = given(inputs->second_truck, tick), slippery = patch(state, drive);
    sim_truck truck = share > 0.0 ? sim_truck_between(&drive->truck, &drive->second, share) : drive->truck;
    if (slippery > 0.0)
        sim_truck_scale_stiffness(&truck, 1.0 + drive->patch_front * slippery, 1.0 + drive->patch_rear * slippery);
    if (drive->rear_share < 0.0)
        truck.axles[truck.axle_count - 1].steer_share = rear_share(state, drive);
    return truck;
}

static sim_truck_input acting(const sim_state *state, const sim_drive *drive)
{
    const sim_truck_input input = {
        .front_wheel_angle = state->steering.front_wheel_angle,
        .speed = state->driver.speed,
        .gravity_to_left = gravity_to_left(state, drive),
        .wind_force = state->wind.lateral_force,
        .wind_arm = drive->wind.arm,
        .brake_moment = state->brake_moment,
    };
    return input;
}

static double lateral_error_rate(const sim_state *state)
{
    return state->driver.speed * state->heading_error + state->truck.lateral_speed;
}

/* Along the road and across it; small heading errors. */
static void move_along(sim_state *state, const sim_drive *drive, double step_s)
{
    const double curvature = sim_road_at(&drive->road, drive->road.curvature, state->station);
    const double progress = state->driver.speed / (1.0 - curvature * state->lateral_error);
    state->lateral_error += lateral_error_rate(state) * step_s;
    state->heading_error += (state->truck.yaw_rate - curvature * progress) * step_s;
    state->station += progress * step_s;
}

/* Over the ground, with the heading at the middle of the step. */
static void move_over(sim_state *state, double step_s)
{
    const double heading = state->heading + 0.5 * state->truck.yaw_rate * step_s;
    const double forward = state->driver.speed, to_left = state->truck.lateral_speed;
    state->east += (forward * cos(heading) - to_left * sin(heading)) * step_s;
    state->north += (forward * sin(heading) + to_left * cos(heading)) * step_s;
    state->heading += state->truck.yaw_rate * step_s;
}

static void write_row(const sim_state *state, const sim_drive *drive, const sim_truck *truck, int32_t has_lane,
                      sim_row *row)
{
    const sim_truck_input input = acting(state, drive);
    row->time = state->time;
    row->steering_wheel_angle =
        state->motor_carries ? state->steering.steering_wheel_angle : state->driver.steering_wheel_angle;
    row->place_in_play = state->steering.place_in_play;
    row->front_wheel_angle = input.front_wheel_angle;
    row->yaw_rate = state->truck.yaw_rate;
    row->vehicle_speed = state->driver.speed;
    row->lateral_speed = state->truck.lateral_speed;
    row->lateral_acceleration = sim_truck_lateral_acceleration(&state->truck, truck, &input);
    row->felt_lateral_acceleration = row->lateral_acceleration * cos(state->truck.roll)
                                     + STANDARD_GRAVITY * sin(state->truck.roll);
    row->roll = state->truck.roll;
    row->longitudinal_acceleration = state->driver.longitudinal_acceleration;
    row->front_force = sim_truck_steered_force(&state->truck, truck);
    row->aligning_moment = state->steering.aligning_moment;
    row->curvature = sim_road_at(&drive->road, drive->road.curvature, state->station);
    row->cross_slope = sim_road_at(&drive->road, drive->road.cross_slope, state->station);
    row->station = state->station;
    row->lateral_error = has_lane ? state->lateral_error : NAN;
    row->east = state->east;
    row->north = state->north;
    row->heading = state->heading;
    row->wind_force = state->wind.lateral_force;
    row->place_in_windup = state->steering.place_in_windup;
    row->articulation = state->truck.trailer.articulation;
    row->place_in_lash = state->steering.place_in_lash;
    row->motor_carries = state->motor_carries;
    row->patch = patch(state, drive);
    row->hand_torque = state->steering.hand_torque;
    row->rear_axle_angle = rear_share(state, drive) * input.front_wheel_angle;
}

void sim_init(sim_state *state, const sim_drive *drive)
{
    memset(state, 0, sizeof *state);
    state->heading = drive->start_heading;
}

/* The driver decides by the lane; a machine's angles are given. */
static void decide(sim_state *state, const sim_drive *drive, const sim_inputs *inputs, size_t tick)
{
    if (inputs->machine_angles != NULL)
        return;
    const sim_view view = {
        .station = state->station,
        .lateral_error = state->lateral_error,
        .lateral_error_rate = lateral_error_rate(state),
        .yaw_rate = state->truck.yaw_rate,
        .heading_error = state->heading_error,
        .motor_carries = state->motor_carries,
        .rear_share = rear_share(state, drive),
    };
    sim_driver_decide(&state->driver, &drive->driver, &drive->road, &view, inputs->lane_normals[tick],
                      inputs->hand_normals[tick]);
}

static void blow(sim_state *state, const sim_drive *drive, double normal)
{
    const double *exposure = drive->road.exposure;
    const sim_wind_input input = {
        .heading = state->heading,
        .speed = state->driver.speed,
        .exposure = exposure == NULL ? 1.0 : sim_road_at(&drive->road, exposure, state->station),
        .normal = normal,
    };
    sim_wind_blow(&state->wind, &drive->wind, &input);
}

/* A random process about zero while the truck moves. */
static void bump(sim_state *state, const sim_drive *drive, double normal)
{
    const double keep = drive->bump_steer_keep;
    if (state->driver.speed > SPRINGS_MOVE_ABOVE_M_S)
        state->bump_steer = keep * state->bump_steer + sqrt(1.0 - keep * keep) * drive->bump_steer * normal;
}

/* Driver or motor continue from the present angle of steering wheel or gear, so that neither jumps. */
static void hand_over(sim_state *state, const sim_inputs *inputs, size_t tick)
{
    const int32_t carries = given(inputs->motor_carries, tick) > 0.0;
    if (carries == state->motor_carries)
        return;
    state->motor_carries = carries;
    state->driver.steering_wheel_angle =
        carries ? state->steering.lash.inner : state->steering.steering_wheel_angle;
    state->motor_angle = state->driver.steering_wheel_angle;
}

/* rad, of the gear: within its dead band about the decision the motor stays where it is. */
static double by_motor(sim_state *state, const sim_drive *drive)
{
    const double wanted = state->driver.steering_wheel_angle, band = drive->motor_dead_band;
    state->motor_angle = fmin(wanted + band, fmax(wanted - band, state->motor_angle));
    return state->motor_angle;
}

static void steer(sim_state *state, const sim_drive *drive, const sim_truck *truck, double second, double step_s)
{
    const sim_steering_input input = {
        .angle = state->motor_carries ? by_motor(state, drive) : state->driver.steering_wheel_angle,
        .front_force = sim_truck_steered_force(&state->truck, truck),
        .longitudinal_acceleration = state->driver.longitudinal_acceleration,
        .motor_carries = state->motor_carries,
        .second_truck = second,
        .roll = state->truck.roll,
        .bump_steer = state->bump_steer,
        .resting_torque = state->resting_torque,
    };
    sim_steering_step(&state->steering, &drive->steering, &input, step_s);
}

void sim_step(sim_state *state, const sim_drive *drive, const sim_inputs *inputs, size_t tick, sim_row *row)
{
    const double *machine = inputs->machine_angles;
    if (machine != NULL)
        state->driver.steering_wheel_angle = machine[tick];
    if (inputs->gust_normals != NULL)
        blow(state, drive, inputs->gust_normals[tick]);
    if (inputs->bump_normals != NULL)
        bump(state, drive, inputs->bump_normals[tick]);
    hand_over(state, inputs, tick);
    state->resting_torque = given(inputs->resting_torque, tick);
    state->brake_moment = given(inputs->brake_moment, tick);
    const sim_truck truck = truck_now(state, drive, inputs, tick);
    write_row(state, drive, &truck, machine == NULL, row);
    row->second_truck = given(inputs->second_truck, tick);
    decide(state, drive, inputs, tick);

    const double tick_began = state->time;
    const double step_s = drive->tick / drive->steps_per_tick;
    const double machine_rate = machine == NULL ? 0.0 : (machine[tick + 1] - machine[tick]) / drive->tick;
    for (int32_t k = 0; k < drive->steps_per_tick; ++k) {
        const sim_way way = {
            .station = state->station,
            .time = state->time,
            .reverses = given(inputs->reverses, tick) > 0.0,
            .braked = given(inputs->braked, tick),
        };
        sim_driver_drive(&state->driver, &drive->driver, &drive->road, &way, step_s);
        if (machine == NULL)
            sim_driver_steer(&state->driver, &drive->driver, step_s);
        else
            state->driver.steering_wheel_angle += machine_rate * step_s;
        steer(state, drive, &truck, row->second_truck, step_s);
        const sim_truck_input input = acting(state, drive);
        sim_truck_step(&state->truck, &truck, &input, step_s);
        move_along(state, drive, step_s);
        move_over(state, step_s);
        state->time = tick_began + (k + 1) * step_s;
    }
}

void sim_run(const sim_drive *drive, const sim_inputs *inputs, size_t count, sim_row *rows)
{
    sim_state state;
    sim_init(&state, drive);
    for (size_t k = 0; k < count; ++k) {
        state.time = (double)k * drive->tick; /* a sum of ticks would drift */
        sim_step(&state, drive, inputs, k, &rows[k]);
    }
}

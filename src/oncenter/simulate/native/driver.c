#include "driver.h"

#include <math.h>

static const double LOOKS_AS_AT_M_S = 8.0;  /* below it the preview distance is constant and corrections are smaller */
static const double FLANK_SURE_M_S2 = 0.15;  /* lateral force per mass for a fairly certain flank */
static const double STANDARD_GRAVITY = 9.80665; /* m/s^2 */
static const double MOVES_ABOVE_M_S = 0.5;  /* below it the hands rest */
static const double PEDAL_ANSWERS_S = 0.5;
static const double SPEED_ANSWERS_S = 2.0;
static const double STOPPING_SHARE = 0.5;    /* of the maximum deceleration, before a stop */
static const double STOPS_BEFORE_M = 2.0;
static const double STANDS_BELOW_M_S = 0.05; /* the parking brake takes over */
static const double SWING_LENGTH_M = 30.0;
static const double TWO_PI = 6.283185307179586;
static const double BACKWARDS_DECAY_M = 5.0; /* of an error of place or heading, over the way backwards */

static double limited(double value, double low, double high)
{
    if (value < low)
        return low;
    return value > high ? high : value;
}

/* Ornstein-Uhlenbeck process about zero with the given standard deviation. */
static double wander(double now, double keep, double standard_deviation, double normal)
{
    return keep * now + sqrt(1.0 - keep * keep) * standard_deviation * normal;
}

/* m, predicted lateral position if nothing changes, left of the lane's centre. */
static double error_ahead(const sim_view *view, const sim_road *road, double v, double T)
{
    const double here = sim_road_at(road, road->curvature, view->station);
    const double error_acceleration = v * (view->yaw_rate - v * here);
    return view->lateral_error + view->lateral_error_rate * T + 0.5 * error_acceleration * T * T;
}

/* -1 to 1, the flank of the play that the wheels will be on. An experienced driver crosses the play at once. */
static double flank(double lateral_force)
{
    return lateral_force / sqrt(lateral_force * lateral_force + FLANK_SURE_M_S2 * FLANK_SURE_M_S2);
}

/* 1/m, wanted backwards, for the middle of the rear axle: the lateral error decays critically damped over the way. */
static double backwards_curvature(const sim_driver_state *state, const sim_driver *driver, const sim_road *road,
                                  const sim_view *view)
{
    const double behind = driver->turns_behind;
    const double at = view->station - behind, k = TWO_PI / SWING_LENGTH_M, swing = driver->backwards_swing;
    const double of_road = sim_road_at(road, road->curvature, at);
    const double there = of_road - swing * k * k * sin(k * at);
    const double heading = view->heading_error + behind * of_road;
    const double error = view->lateral_error - state->lane_wander - behind * heading - swing * sin(k * at);
    const double off = heading - swing * k * cos(k * at);
    const double correction = (2.0 * off - error / BACKWARDS_DECAY_M) / BACKWARDS_DECAY_M;
    return there + limited(correction, -driver->backwards_curvature, driver->backwards_curvature);
}

/* 1/m, wanted forwards: that at the end of the arms' motion, and the arc that removes the error. */
static double forwards_curvature(sim_driver_state *state, const sim_driver *driver, const sim_road *road,
                                 const sim_view *view, double there, double slowness)
{
    const double v = state->speed, T = driver->preview_time * slowness;
    const double ahead = sim_road_at(road, road->curvature, there);
    const double error = error_ahead(view, road, v, T) - state->lane_wander;
    const double correction = -driver->gain / slowness * 2.0 * error / (v * v * T * T);
    state->trim += (1.0 - driver->trim_keep) * correction;
    return ahead + correction;
}

void sim_driver_decide(sim_driver_state *state, const sim_driver *driver, const sim_road *road, const sim_view *view,
                       double lane_normal, double hand_normal)
{
    if (fabs(state->speed) < MOVES_ABOVE_M_S)
        return;
    state->lane_wander = wander(state->lane_wander, driver->lane_wander_keep, driver->lane_wander, lane_normal);
    state->hand_motion = wander(state->hand_motion, driver->hand_motion_keep, driver->hand_motion, hand_normal);

    const double v = state->speed;
    const double slowness = fmax(1.0, LOOKS_AS_AT_M_S / fabs(v));
    const double until_moved = driver->reaction_time + 2.0 / driver->arm_frequency;
    const double there = view->station + v * until_moved - driver->turns_behind * (1.0 - 1.0 / slowness);
    const double wanted = v < 0.0 ? backwards_curvature(state, driver, road, view)
                                  : forwards_curvature(state, driver, road, view, there, slowness);
    const double lateral_force = v * v * wanted + STANDARD_GRAVITY * sim_road_at(road, road->cross_slope, there);

    const double on_flank = flank(lateral_force);
    state->flanks[state->next] = on_flank;
    state->decided[state->next] = (driver->angle_per_curvature
                                + driver->angle_per_lateral_acceleration * v * v) * (wanted + state->trim)
                               / (1.0 - view->rear_share) + driver->backlash_half_width * on_flank + state->hand_motion;
    state->next = (state->next + 1) % (driver->reaction_ticks + 1);
    const double lash = view->motor_carries ? 0.0 : driver->lash_half_width; /* a motor has no lash to cross */
    state->wanted_angle = state->decided[state->next] + lash * state->flanks[state->next];
}

void sim_driver_steer(sim_driver_state *state, const sim_driver *driver, double step_s)
{
    const double w = driver->arm_frequency;
    const double angular_acceleration =
        w * w * (state->wanted_angle - state->steering_wheel_angle) - 2.0 * w * state->steering_wheel_rate;
    state->steering_wheel_rate += angular_acceleration * step_s;
    state->steering_wheel_angle += state->steering_wheel_rate * step_s;
}

/* m/s, maximum speed for standing in time. */
static double speed_before_standing(sim_driver_state *state, const sim_driver *driver, double time, double answers_s)
{
    if (state->next_standing < driver->standing_count && time >= driver->standing_end[state->next_standing])
        ++state->next_standing;
    if (state->next_standing >= driver->standing_count)
        return INFINITY;
    const double begin = driver->standing_begin[state->next_standing];
    return time >= begin ? 0.0 : driver->deceleration_max * (begin - time - 2.0 * answers_s);
}

/* m/s, maximum speed for braking gently to the next stop. After standing there long enough, advances to the following
 * one. */
static double speed_before_stop(sim_driver_state *state, const sim_driver *driver, const sim_road *road, double station,
                                double step_s)
{
    if (state->next_stop >= road->stop_count)
        return INFINITY;
    const double way = road->stop_station[state->next_stop] - station - STOPS_BEFORE_M - state->speed * PEDAL_ANSWERS_S;
    if (state->speed <= 0.0 && way <= 0.0) {
        state->stood += step_s;
        if (state->stood >= road->stop_duration[state->next_stop]) {
            state->stood = 0.0;
            ++state->next_stop;
        }
    }
    return way <= 0.0 ? 0.0 : sqrt(2.0 * STOPPING_SHARE * driver->deceleration_max * way);
}

/* m/s, positive, of the road and its stops, or of driving backwards. */
static double allowed_speed(sim_driver_state *state, const sim_driver *driver, const sim_road *road,
                            const sim_way *way, double answers_s, double step_s)
{
    if (state->backwards)
        return driver->backwards_speed;
    const double of_road = fmin(sim_road_at(road, road->speed, way->station), /* holds a bend's speed up to its end */
                                sim_road_at(road, road->speed, way->station + state->speed * answers_s));
    return fmin(of_road, speed_before_stop(state, driver, road, way->station, step_s));
}

void sim_driver_drive(sim_driver_state *state, const sim_driver *driver, const sim_road *road, const sim_way *way,
                      double step_s)
{
    const double answers_s = SPEED_ANSWERS_S + PEDAL_ANSWERS_S;
    if (state->speed == 0.0)
        state->backwards = way->reverses;
    const double in_time = speed_before_standing(state, driver, way->time, answers_s);
    const double wanted = fmax(0.0, fmin(allowed_speed(state, driver, road, way, answers_s, step_s), in_time));
    const double gear = state->backwards ? -1.0 : 1.0;
    const double speed = gear * state->speed;
    if (wanted <= 0.0 && speed < STANDS_BELOW_M_S) {
        state->speed = 0.0;
        state->longitudinal_acceleration = 0.0;
        return;
    }
    double acceleration = wanted <= 0.0 ? -driver->deceleration_max
                                        : limited((wanted - speed) / SPEED_ANSWERS_S,
                                                  -driver->deceleration_max, driver->acceleration_max);
    if (way->braked > 0.0)
        acceleration = fmin(acceleration, -way->braked);
    state->longitudinal_acceleration +=
        (gear * acceleration - state->longitudinal_acceleration) * step_s / PEDAL_ANSWERS_S;
    state->speed = gear * fmax(0.0, speed + gear * state->longitudinal_acceleration * step_s);
}

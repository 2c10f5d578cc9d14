#include "steering.h"

#include <math.h>

static const double COLUMN_SLIP = 0.5 * 0.017453292519943295; /* rad, from zero to full friction */
static const double KING_PIN_SLIP = 0.5 * 0.017453292519943295; /* rad at the steering wheel, the same */
static const double ON_FLANK = 1.0 - 1e-9; /* place in a play; 1 less rounding */
static const double WHEEL_FALLS = 1.0; /* rad/s per N m beyond the column's friction: some 3 deg in 0.1 s */
static const double TWIST_SETTLES_S = 0.05; /* against a jump of steering wheel or gear when the hands let go */

/* N m to the left, without the tyres' aligning moment. */
static double other_moments(const sim_steering *steering, double longitudinal_acceleration)
{
    const double per_m_s2 = longitudinal_acceleration < 0.0 ? -steering->brake_pull : steering->torque_steer;
    return steering->set_moment + per_m_s2 * longitudinal_acceleration;
}

/* rad, zero at the straight-ahead angle of the gear. */
static double ripple(const sim_steering *steering, double gear_angle)
{
    if (steering->ripple <= 0.0)
        return 0.0;
    return steering->ripple * (sin(2.0 * (gear_angle - steering->ripple_phase)) + sin(2.0 * steering->ripple_phase));
}

static double through_gear(const sim_steering *steering, double gear_angle)
{
    const double angle = gear_angle + ripple(steering, gear_angle);
    double turned = 0.0;
    for (int32_t k = steering->ratio_terms - 1; k > 0; --k)
        turned = (turned + steering->ratio[k]) * angle;
    if (gear_angle < 0.0)
        turned *= steering->right_share;
    return turned + steering->ratio[0];
}

/* rad, of the front wheels, by drag link and axle that move with springs and brakes. */
static double turned_by_axle(const sim_steering *steering, const sim_steering_input *input)
{
    const double deceleration = fmax(0.0, -input->longitudinal_acceleration);
    return steering->ride_height_steer * input->second_truck + steering->roll_steer * input->roll
           + steering->brake_steer * deceleration + input->bump_steer;
}

/* load: N m about the king pins, carried by the hands. */
static void twist(sim_steering_state *state, const sim_steering *steering, double load, double step_s)
{
    if (steering->twist <= 0.0)
        return;
    const double rest = steering->twist * tanh(load / steering->twist_half_moment);
    state->twist += (rest - state->twist) * fmin(1.0, step_s / TWIST_SETTLES_S);
}

/* The driver turns the gear through torsion bar, wind-up and lash. load: N m about the king pins. */
static void turn_by_hand(sim_steering_state *state, const sim_steering *steering, double angle, double load,
                         double step_s)
{
    twist(state, steering, load, step_s);
    state->steering_wheel_angle = angle;
    state->place_in_windup = oc_backlash_step(&state->windup, &steering->windup, angle - state->twist,
                                              steering->active_return * state->windup.inner, step_s);
    state->place_in_lash = oc_backlash_step(&state->lash, &steering->lash, state->windup.inner, load, step_s);
}

/* The motor turns the gear, whose flanks drag the column along. Without hands the column has no moment, so it does not
 * creep and keeps its wind-up. A hand at rest pulls the column to its side of the lash and twists the torsion bar. */
static void turn_by_motor(sim_steering_state *state, const sim_steering *steering, double gear_angle,
                          double resting_torque, double step_s)
{
    const double half = steering->lash.half_width;
    const oc_backlash lash = {half, steering->column_friction, WHEEL_FALLS};
    const double carried = fmax(fabs(resting_torque) - steering->column_friction, 0.0); /* N m, beyond friction */
    twist(state, steering, copysign(carried, resting_torque) / steering->hands_share, step_s);
    state->lash.inner = gear_angle;
    state->windup.inner = oc_backlash_carry(state->windup.inner, &lash, gear_angle, -resting_torque, step_s);
    state->place_in_lash = half > 0.0 ? (state->windup.inner - gear_angle) / half : 0.0;
    state->steering_wheel_angle =
        state->windup.inner + state->place_in_windup * steering->windup.half_width + state->twist;
}

static double limited(double value)
{
    return fmin(1.0, fmax(-1.0, value));
}

/* N m, the part of a moment that a play transmits: flanks push, they do not pull. */
static double through_play(double moment, double half_width, double place)
{
    if (half_width <= 0.0)
        return moment;
    if (place >= ON_FLANK)
        return fmax(moment, 0.0);
    return place <= -ON_FLANK ? fmin(moment, 0.0) : 0.0;
}

/* The hands' torque. Dry friction opposes each motion, and is full after a small slip (Dahl). load: N m about the king
 * pins; before: at the start of the step. */
static void hold(sim_steering_state *state, const sim_steering *steering, const sim_steering_state *before, double load)
{
    const double turned = state->steering_wheel_angle - before->steering_wheel_angle;
    const double carried = state->backlash.inner - before->backlash.inner;
    state->place_in_column = limited(before->place_in_column + turned / COLUMN_SLIP);
    state->place_in_king_pins = limited(before->place_in_king_pins + carried / KING_PIN_SLIP);
    const double moment = load + steering->backlash.friction * state->place_in_king_pins;
    const double at_gear = through_play(moment, steering->backlash.half_width, state->place_in_play);
    const double at_column = through_play(at_gear, steering->lash.half_width, state->place_in_lash);
    state->hand_torque = at_column * steering->hands_share + steering->column_friction * state->place_in_column;
}

void sim_steering_step(sim_steering_state *state, const sim_steering *steering, const sim_steering_input *input,
                       double step_s)
{
    const double to_left = other_moments(steering, input->longitudinal_acceleration);
    state->aligning_moment = input->front_force * steering->trail;
    const double load = state->aligning_moment - to_left;
    const sim_steering_state before = *state;
    if (input->motor_carries)
        turn_by_motor(state, steering, input->angle, input->resting_torque, step_s);
    else
        turn_by_hand(state, steering, input->angle, load, step_s);
    state->place_in_play =
        oc_backlash_step(&state->backlash, &steering->backlash, state->lash.inner, load, step_s);
    state->front_wheel_angle = through_gear(steering, state->backlash.inner) + steering->set_angle
                               + steering->compliance * to_left + turned_by_axle(steering, input);
    hold(state, steering, &before, load);
    if (input->motor_carries)
        state->hand_torque = input->resting_torque;
}

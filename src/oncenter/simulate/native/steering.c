#include "steering.h"

/* N m towards the left: all but the tyres' aligning moment. */
static double other_moments(const sim_steering *steering, double longitudinal_acceleration)
{
    const double per_m_s2 = longitudinal_acceleration < 0.0 ? -steering->brake_pull : steering->torque_steer;
    return steering->set_moment + per_m_s2 * longitudinal_acceleration;
}

static double through_gear(const sim_steering *steering, double gear_angle)
{
    double front_wheel_angle = 0.0;
    for (int32_t k = steering->ratio_terms - 1; k >= 0; --k)
        front_wheel_angle = front_wheel_angle * gear_angle + steering->ratio[k];
    return front_wheel_angle;
}

/* rad; drag link and axle move with the springs and turn the front wheels. */
static double turned_by_springs(const sim_steering *steering, const sim_steering_input *input)
{
    return steering->ride_height_steer * input->second_truck;
}

/* The driver turns the gear through wind-up and lash. load: N m about the king pins. */
static void turn_by_hand(sim_steering_state *state, const sim_steering *steering, double angle, double load,
                         double step_s)
{
    state->steering_wheel_angle = angle;
    state->place_in_windup = oc_backlash_step(&state->windup, &steering->windup, angle,
                                              steering->active_return * state->windup.inner, step_s);
    state->place_in_lash = oc_backlash_step(&state->lash, &steering->lash, state->windup.inner, load, step_s);
}

/* The motor turns the gear, whose flanks drag the column along: without hands it bears no moment, so that it creeps
 * nowhere and keeps its wind-up. */
static void turn_by_motor(sim_steering_state *state, const sim_steering *steering, double gear_angle, double step_s)
{
    const double half = steering->lash.half_width;
    state->lash.inner = gear_angle;
    state->windup.inner = oc_backlash_carry(state->windup.inner, &steering->lash, gear_angle, 0.0, step_s);
    state->place_in_lash = half > 0.0 ? (state->windup.inner - gear_angle) / half : 0.0;
    state->steering_wheel_angle = state->windup.inner + state->place_in_windup * steering->windup.half_width;
}

void sim_steering_step(sim_steering_state *state, const sim_steering *steering, const sim_steering_input *input,
                       double step_s)
{
    const double to_left = other_moments(steering, input->longitudinal_acceleration);
    state->aligning_moment = input->front_force * steering->trail;
    const double load = state->aligning_moment - to_left;
    if (input->motor_carries)
        turn_by_motor(state, steering, input->angle, step_s);
    else
        turn_by_hand(state, steering, input->angle, load, step_s);
    state->place_in_play =
        oc_backlash_step(&state->backlash, &steering->backlash, state->lash.inner, load, step_s);
    state->front_wheel_angle = through_gear(steering, state->backlash.inner) + steering->set_angle
                               + steering->compliance * to_left + turned_by_springs(steering, input);
}

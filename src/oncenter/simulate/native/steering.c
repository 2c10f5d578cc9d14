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

void sim_steering_step(sim_steering_state *state, const sim_steering *steering, double steering_wheel_angle,
                       double front_force, double longitudinal_acceleration, double step_s)
{
    const double to_left = other_moments(steering, longitudinal_acceleration);
    state->aligning_moment = front_force * steering->trail;
    state->place_in_windup = oc_backlash_step(&state->windup, &steering->windup, steering_wheel_angle,
                                              steering->active_return * state->windup.inner, step_s);
    state->place_in_play = oc_backlash_step(&state->backlash, &steering->backlash, state->windup.inner,
                                            state->aligning_moment - to_left, step_s);
    state->front_wheel_angle = through_gear(steering, state->backlash.inner) + steering->set_angle
                               + steering->compliance * to_left;
}

#include "steering.h"

void sim_steering_step(sim_steering_state *state, const sim_steering *steering, double steering_wheel_angle,
                       double front_force, double step_s)
{
    state->aligning_moment = front_force * steering->trail;
    state->place_in_play = oc_backlash_step(&state->backlash, &steering->backlash, steering_wheel_angle,
                                            state->aligning_moment, step_s);
    state->front_wheel_angle = state->backlash.inner / steering->ratio;
}

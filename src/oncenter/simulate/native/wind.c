#include "wind.h"

#include <math.h>

void sim_wind_blow(sim_wind_state *state, const sim_wind *wind, double heading, double speed, double normal)
{
    const double keep = wind->gust_keep;
    state->gust = keep * state->gust + sqrt(1.0 - keep * keep) * wind->gust * normal;

    const double strength = wind->mean + state->gust;
    const double to_left = -strength * sin(wind->from - heading);
    const double against = speed + strength * cos(wind->from - heading);
    const double flow = sqrt(against * against + to_left * to_left);
    state->side_force = wind->force_constant * flow * to_left; /* the coefficient goes with the flow's angle's sine */
}

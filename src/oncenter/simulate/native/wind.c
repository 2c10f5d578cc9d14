#include "wind.h"

#include <math.h>

void sim_wind_blow(sim_wind_state *state, const sim_wind *wind, const sim_wind_input *input)
{
    const double keep = wind->gust_keep;
    state->gust = keep * state->gust + sqrt(1.0 - keep * keep) * wind->gust * input->normal;

    const double strength = input->exposure * (wind->mean + state->gust);
    const double from = wind->with_truck ? wind->from : wind->from - input->heading;
    const double to_left = -strength * sin(from);
    const double against = input->speed + strength * cos(from);
    const double flow = sqrt(against * against + to_left * to_left);
    /* the coefficient is proportional to the sine of the flow angle */
    state->lateral_force = wind->force_constant * flow * to_left;
}

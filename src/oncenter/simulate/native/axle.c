#include "axle.h"

double sim_axle_stiffness(const sim_axle *axle)
{
    const double C = axle->tyre.cornering_stiffness;
    return C / (1.0 + C * axle->compliance);
}

double sim_axle_force(const sim_axle *axle, double lagging, double front_wheel_angle, double direction)
{
    if (axle->relaxation_length > 0.0)
        return lagging;
    return sim_axle_stiffness(axle) * (axle->steer_share * front_wheel_angle - direction);
}

double sim_axle_force_slope(const sim_axle *axle, double lagging, double front_wheel_angle, double direction,
                            double speed)
{
    if (axle->relaxation_length <= 0.0)
        return 0.0;
    const double angle = axle->steer_share * front_wheel_angle - axle->compliance * lagging;
    return (sim_tyre_force(&axle->tyre, angle - direction) - lagging) * speed / axle->relaxation_length;
}

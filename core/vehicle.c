#include "vehicle.h"

double oc_ackermann_angle(const oc_vehicle *vehicle, double curvature) {
    return vehicle->wheelbase * curvature;
}

double oc_steady_state_angle(const oc_vehicle *vehicle, double curvature, double understeer_gradient,
                             double lateral_acceleration) {
    const double K = understeer_gradient;
    const double a_y = lateral_acceleration;
    return vehicle->steering_ratio * (oc_ackermann_angle(vehicle, curvature) + K * a_y);
}

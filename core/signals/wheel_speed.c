#include "wheel_speed.h"

#include <math.h>

#include "trig.h"

double oc_wheel_speed_front_angle(double wheelbase, double track, double left, double right, double mismatch) {
    const double l = left * (1.0 + mismatch);
    const double sum = right + l;
    return sum > 0.0 ? 0.5 * oc_asin(4.0 * wheelbase / track * (right - l) / sum) : 0.0;
}

double oc_wheel_speed_rear_curvature(double track, double left, double right, double mismatch) {
    const double l = left * (1.0 + mismatch);
    const double sum = right + l;
    return sum > 0.0 ? 2.0 / track * (right - l) / sum : 0.0;
}

double oc_wheel_speed_front_curvature(double wheelbase, double track, double left, double right, double mismatch) {
    return oc_tan(oc_wheel_speed_front_angle(wheelbase, track, left, right, mismatch)) / wheelbase;
}

void oc_wheel_speed_update(oc_wheel_speed *state, double left, double right, double tick_s) {
    state->difference += (right - left) * tick_s;
    state->distance += 0.5 * fabs(left + right) * tick_s;
    state->time += tick_s;
}

oc_estimate oc_wheel_speed_mismatch(const oc_wheel_speed *state, const oc_params *params, double track) {
    const double prior = params->wheel_radius_mismatch_sd_1;
    if (!(state->distance > 1.0) || !(prior > 0.0)) {
        return (oc_estimate){.standard_deviation = prior, .evidence = state->time};
    }
    const double by_turn = track * params->net_turn_sd_rad / state->distance;
    const double squares = prior * prior + by_turn * by_turn;
    const double share = prior * prior / squares;
    return (oc_estimate){
        .value = share * state->difference / state->distance,
        .standard_deviation = prior * by_turn / sqrt(squares),
        .evidence = state->time,
        .status = share > 0.5 ? OC_CONVERGING : OC_UNOBSERVABLE,
    };
}

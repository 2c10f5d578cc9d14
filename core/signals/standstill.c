#include "standstill.h"

#include <math.h>

/* Tuned, in tuned.toml: standstill */
static const double yaw_rate_floor = 0.00035; /* rad/s: error of a standstill's mean, 0.02 deg/s */
static const double correlated_readings = 10.0; /* successive ticks that count as one */
/* end */

void oc_still_mean_add(oc_still_mean *still, double reading, double weight) {
    still->weight += weight;
    const double innovation = reading - still->mean;
    still->mean += innovation * weight / still->weight;
    const double square = weight * innovation * (reading - still->mean);
    still->squares += square > 0.0 ? square : 0.0; /* rounding can carry the mean beyond the reading */
}

double oc_still_mean_variance(const oc_still_mean *still) {
    return still->squares * correlated_readings / (still->weight * still->weight);
}

double oc_standstill_shared_variance(double creep) {
    return yaw_rate_floor * yaw_rate_floor + creep * creep;
}

void oc_standstill_update(oc_standstill *state, int32_t settling_ticks, double speed, double speed_max,
                          double yaw_rate, double lateral_acceleration, int32_t has_acceleration, double creep) {
    if (!(fabs(speed) <= speed_max)) {
        state->still_ticks = state->is_same_stop = 0;
        return;
    }
    if (state->still_ticks < settling_ticks) {
        ++state->still_ticks;
        return;
    }
    state->stops += 1 - state->is_same_stop;
    state->is_same_stop = 1;
    const double share = yaw_rate_floor * yaw_rate_floor / oc_standstill_shared_variance(creep);
    oc_still_mean_add(&state->yaw_rate, yaw_rate, share);
    state->creep += (creep - state->creep) * share / state->yaw_rate.weight;
    if (has_acceleration != 0) {
        oc_still_mean_add(&state->lateral_acceleration, lateral_acceleration, 1.0);
    }
}

static oc_estimate estimate_of(const oc_still_mean *still, double shared_variance, double tick_s, double time_min) {
    const double evidence = still->weight * tick_s;
    if (!(evidence >= time_min) || !(still->weight > 1.0)) {
        return (oc_estimate){.evidence = evidence, .status = OC_UNOBSERVABLE};
    }
    const double variance = oc_still_mean_variance(still) * still->weight / (still->weight - 1.0);
    return (oc_estimate){
        .value = still->mean,
        .standard_deviation = sqrt(variance + shared_variance),
        .evidence = evidence,
        .status = OC_VALID,
    };
}

oc_estimate oc_standstill_yaw_rate(const oc_standstill *state, double tick_s, double time_min) {
    return estimate_of(&state->yaw_rate, oc_standstill_shared_variance(state->creep), tick_s, time_min);
}

oc_estimate oc_standstill_lateral_acceleration(const oc_standstill *state, double tick_s, double time_min) {
    return estimate_of(&state->lateral_acceleration, 0.0, tick_s, time_min);
}

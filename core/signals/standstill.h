#ifndef OC_STANDSTILL_H
#define OC_STANDSTILL_H
/* Yaw rate sensor and accelerometer at standstill, when the true motion is zero. */

#include <stdint.h>

#include "estimate.h"

/* A running mean. */
typedef struct {
    double weight;       /* ticks */
    double squares;      /* of the deviations from the mean */
    double mean;         /* rad/s or m/s^2 */
} oc_still_mean;

typedef struct {
    oc_still_mean yaw_rate, lateral_acceleration; /* the latter over ticks with an accelerometer */
    double creep;                                 /* rad/s, mean yaw rate of a truck that only seems to stand */
    int32_t still_ticks;                          /* of this standstill */
    int32_t stops;                                /* number of standstills, each at another place */
    int32_t is_same_stop;                         /* the truck has not driven since the last one */
} oc_standstill;

/* `weight`: of the reading, 1 for a tick at rest. */
void oc_still_mean_add(oc_still_mean *still, double reading, double weight);

/* Variance of the mean by noise; successive readings are correlated. */
double oc_still_mean_variance(const oc_still_mean *still);

/* (rad/s)^2, of the error that all yaw rates of a standstill share. */
double oc_standstill_shared_variance(double creep);

/* `creep`: rad/s, yaw rate of a truck that creeps with its wheels as they are, too slowly for its speed signal. */
void oc_standstill_update(oc_standstill *state, int32_t settling_ticks, double speed, double speed_max,
                          double yaw_rate, double lateral_acceleration, int32_t has_acceleration, double creep);

/* Unobservable below time_min s of standing. */
oc_estimate oc_standstill_yaw_rate(const oc_standstill *state, double tick_s, double time_min);
oc_estimate oc_standstill_lateral_acceleration(const oc_standstill *state, double tick_s, double time_min);

#endif

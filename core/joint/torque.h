#ifndef OC_TORQUE_H
#define OC_TORQUE_H
/* A steering wheel torque sensor as a second measurement of the front tyres' lateral force (docs/method.md, "What a
 * torque signal adds"). On a flank of the play
 *
 *     T = T_1 + g a + f s
 *
 * a is the lateral acceleration of another sensor, g the slope, f the column's friction and s its state, -1 to 1. T_1,
 * g and f are identified by means of a second. Then (T - f s)/g is the lateral acceleration with the torque sensor's
 * zero, disturbed by friction and gaps. Therefore only its slow part is used. It replaces the slow part of the other
 * sensor, whose zero may drift, or which does not measure the bank. */

#include <stdbool.h>
#include <stdint.h>

enum { OC_TORQUE_TERMS = 3 };

typedef struct {
    float slope;           /* N m per m/s^2, prior of g */
    float zero_sd;         /* N m, of the sensor */
    float constant_sd;     /* m/s^2, of the constant T_1: an accelerometer's zero */
    float tick_s;
    float memory_s;        /* of the slow part */
    float speed_min;       /* m/s, from which on it learns */
    float speed_max;       /* m/s, up to which the slope is identifiable by the other sensor */
    int32_t ticks_per_second;
} oc_torque_design;

/* Sums over the growing second. */
typedef struct {
    int32_t ticks;
    float torque, acceleration, place; /* N m, m/s^2, 1 */
} oc_torque_second;

typedef struct {
    int32_t started;
    int32_t has_angle;
    int32_t due;           /* piece of deferred work: 1 from the end of a second until its evaluation */
    oc_torque_second filling;
    float angle;           /* rad, of the previous tick */
    float place;           /* s, -1 to 1 */
    float terms[OC_TORQUE_TERMS]; /* T_1, N m; g, N m per m/s^2; f, N m */
    float covariance[OC_TORQUE_TERMS * (OC_TORQUE_TERMS + 1) / 2]; /* of these, by rows */
    float slow;            /* m/s^2, slow part of the other sensor less the torque's */
    float slow_s;          /* s in it, memory_s at most */
} oc_torque;

/* One tick. */
typedef struct {
    double torque;         /* N m */
    double angle;          /* rad, steering wheel, as measured */
    double acceleration;   /* m/s^2, by the other sensor */
    double speed;          /* m/s */
    bool has_torque;
} oc_torque_tick;

void oc_torque_setup(oc_torque_design *design, double slope, double zero_sd, double rate_hz, double speed_min,
                     double accelerometer_sd, bool has_accelerometer);

/* m/s^2, lateral acceleration with the torque sensor's zero. Without a torque signal the zero is held. */
double oc_torque_update(oc_torque *state, const oc_torque_design *design, const oc_torque_tick *tick);

/* Learns from the second that is due, between two ticks. */
void oc_torque_work(oc_torque *state, const oc_torque_design *design);

/* 1/(m/s^2)^2, information of the sensor's zero about a_0 = 0; 0 where the torque is not trusted. */
float oc_torque_zero_information(const oc_torque *state, const oc_torque_design *design);

/* m/s^2, sd of the bank by the torque without an accelerometer; `otherwise` until slow roads have identified the
 * slope. */
float oc_torque_bank_sd(const oc_torque *state, const oc_torque_design *design, float otherwise);

/* Whether the identified slope is that of a truck. */
bool oc_torque_is_trusted(const oc_torque *state, const oc_torque_design *design);

#endif

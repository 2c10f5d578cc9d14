#ifndef OC_GYRO_READING_H
#define OC_GYRO_READING_H
/* A reading of the gyro's bias by the wheel speeds of an axle: means over a block of a second, and their variance by
 * noise, lag and rounding. gyro_bias.h has the equation. */

#include <stdint.h>

/* States of an axle in the filter: m, l and s of gyro_bias.h. */
enum { OC_READING_MISMATCH, OC_READING_LOAD, OC_READING_SCALE, OC_READING_STATES };

typedef struct {
    double weight;              /* ticks of the growing block */
    double flat;                /* those of them at which the difference did not change */
    double quantum;             /* m/s, minimum step between plateaus; 0: none yet */
    double held;                /* blocks since the difference last changed */
    double noise;               /* (rad/s)^2, of one block, by differences of successive blocks */
    double variance;            /* (rad/s)^2, of the last block, without the part by the turn */
    double blocks;              /* so far */
    double difference, speed, yaw_rate, acceleration; /* sums over the growing block */
    double last_reading, last_load; /* rad/s, m^2/s^3: of the last whole block */
    double innovation;          /* standard deviations, of the last block */
    double last_difference;     /* m/s, at the previous tick */
    double plateau;             /* m/s, last constant difference */
    double last_speed, last_yaw_rate; /* of the last whole block */
    int32_t has_update;         /* the last block had enough ticks */
} oc_gyro_reading;

/* Forgetting sums over the blocks of both axles: number, curvature (1/m), bank (m/s^2) and their products. */
typedef struct {
    double blocks, curvature, squares, bank, product;
} oc_mean_bank;

void oc_gyro_reading_init(oc_gyro_reading *reading);

/* Begins a new block. */
void oc_gyro_reading_begin(oc_gyro_reading *reading);

/* Adds a tick: speeds of both wheels, m/s; yaw rate, rad/s; lateral acceleration, m/s^2. Ignores slow and sliding
 * wheels. */
void oc_gyro_reading_add(oc_gyro_reading *reading, double track, double left, double right, double yaw_rate,
                         double lateral_acceleration);

/* Ends a block: updates reading, regressors and variance if it has half of its ticks. per_track: 1/m; bias: rad/s;
 * states: OC_READING_STATES of the axle. */
void oc_gyro_reading_end(oc_gyro_reading *reading, oc_mean_bank *straights, double per_track, double ticks_per_block,
                         double bias, const double *states);

/* m/s^2, mean bank of the last minutes' straights. */
double oc_mean_bank_of(const oc_mean_bank *straights);

#endif

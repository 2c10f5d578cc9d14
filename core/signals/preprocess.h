#ifndef OC_PREPROCESS_H
#define OC_PREPROCESS_H
/* 5.1.1: identical 2nd-order Butterworth low-passes on all signals but the angle, and a smoothing differentiator on the
 * down-sampled speed. The angle is delayed by the low-passes' mean group delay, for the joint method by the truck's lag
 * in addition. */

#include <stdbool.h>
#include <stdint.h>

enum {
    OC_DELAY_MAX = 64, /* maximum delay of the angle, ticks */
    OC_SLOPE_POINTS = 11 /* down-sampled speeds under the differentiator */
};

/* H(z) = b0 (1 + z^-1)^2 / (1 + a1 z^-1 + a2 z^-2), transposed direct form II. */
typedef struct {
    double b0, a1, a2;
} oc_lowpass;

/* The filtered signals, in the order of oc_preprocess_update. */
enum { OC_FILTERED_YAW_RATE, OC_FILTERED_SPEED, OC_FILTERED_ACCELERATION, OC_FILTERED_REAR_ANGLE, OC_FILTERED_COUNT };

typedef struct {
    double s1[OC_FILTERED_COUNT], s2[OC_FILTERED_COUNT];
} oc_lowpass_states;

typedef struct {
    oc_lowpass lowpass;
    int32_t delay_ticks;    /* whole part of the angle's delay */
    double delay_fraction;  /* the rest, by linear interpolation */
    int32_t slope_every;    /* ticks between down-sampled speeds */
    double slope_scale;     /* 1/s: weighted sum of the points to slope */
    int32_t settling_ticks; /* after a restart */
} oc_preprocess;

typedef struct {
    oc_lowpass_states lowpass;
    double angle[OC_DELAY_MAX]; /* rad, ring */
    double speed[OC_SLOPE_POINTS]; /* m/s, ring, down-sampled */
    double speed_slope;         /* m/s^2, as of the last down-sampled speed */
    int32_t angle_next, speed_next, slope_wait;
    int32_t ticks;              /* since the restart, clamped at settling_ticks */
} oc_preprocess_state;

/* One tick after filtering. All members belong to the time one group delay ago, dv/dt to half its window earlier, the
 * angle to the lag earlier. */
typedef struct {
    double steering_wheel_angle;      /* rad, delayed */
    double yaw_rate;                  /* rad/s, filtered */
    double vehicle_speed;             /* m/s, filtered */
    double lateral_acceleration;      /* m/s^2, filtered; 0 without an accelerometer */
    double rear_axle_angle;           /* rad, filtered; 0 where no rear axle is steered */
    double longitudinal_acceleration; /* m/s^2 */
} oc_filtered;

/* Maximally flat low-pass by the bilinear transform, prewarped at the cut-off. */
oc_lowpass oc_lowpass_design(double cutoff_hz, double rate_hz);

/* s; mean group delay from 0 to band_hz, which is minus the phase at band_hz over 2 pi band_hz. */
double oc_lowpass_delay(double cutoff_hz, double band_hz, double rate_hz);

/* Variance of the second difference of filtered white noise of variance 1; apart: ticks between its samples. */
double oc_lowpass_second_difference(const oc_lowpass *design, int32_t apart);

/* Delays the angle by the filters' delay plus lag_s, together below OC_DELAY_MAX - 1 ticks. */
void oc_preprocess_design(oc_preprocess *design, double cutoff_hz, double delay_band_hz, double slope_window_s,
                          double lag_s, double rate_hz);

/* Sets the filters to the steady state of the tick's values. */
void oc_preprocess_restart(oc_preprocess_state *state, const oc_preprocess *design, double angle, double yaw_rate,
                           double speed, double lateral_acceleration, double rear_axle_angle);

/* Whether all members of oc_filtered have settled since the restart. */
bool oc_preprocess_settled(const oc_preprocess_state *state, const oc_preprocess *design);

oc_filtered oc_preprocess_update(oc_preprocess_state *state, const oc_preprocess *design, double angle,
                                 double yaw_rate, double speed, double lateral_acceleration, double rear_axle_angle);

#endif

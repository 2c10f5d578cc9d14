#ifndef OC_PLAY_H
#define OC_PLAY_H
/* A hypothesis's model of the steering (docs/method.md, "Operators"). First the column winds up against its friction,
 * and a motor may unwind it. Behind it lies the free play, through which lateral force beyond friction carries the
 * wheels. Each is the operator of backlash.h, in single precision: a hypothesis set moves hundreds of them. */

#include <stdint.h>

enum { OC_WINDS = 2 };

/* One sample of the motion, some ten a second. */
typedef struct {
    float angle;                /* rad, steering wheel, as measured */
    float residual;             /* rad, angle less i*L*r/v */
    float lateral_acceleration; /* m/s^2, a of the method's model, with the accelerometer's bias */
    float yaw_acceleration;     /* rad/s^2 */
    float jerk;                 /* m/s^3, lateral */
    float curvature;            /* 1/m */
    float fifth_wheel;          /* place of a trailer's fifth wheel in its friction, -1 to 1 */
    float per_speed;            /* s/m, 1 over the speed */
    float tandem;               /* m/s^2, c times curvature: rear axles that resist turning */
    float wind[OC_WINDS];       /* v/20 cos psi and v/20 sin psi: share of a steady wind's lateral force, 1 at 20 m/s */
    int32_t in_second;          /* its number in a second of usable samples, from 0; -1: the gate is shut */
} oc_motion_sample;

typedef struct {
    float half_width;     /* rad, of the play */
    float unloading;      /* m/s^2, a_0 */
    float friction;       /* m/s^2; negative: no lateral force moves the wheels in their play */
    float creep;          /* rad/s per m/s^2 */
    float windup;         /* rad, half of the column's wind-up */
    float unwinding;      /* 1/s, at which a motor turns the wheels back to the centre */
    float wind[OC_WINDS]; /* m/s^2 */
    float fifth_wheel;    /* m/s^2, lateral force on the front tyres by a fifth wheel's full friction */
} oc_play;

/* The parameters with a slope, in this order. */
typedef enum {
    OC_SLOPE_CREEP,
    OC_SLOPE_FRICTION,
    OC_SLOPE_UNLOADING,
    OC_SLOPE_WIDTH,
    OC_SLOPE_UNWINDING,
    OC_SLOPE_WINDUP,
    OC_SLOPE_COUNT
} oc_slope;

/* Of a pair of parameters: more of the first, more of the second, less of the first, less of the second. */
enum { OC_BESIDE = 4 };

/* Angles behind the wind-up (wound, w) and behind the play (inner, h): rad, at the sensor. In fours, for SIMD. */
typedef struct {
    float wound, inner;            /* at the hypothesis's own parameters */
    float played[OC_BESIDE];       /* `inner` beside creep and width */
    float loaded[OC_BESIDE];       /* `inner` beside friction and unloading */
    float unwound[OC_BESIDE];      /* `inner` beside unwinding and wind-up */
    float wound_beside[OC_BESIDE]; /* `wound` beside these two; all others leave it as it is */
} oc_places;

/* The operators' input at a sample. */
typedef struct {
    float angle, centre; /* rad, as measured; a motor turns the wind-up to the centre */
    float load;          /* m/s^2, oc_play_load */
    float step_s;
} oc_play_motion;

/* Step of half a width's difference quotient, and the maximum of its move by one solution, rad. */
float oc_play_width_step(float half_width);

/* m/s^2, lateral force on the front tyres: a + kappa c + a_h f - a_w - a_0. */
float oc_play_load(const oc_play *play, const oc_motion_sample *sample);

/* Moves all places on. Adds to the sums the differences of `inner`, rad, at less minus at more of each parameter;
 * returns that of the unloading. Where no lateral force moves the wheels only the width has one. */
float oc_places_move(oc_places *places, const oc_play *play, const oc_play_motion *by, float *sums);

/* The same of `wound` and `inner` alone, rad. */
void oc_play_follow(float *wound, float *inner, const oc_play *play, const oc_play_motion *by);

/* Divisors of the difference quotients: whole widths in rad, m/s^2, creep as a share, 1/s. */
void oc_play_apart(const oc_play *play, float *apart);

#endif

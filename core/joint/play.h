#ifndef OC_PLAY_H
#define OC_PLAY_H
/* A hypothesis's model of the steering (docs/method.md, "Operators"). The column winds up against its friction, and a
 * motor may unwind it. Then comes the free play, through which lateral force beyond friction carries the wheels. Both
 * are the operator of backlash.h, in single precision: a hypothesis set advances hundreds of them. */

#include <stdint.h>

enum { OC_WINDS = 2 };

/* One sample of the motion, some ten a second. */
typedef struct {
    float angle;                /* rad, steering wheel, as measured */
    float rear_part;            /* rad, of the angle: i*w times the rear axle's angle */
    float residual;             /* rad, angle less rear_part and i*L*r/v */
    float force;                /* m/s^2, the same of the play's load, with less of the accelerometer's noise */
    float lateral_acceleration; /* m/s^2, a of the method's model, with the accelerometer's bias */
    float yaw_acceleration;     /* rad/s^2 */
    float jerk;                 /* m/s^3, lateral */
    float curvature;            /* 1/m */
    float fifth_wheel;          /* state of a trailer's fifth wheel in its friction, -1 to 1 */
    float per_speed;            /* s/m, 1 over the speed */
    float tandem;               /* m/s^2, c times curvature: of rear axles that resist turning */
    float wind[OC_WINDS];       /* v/20 cos psi and v/20 sin psi: share of a steady wind's lateral force, 1 at 20 m/s */
    int32_t in_second;          /* index in a second of usable samples, from 0; -1: the gate is closed */
} oc_motion_sample;

typedef struct {
    float half_width;     /* rad, of the play */
    float unloading;      /* m/s^2, a_0 */
    float friction;       /* m/s^2; negative: rubbing, lateral force does not move the wheels in their play */
    float creep;          /* rad/s per m/s^2 */
    float windup;         /* rad, half of the column's wind-up */
    float unwinding;      /* 1/s, at which a motor turns the wheels back to the centre */
    float wind[OC_WINDS]; /* m/s^2 */
    float fifth_wheel;    /* m/s^2, lateral force on the front tyres by a fifth wheel's full friction */
} oc_play;

/* The parameters with a slope. */
typedef enum {
    /* terms.toml: slopes */
    OC_SLOPE_CREEP,
    OC_SLOPE_FRICTION,
    OC_SLOPE_UNLOADING,
    OC_SLOPE_WIDTH,
    OC_SLOPE_UNWINDING,
    OC_SLOPE_WINDUP,
    /* end */
    OC_SLOPE_COUNT
} oc_slope;

/* The variations of a pair of parameters: larger first, larger second, smaller first, smaller second. */
enum { OC_VARIED = 4 };

/* Angles behind the wind-up (wound, w) and behind the play (inner, h), rad at the sensor. Arrays of four, for SIMD. */
typedef struct {
    float wound, inner;            /* at the hypothesis's own parameters */
    float played[OC_VARIED];       /* `inner` at varied creep and width */
    float loaded[OC_VARIED];       /* `inner` at varied friction and unloading */
    float unwound[OC_VARIED];      /* `inner` at varied unwinding and wind-up */
    float wound_varied[OC_VARIED]; /* `wound` at these two; the others do not change it */
} oc_places;

/* The operators' input at a sample. */
typedef struct {
    float angle, centre; /* rad, as measured; angle to which a motor unwinds the column */
    float load;          /* m/s^2, oc_play_load */
    float step_s;
} oc_play_motion;

/* rad, step of a difference quotient by half a width, and the maximum change of half a width by one solution. */
float oc_play_width_step(float half_width);

/* m/s^2, lateral force on the front tyres: a + kappa c + a_h f - a_w - a_0. */
float oc_play_load(const oc_play *play, const oc_motion_sample *sample);

/* Advances all places. Adds to the sums the difference of `inner`, rad, at the smaller less at the larger value of each
 * parameter; returns the unloading's. A rubbing play has only the width's. */
float oc_places_move(oc_places *places, const oc_play *play, const oc_play_motion *by, float *sums);

/* Advances `wound` and `inner` alone, rad. */
void oc_play_follow(float *wound, float *inner, const oc_play *play, const oc_play_motion *by);

/* Divisors of the difference quotients: full widths in rad, m/s^2, creep as a share, 1/s. */
void oc_play_divisors(const oc_play *play, float *divisors);

#endif

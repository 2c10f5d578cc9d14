#ifndef OC_PLAY_H
#define OC_PLAY_H
/* How the steering plays, as a hypothesis has it: first the column winds up against its friction, and a motor may
 * unwind it; behind that lies a play, through which side force carries the wheels beyond friction. Each is the operator
 * of backlash.h, here in single precision: a bank moves hundreds of them. */

#include <stdint.h>

enum { OC_WINDS = 2 };

/* One sample of the motion, some ten a second. */
typedef struct {
    double angle;               /* rad, steering wheel, as measured */
    float residual;             /* rad, angle less i*L*r/v */
    float lateral_acceleration; /* m/s^2, what the tyres carry, with the accelerometer's bias */
    float yaw_acceleration;     /* rad/s^2 */
    float jerk;                 /* m/s^3, lateral */
    float curvature;            /* 1/m */
    float per_speed;            /* s/m, 1 over the speed */
    float tandem;               /* m/s^2, what the front tyres carry beyond that since axles behind resist turning */
    float wind[OC_WINDS];       /* how much of the side force by a steady wind acts now, 1 at 20 m/s: of one from the
                                 * side at the drive's first heading, and of one from a quarter turn on */
    int32_t in_second;          /* its number in a second of usable samples, from 0; -1: the gate is shut */
} oc_motion_sample;

typedef struct {
    float half_width;     /* rad, of the play */
    float unloading;      /* m/s^2, a_0 */
    float friction;       /* m/s^2; negative: no side force moves the wheels in their play */
    float creep;          /* rad/s per m/s^2 */
    float windup;         /* rad, half of what the column winds up in all */
    float unwinding;      /* 1/s, at which a motor turns the wheels back to the centre */
    float wind[OC_WINDS]; /* m/s^2 */
} oc_play;

/* What a slope of the model is taken by, in this order. */
typedef enum {
    OC_SLOPE_CREEP,
    OC_SLOPE_FRICTION,
    OC_SLOPE_UNLOADING,
    OC_SLOPE_WIDTH,
    OC_SLOPE_UNWINDING,
    OC_SLOPE_WINDUP,
    OC_SLOPE_COUNT
} oc_slope;

/* Of a pair of parameters: a little more of the first, of the second, a little less of the first, of the second. */
enum { OC_BESIDE = 4 };

/* Where the measured angle is behind the wind-up, and behind the play as well: rad, as the sensor would say it. By
 * pairs, since many a processor moves four at once. */
typedef struct {
    float wound, inner;            /* at the play itself, and */
    float played[OC_BESIDE];       /* `inner` beside creep and width, */
    float loaded[OC_BESIDE];       /* beside friction and unloading, */
    float unwound[OC_BESIDE];      /* beside unwinding and wind-up, which alone move */
    float wound_beside[OC_BESIDE]; /* `wound` */
} oc_places;

/* What moves them at a sample. */
typedef struct {
    float angle, centre; /* rad, as measured; a motor turns the wind-up to the centre */
    float load;          /* m/s^2, oc_play_load */
    float step_s;
} oc_play_motion;

/* By how much one sample's evidence may move a width, rad of half of it: as far as its slope is taken. */
float oc_play_width_step(float half_width);

/* m/s^2, side force on the front wheels, less what the accelerometer is off by and what the wind carries. */
float oc_play_load(const oc_play *play, const oc_motion_sample *sample);

/* Moves all places on, and adds to the sums what `inner` loses, rad, from a little less to a little more of each
 * parameter; returns that of the unloading. Where no side force moves the wheels only the width makes one. */
float oc_places_move(oc_places *places, const oc_play *play, const oc_play_motion *by, float *sums);

/* The same of the places at and behind the play alone, rad. */
void oc_play_follow(float *wound, float *inner, const oc_play *play, const oc_play_motion *by);

/* How far a little more and less are apart, by which a sum of differences is one of slopes: whole widths in rad, m/s^2,
 * creep as a share, 1/s. */
void oc_play_apart(const oc_play *play, float *apart);

#endif

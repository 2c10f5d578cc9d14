#ifndef OC_ESTIMATE_H
#define OC_ESTIMATE_H
/* An estimate: value, standard deviation, evidence and status. */

#include <stdint.h>

typedef enum {
    OC_UNOBSERVABLE, /* the prior decides */
    OC_CONVERGING,   /* there is evidence, the interval is still too wide */
    OC_VALID,        /* evidence conditions met and the interval narrow enough */
    OC_INVALID,      /* a signal is at fault: the value is what it was before */
    OC_STATUS_COUNT
} oc_status;

typedef struct {
    double value;              /* in SI; means nothing while unobservable */
    double standard_deviation; /* of the truth about the value, s: +-1.96 s is a 95 % interval, Student's factor
                                * included; the narrowest is +-1.96 sqrt(s^2 - lean^2) about value + lean */
    double evidence;           /* s of driving behind the value */
    oc_status status;
    float lean;                /* middle of the narrowest interval less the value */
} oc_estimate;

/* The two parts of the offset's uncertainty (docs/method.md, "Two parts"): the drive's own part, and what moves
 * the neutral lateral acceleration beside the accelerometer's bias, which no single drive identifies. */
typedef struct {
    float drive_sd;                    /* rad: +-1.96 of it is a 95 % interval where nothing pulls */
    float pull_sd, wind_sd, set_up_sd; /* rad, each about the offset; set_up: an axle set up to unload on the crown */
    float per_acceleration;            /* rad/(m/s^2): what pull and wind move the offset by */
} oc_offset_parts;

/* Status by the 95 % half-width, with hysteresis: valid from `narrow` on, lost above 4/3 of it. */
oc_status oc_status_next(oc_status now, double standard_deviation, double narrow);

/* Factor of 1.96 where the spread comes from so few batches: Student's t at 97.5 % over 1.96. */
double oc_few_batches_factor(double batches);

#endif

#ifndef OC_ESTIMATE_H
#define OC_ESTIMATE_H
/* An estimate: value, standard deviation, evidence and status. */

#include <stdint.h>

typedef enum {
    OC_UNOBSERVABLE, /* the prior decides */
    OC_CONVERGING,   /* there is evidence, the interval is still too wide */
    OC_VALID,        /* evidence conditions met and the interval narrow enough */
    OC_INVALID,      /* a signal is at fault: the value is from before */
    OC_STATUS_COUNT
} oc_status;

typedef struct {
    double value;              /* in SI; meaningless while unobservable */
    double standard_deviation; /* s, of the error, with Student's factor: value +-1.96 s is a 95 % interval; the
                                * narrowest one is value + lean +-1.96 sqrt(s^2 - lean^2) */
    double evidence;           /* s of driving in the value */
    oc_status status;
    float lean;                /* middle of the narrowest interval less the value */
} oc_estimate;

/* Parts of the offset's uncertainty (docs/method.md, "Two parts"): the drive's part, and shifts of the neutral lateral
 * acceleration that are not identifiable from one drive. */
typedef struct {
    float drive_sd;                    /* rad: +-1.96 of it is a 95 % interval without pull and wind */
    float pull_sd, wind_sd, set_up_sd; /* rad, each about the offset; set_up: axle set up to be neutral on the crown */
    float per_acceleration;            /* rad/(m/s^2), shift of the offset by pull and wind */
} oc_offset_parts;

/* Status by the 95 % half-width, with hysteresis: valid up to `narrow`, and then up to 4/3 of it. */
oc_status oc_status_next(oc_status now, double standard_deviation, double narrow);

/* Factor of 1.96 for few batches: Student's t at 97.5 % over 1.96. */
double oc_few_batches_factor(double batches);

#endif

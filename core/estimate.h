#ifndef OC_ESTIMATE_H
#define OC_ESTIMATE_H
/* How every answer travels: its value never without its spread, its evidence and its standing. */

#include <stdint.h>

typedef enum {
    OC_UNOBSERVABLE, /* the drive does not tell: the prior decides */
    OC_CONVERGING,   /* there is evidence, the interval is still too wide */
    OC_VALID,        /* evidence conditions met and the interval narrow enough */
    OC_INVALID,      /* a signal is at fault: the value is what it was before */
    OC_STATUS_COUNT
} oc_status;

typedef struct {
    double value;              /* in SI; means nothing while unobservable */
    double standard_deviation; /* of the truth about the value: 1.96 of it on both sides is a 95 % interval, few batches
                                * accounted for; the narrowest has 1.96 of the root of its square less lean's */
    double evidence;           /* s of driving behind the value */
    oc_status status;
    float lean;                /* the middle of that interval, less the value */
} oc_estimate;

/* The status that a 95 % half-width earns, with hysteresis: valid is won below `narrow` and lost above 4/3 of it. */
oc_status oc_status_next(oc_status now, double standard_deviation, double narrow);

/* What 1.96 must be multiplied by when the spread comes from so few batches: Student's t at 97.5 % over 1.96. */
double oc_few_batches_factor(double batches);

#endif

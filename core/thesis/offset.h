#ifndef OC_OFFSET_H
#define OC_OFFSET_H
/* The thesis's estimator, (36) and (37): the mean of the measured angle less the steady state, nearly straight ahead.
 * Each part has its own mean, so that an understeer gradient or yaw rate bias that is learned later applies to all
 * evidence. */

#include "estimate.h"
#include "mean.h"

typedef struct {
    oc_moments ticks;   /* over all ticks used */
    oc_moments filling; /* the growing batch */
    oc_moments batches; /* over the means of whole batches, weight 1 each */
} oc_offset;

void oc_offset_update(oc_offset *offset, const oc_moments *block, double ticks_per_batch);

/* rad; (42) for a given K_us/g in rad/(m/s^2) at the road wheel. */
double oc_offset_value(const oc_offset *offset, double understeer_gradient);

/* rad^2; (43) as printed, for independent ticks. Far too small, since ticks are correlated for seconds. */
double oc_offset_variance_if_independent(const oc_offset *offset, double understeer_gradient);

/* rad^2, by the scatter of batch means, with Student's factor; 10 rad^2 below two batches. */
double oc_offset_variance(const oc_offset *offset, double understeer_gradient);

#endif

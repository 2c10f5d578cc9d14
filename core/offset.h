#ifndef OC_OFFSET_H
#define OC_OFFSET_H
/* The thesis's estimator, (36) and (37): the mean of what is left of the measured angle when the steady state is taken
 * away, nearly straight ahead. The means of its parts are kept instead of their sum's, so that an understeer gradient
 * or a yaw-rate bias that is learned later applies to all that was gathered. */

#include "estimate.h"
#include "mean.h"

typedef struct {
    oc_moments ticks;   /* over all ticks used */
    oc_moments filling; /* the batch that grows */
    oc_moments batches; /* over the means of whole batches, weight 1 each */
} oc_offset;

void oc_offset_update(oc_offset *offset, const oc_moments *block, double ticks_per_batch);

/* rad; (42) for a given K_us/g in rad/(m/s^2) at the road wheel. */
double oc_offset_value(const oc_offset *offset, double understeer_gradient);

/* rad^2; (43) as printed: as if no tick resembled the one before it. They do, for seconds: far too small. */
double oc_offset_variance_if_independent(const oc_offset *offset, double understeer_gradient);

/* rad^2; from the scatter of batch means,
 * few batches accounted for; 10 rad^2, which is knowing nothing, below two batches. */
double oc_offset_variance(const oc_offset *offset, double understeer_gradient);

#endif

#ifndef OC_SAVED_PLAUSIBLE_H
#define OC_SAVED_PLAUSIBLE_H
/* Whether an intact image holds what a drive can have taught. */

#include <stdbool.h>

#include "monitor.h"

/* Places beyond their arrays, sums of squares below none, covariances that are none, equations without a solution:
 * whatever would bring the core down or let it tell what is no number. The state is not changed. */
bool oc_saved_plausible(const oc_state *state, const oc_coefficients *coefficients);

#endif

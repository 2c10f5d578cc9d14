#ifndef OC_SAVED_PLAUSIBLE_H
#define OC_SAVED_PLAUSIBLE_H
/* Whether an intact image's values can come from a drive. */

#include <stdbool.h>

#include "monitor.h"

/* Rejects all that could crash the core or give NaN: places beyond arrays, negative sums of squares, invalid
 * covariances, equations without a solution. The state is not changed. */
bool oc_saved_plausible(const oc_state *state, const oc_coefficients *coefficients);

#endif

#ifndef OC_SAVED_PLAUSIBLE_H
#define OC_SAVED_PLAUSIBLE_H
/* Whether the values of an intact image can be the result of a drive. */

#include <stdbool.h>

#include "monitor.h"

/* Rejects values that could crash the core or produce NaN: indices beyond arrays, negative sums of squares, invalid
 * covariances, equations without a solution. Does not change the state. */
bool oc_saved_plausible(const oc_state *state, const oc_coefficients *coefficients);

#endif

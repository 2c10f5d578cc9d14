#include "estimate.h"

oc_status oc_status_next(oc_status now, double standard_deviation, double narrow) {
    const double limit = now == OC_VALID ? 4.0 / 3.0 * narrow : narrow;
    return 1.96 * standard_deviation <= limit ? OC_VALID : OC_CONVERGING;
}

double oc_few_batches_factor(double batches) {
    const float freedom = (float)batches - 1.0f;
    if (!(freedom > 1.5f)) {
        return 12.706 / 1.96;
    }
    /* Fisher and Cornish's expansion of Student's quantile about the normal one; 0.8 % low at 2 degrees of freedom. */
    const float f = 1.0f / freedom;
    return (double)(1.0f + f * (2.3723f + f * (2.8225f + f * (2.5559f + f * 1.5896f))) / 1.96f);
}

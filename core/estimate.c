#include "estimate.h"

oc_status oc_status_next(oc_status now, double half_width, double narrow, double wide) {
    const double limit = now == OC_VALID ? wide : narrow;
    return half_width <= limit ? OC_VALID : OC_CONVERGING;
}

double oc_few_batches_factor(double batches) {
    const double freedom = batches - 1.0;
    if (!(freedom > 1.5)) {
        return 12.706 / 1.96;
    }
    /* Fisher and Cornish's expansion of Student's quantile about the normal one; 0.8 % low at two degrees of freedom. */
    const double f = 1.0 / freedom;
    return 1.0 + f * (2.3723 + f * (2.8225 + f * (2.5559 + f * 1.5896))) / 1.96;
}

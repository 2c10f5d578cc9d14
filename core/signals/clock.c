#include "clock.h"

#include <math.h>

oc_clock_verdict oc_clock_update(oc_clock *clock, int32_t ticks_until_new_clock, double time) {
    const bool forward = !clock->started || time > clock->last_time;
    if (!(fabs(time) < 1e18)) {
        return OC_CLOCK_REJECTS;
    }
    if (!forward) {
        clock->rejected_in_order = time > clock->last_rejected ? clock->rejected_in_order + 1 : 0;
        clock->last_rejected = time;
        if (clock->rejected_in_order < ticks_until_new_clock) {
            return OC_CLOCK_REJECTS;
        }
    }
    clock->rejected_in_order = 0;
    clock->last_time = time;
    clock->started = 1;
    return forward ? OC_CLOCK_ADVANCES : OC_CLOCK_SET_BACK;
}

#include "clock.h"

#include <math.h>

/* Tuned, in tuned.toml: clock */
/* factor between the rate of the ticks and the rate that was set up, from which on ticks are rejected */
static const double rate_factor_max = 1.5;
/* successive seconds of ticks at another rate until ticks are rejected, after one at the right rate */
static const int32_t wrong_windows_max = 10;
/* end */

static void begin_window(oc_clock *clock, double time) {
    clock->window_begin = time;
    clock->window_ticks = 0;
    clock->longest = 0.0;
}

/* After each window of ticks: whether its time, less one hole, fits the rate. The first window decides at once. Later
 * several holes or lost ticks may spoil some. */
static void measure_rate(oc_clock *clock, int32_t ticks_per_window, double tick_s, double time) {
    const double step = time - clock->last_time;
    if (step > clock->longest) {
        clock->longest = step;
    }
    if (clock->window_ticks < ticks_per_window) {
        return;
    }
    const double by_rate = (double)(clock->window_ticks - 1) * tick_s;
    const double measured = time - clock->window_begin - clock->longest;
    if (measured < rate_factor_max * by_rate && measured * rate_factor_max > by_rate) {
        clock->rate_trust = wrong_windows_max;
    } else if (clock->rate_trust >= 0) {
        clock->rate_trust -= 1;
    }
    begin_window(clock, time);
}

oc_clock_verdict oc_clock_update(oc_clock *clock, int32_t ticks_per_window, double tick_s, double time) {
    const bool forward = !clock->started || time > clock->last_time;
    if (!(fabs(time) < 1e18)) {
        return OC_CLOCK_REJECTS;
    }
    clock->window_ticks += 1;
    if (!forward) {
        clock->rejected_in_order = time > clock->last_rejected ? clock->rejected_in_order + 1 : 0;
        clock->last_rejected = time;
        if (clock->rejected_in_order < ticks_per_window) {
            return OC_CLOCK_REJECTS;
        }
    }
    if (!forward || !clock->started) {
        begin_window(clock, time);
        clock->rate_trust = 0;
    } else {
        measure_rate(clock, ticks_per_window, tick_s, time);
    }
    clock->rejected_in_order = 0;
    clock->last_time = time;
    clock->started = 1;
    if (clock->rate_trust < 0) {
        return OC_CLOCK_REJECTS;
    }
    return forward ? OC_CLOCK_ADVANCES : OC_CLOCK_SET_BACK;
}

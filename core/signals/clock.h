#ifndef OC_CLOCK_H
#define OC_CLOCK_H
/* Rejects ticks whose time does not increase, and ticks at another rate than set up. A second of ticks in order at
 * earlier times means a clock set back. */

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    double last_time;            /* s, of the last accepted tick */
    double last_rejected;        /* s */
    int32_t rejected_in_order;   /* successive rejected ticks, each later than the previous one */
    int32_t started;
    double window_begin;         /* s, first tick of the window in which the rate is measured */
    double longest;              /* s, between two ticks of the window */
    int32_t window_ticks;        /* since its first, rejected ones included */
    int32_t rate_trust;          /* windows at a wrong rate until the rate counts as wrong; negative: it does */
} oc_clock;

typedef enum { OC_CLOCK_REJECTS, OC_CLOCK_ADVANCES, OC_CLOCK_SET_BACK } oc_clock_verdict;

/* `ticks_per_window`: ticks in which the rate is measured, and successive rejected ticks until the clock counts as set
 * back. `tick_s`: s, by the rate that was set up. */
oc_clock_verdict oc_clock_update(oc_clock *clock, int32_t ticks_per_window, double tick_s, double time);

#endif

#ifndef OC_CLOCK_H
#define OC_CLOCK_H
/* Time goes forward, or a tick is refused; a whole second of ticks in order on an earlier clock is the new time. */

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    double last_time;           /* s, of the last tick that was not refused */
    double last_refused;        /* s */
    int32_t refused_in_order;   /* ticks in a row that were not later, each later than the one before it */
    int32_t started;
} oc_clock;

typedef enum { OC_CLOCK_REFUSES, OC_CLOCK_ADVANCES, OC_CLOCK_SET_BACK } oc_clock_verdict;

/* `ticks_until_new_clock`: refused in order, until it is the clock that was set back. */
oc_clock_verdict oc_clock_update(oc_clock *clock, int32_t ticks_until_new_clock, double time);

#endif

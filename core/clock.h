#ifndef OC_CLOCK_H
#define OC_CLOCK_H
/* Discards a tick whose time does not increase. A second of ticks in order on an earlier clock sets a new time. */

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    double last_time;           /* s, of the last accepted tick */
    double last_rejected;        /* s */
    int32_t rejected_in_order;   /* consecutive refused ticks, each later than its predecessor */
    int32_t started;
} oc_clock;

typedef enum { OC_CLOCK_REJECTS, OC_CLOCK_ADVANCES, OC_CLOCK_SET_BACK } oc_clock_verdict;

/* `ticks_until_new_clock`: refused in order, after which the clock counts as set back. */
oc_clock_verdict oc_clock_update(oc_clock *clock, int32_t ticks_until_new_clock, double time);

#endif

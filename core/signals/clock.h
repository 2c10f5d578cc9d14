#ifndef OC_CLOCK_H
#define OC_CLOCK_H
/* Rejects ticks whose time does not increase. A second of ticks in order at earlier times means a clock set back. */

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    double last_time;            /* s, of the last accepted tick */
    double last_rejected;        /* s */
    int32_t rejected_in_order;   /* successive rejected ticks, each later than the previous one */
    int32_t started;
} oc_clock;

typedef enum { OC_CLOCK_REJECTS, OC_CLOCK_ADVANCES, OC_CLOCK_SET_BACK } oc_clock_verdict;

/* `ticks_until_new_clock`: successive rejected ticks until the clock counts as set back. */
oc_clock_verdict oc_clock_update(oc_clock *clock, int32_t ticks_until_new_clock, double time);

#endif

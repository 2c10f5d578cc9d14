#ifndef OC_STATUS_WATCH_H
#define OC_STATUS_WATCH_H
/* The statuses of the truck's controllers, debounced: some wrong messages change nothing. */

#include <stdint.h>

#include "signals.h"

enum { OC_WATCHED_STATUSES = 5 };

typedef struct {
    float differs_s[OC_WATCHED_STATUSES]; /* s with the other value, less those with the settled one */
    float intervenes_s;                          /* s, of the present intervention */
    int32_t known, is_true;                      /* oc_signal_bit */
} oc_status_watch;

/* The bits of the available statuses that are true. The first value of a status counts at once. An intervention that
 * does not end is none. */
uint32_t oc_status_watch_update(oc_status_watch *watch, const oc_signals *tick, float tick_s);

#endif

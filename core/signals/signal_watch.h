#ifndef OC_SIGNAL_WATCH_H
#define OC_SIGNAL_WATCH_H
/* One signal by itself: missing samples that a file or a gateway fills with a number, and a value that never changes.
 *
 * A filled gap is a jump to a value and a jump away from it. Jumps that land again and again on the same value are no
 * motion of a truck. */

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    float last, before_last;   /* values of the last two ticks */
    float jump;                /* minimum change in a tick that is a jump */
    float change;              /* mean change in a tick, without jumps */
    float moved, jumped_in_step; /* sums of the changes in this step without jumps, and of the jumps */
    float moved_by_two;        /* sum of the changes over two ticks, with jumps */
    float alternation;         /* mean change in two ticks over that in one, with jumps */
    float resolution;          /* minimum change */
    float filled;              /* value that jumps land on */
    float landed, missed;      /* number of jumps since it is this value: on it, and on another value */
    float jumps;               /* number of jumps that no truck makes */
    float counted;             /* part of the last jump in it */
    float jumped;              /* size of the last jump */
    float impossible_s;        /* s with values that no truck has */
    float filled_s;            /* s at it after a jump */
    float zero_share;          /* of the time at exactly 0 */
    float observed_s;          /* s */
    int32_t held_ticks;        /* since the last change */
} oc_signal_watch;

/* The first tick. */
void oc_signal_watch_begin(oc_signal_watch *watch, float value, float jump_min);

/* Each further tick; `impossible`: a change in a tick that no truck makes. */
void oc_signal_watch_update(oc_signal_watch *watch, float value, float impossible);

/* After each step of `ticks` ticks, which are step_s seconds. `jump_min`: minimum change of a jump, in the signal's
 * unit. */
void oc_signal_watch_end_step(oc_signal_watch *watch, float jump_min, float ticks, float step_s);

/* s, of the jumps and of missed changes. */
float oc_signal_memory_s(void);

/* Minimum change so far; 0 before any. */
float oc_signal_resolution(const oc_signal_watch *watch);

/* Whether gaps of the signal are filled with a number, and this number. */
bool oc_signal_is_filled(const oc_signal_watch *watch);
float oc_signal_filled_with(const oc_signal_watch *watch);

/* Whether it jumps as no truck does, or has values that no truck has: wrong bits, or a wrapped angle. */
bool oc_signal_jumps(const oc_signal_watch *watch);

#endif

#ifndef OC_CHANGE_H
#define OC_CHANGE_H
/* Detects changes by CUSUMs on prediction errors (docs/method.md, "Change"): one for the offset, one for bends that
 * need another angle, as after loading or lifting an axle. During a suspicion nothing is learned, so the answer is
 * constant until a change is proven. */

#include <stdbool.h>

typedef enum {
    OC_CHANGE_NONE,
    OC_CHANGE_OFFSET, /* the sensor reads more or less at all times */
    OC_CHANGE_BENDS   /* bends need another angle, straights the same */
} oc_change_kind;

/* Two sums, for positive and negative errors, and the seconds since either left zero. */
typedef struct {
    float up, down, seconds_up, seconds_down;
} oc_cusum;

typedef struct {
    oc_cusum offset, bends;
    float pause_s;           /* s, remaining time without suspicion */
    float seconds, error, error_curvature, curvature_squares; /* sums since the suspicion began */
} oc_change_watch;

typedef struct {
    oc_change_kind kind;
    float size, size_sd; /* OC_CHANGE_OFFSET: rad */
    float seconds;       /* of driving since its onset */
} oc_change;

/* One second. error, min_error: rad, prediction error of the best hypothesis, and the minimum of all; noise_sd: rad, of
 * errors of weight 1; curvature: 1/m; weight: 1 or less. The minimum decides on a change, the best one's error gives
 * its size. Returns a proven change once; then the watch begins anew. */
oc_change oc_change_update(oc_change_watch *watch, float error, float min_error, float noise_sd, float curvature,
                           float weight);

/* The place in the play is unknown, which causes errors: no change is suspected for a while. */
void oc_change_settle(oc_change_watch *watch);

bool oc_change_suspected(const oc_change_watch *watch);

#endif

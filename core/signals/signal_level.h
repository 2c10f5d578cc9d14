#ifndef OC_SIGNAL_LEVEL_H
#define OC_SIGNAL_LEVEL_H
/* One signal in steps of 0.1 s, against the others' prediction of it: noise, a stuck value, the end of a range. */

#include <stdbool.h>
#include <stdint.h>

#include "signal_watch.h"

typedef struct {
    float mean, last;
    float means;               /* number of means over 0.5 s */
    float variance;            /* of them */
    float half_squares;        /* mean of half the square of the difference of two successive such means */
    float prediction;          /* mean over about a second */
    float low, high;           /* of it, since the signal last changed */
    float steps;               /* with a prediction, since then */
    float held_s;              /* s without a change, as of the step before */
    float held_max_s;          /* s, longest such time before, other than at zero */
    float varied_s;            /* s with changes */
    float held_value;          /* value of the present or last time without a change */
    float missed_value;        /* value of the last time in which the signal missed a change */
    float missed;              /* number of such times */
    float missed_there;        /* number of those at the same distance from zero as the one before */
} oc_signal_level;

/* A step: of the signal as the others predict it, if `has_prediction`. `missed_min`: minimum change of the prediction
 * that the signal cannot miss; in its unit. */
void oc_signal_level_follow(oc_signal_level *level, const oc_signal_watch *watch, float held_s, float step_s,
                            bool has_prediction, float prediction, float missed_min);

/* A mean of the signal over five steps. */
void oc_signal_level_add(oc_signal_level *level, float mean);

/* Whether it is stuck: for long enough at a value while the prediction changes, or, `alone`, for far longer than ever
 * before. */
bool oc_signal_is_stuck(const oc_signal_level *level, const oc_signal_watch *watch, float held_s, float step_s,
                        float missed_min, bool alone);

/* s, minimum time of a stuck value. */
float oc_signal_stuck_s(void);

/* Share of a value within which two ends of a range are the same; number of times that is no chance. */
float oc_signal_same_end(void);
float oc_signal_often(void);

/* Whether it has missed changes again and again. */
bool oc_signal_misses(const oc_signal_level *level);

/* Whether it has missed them at one value. */
bool oc_signal_is_clipped(const oc_signal_level *level);

/* Whether its means differ as much as all its values; `noise_min`: minimum standard deviation, in its unit. */
bool oc_signal_is_noise(const oc_signal_level *level, float noise_min);

#endif

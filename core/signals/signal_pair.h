#ifndef OC_SIGNAL_PAIR_H
#define OC_SIGNAL_PAIR_H
/* Two signals that show the same lateral acceleration, in steps of 0.1 s: their likeness, lag and sizes, by changes
 * over 0.5 s, which have no zero errors. Bends count, not minutes: the sums are halved once they hold enough motion. */

#include <stdbool.h>
#include <stdint.h>

enum { OC_LAGS = 12, OC_LAG_COUNT = 2 * OC_LAGS + 1, OC_MEAN_RING = 16 };

/* The lateral acceleration by one signal. */
typedef struct {
    float means[OC_MEAN_RING]; /* m/s^2, of steps; rings with a common place */
    float change;              /* m/s^2, of these means over 0.5 s */
    float typical;             /* m/s^2, mean size of a change */
    float noise;               /* (m/s^2)^2, variance of a change by white noise */
    float low, high;           /* of the signal itself, in its unit */
    float left_s, right_s;     /* s to either side */
    int32_t steps;             /* successive ones */
} oc_witness;

/* Sums over the changes, (m/s^2)^2, each by its weight; so each product has two. */
typedef struct {
    float firsts[OC_MEAN_RING]; /* m/s^2, changes times their weights of 0 to 1; in the ring of the means */
    float seconds[2 * OC_LAG_COUNT]; /* the same, each twice, so that a history is one piece at any place of the ring */
    float products[OC_LAG_COUNT]; /* with the second later by -OC_LAGS to OC_LAGS steps */
    float first, second;       /* squares */
    float slow_first, slow_second; /* squares at low speed, where understeer and banked bends hardly count */
    float left_of_first, right_of_first, left_of_second, right_of_second; /* products without lag, by the sign of one */
    float steps, slow_steps;
    int32_t oldest;            /* place of the oldest in the ring of OC_LAG_COUNT `seconds` */
    int32_t halved;            /* the sums held enough motion once */
} oc_signal_pair;

typedef struct {
    float likeness;            /* -1 to 1, at the lag with the largest size */
    float lag_s;               /* of the second */
    float motion;              /* share of the motion in both signals' changes, the rest is noise; 0 to 1 */
    float size;                /* of the first's motion over that of the second; at low speed if `is_slow` */
    bool is_slow;
    bool enough;
    bool has_lag;              /* the lag is distinct: a steady ramp is like itself at any lag */
} oc_pair_comparison;

/* m/s^2: minimum lateral acceleration that has a side; below it a truck hardly turns. */
float oc_signal_side(void);

/* A step at `place`; `raw`: mean of the signal in its unit; without `has` the history breaks. */
void oc_witness_add(oc_witness *witness, int32_t place, bool has, float raw, float lateral, float step_s);

/* The same place, after both witnesses. */
void oc_signal_pair_add(oc_signal_pair *pair, const oc_witness *first, const oc_witness *second, int32_t place,
                        bool slow);

void oc_signal_pair_compare(oc_pair_comparison *comparison, const oc_signal_pair *pair, const oc_witness *first,
                            const oc_witness *second, float step_s);

/* -1 or 1: the signals move together, with this sign; 0: they do not, or too little. */
int32_t oc_pair_agreement(const oc_pair_comparison *pair);

/* Whether the signals have no common motion. Noise in one of them hides it; a trusted signal has none. */
bool oc_pair_is_unlike(const oc_pair_comparison *pair, bool trusts_first, bool trusts_second);

/* Whether the signal has one sign only, or a truck that turns to both sides. */
bool oc_witness_is_one_sided(const oc_witness *witness);
bool oc_witness_is_two_sided(const oc_witness *witness);

/* Whether left and right contradict each other in the other signal of the pair, so that it has no sign. */
bool oc_pair_is_folded(const oc_signal_pair *pair, float left, float right);

#endif

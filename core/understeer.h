#ifndef OC_UNDERSTEER_H
#define OC_UNDERSTEER_H
/* (38): the understeer gradient once the offset is trusted, as the slope through the origin of
 * (measured angle - offset)/i - L*r/v on the lateral acceleration, in bends. All at the steering wheel inside:
 * y = angle - i*L*r/v and x = i*a_y, so that their slope is K_us/g at the road wheel. */

#include "mean.h"

typedef struct {
    double x, xy, xx;              /* sums over all ticks used */
    double weight;                 /* ticks */
    oc_moments filling;            /* the batch that grows */
    double batches;                /* whole ones */
    double batches_xx;             /* sum over them */
    double xy_xy, x_x, xx_xx, xy_x, xy_xx, x_xx; /* squares and products of the batches' sums */
} oc_understeer;

void oc_understeer_update(oc_understeer *understeer, const oc_moments *block, double ticks_per_batch);

/* rad/(m/s^2) for an offset in rad. */
double oc_understeer_value(const oc_understeer *understeer, double offset);

/* Squared unit of the value; from the scatter of batches at that offset. 1, which is knowing nothing, below two
 * batches. */
double oc_understeer_variance(const oc_understeer *understeer, double offset, double understeer_gradient);

/* How far the gradient moves per rad of offset, 1/(m/s^2): its sign tells which bends prevail. */
double oc_understeer_per_offset(const oc_understeer *understeer);

/* How well bends part the gradient from the offset that straights with this mean of x leave open: 1 at best, 0 not at
 * all, as when straights and bends have the same mix of signs because the accelerometer's bias is large. Both errors
 * grow by its inverse. */
double oc_understeer_apart(const oc_understeer *understeer, double straight_x);

/* The pair that satisfies (37) and (38) at once: the gradient for the offset that this gradient gives, when the
 * straights' means of y and x are as given. Only where oc_understeer_apart is well above 0. */
double oc_understeer_with_offset(const oc_understeer *understeer, double straight_y, double straight_x);

#endif

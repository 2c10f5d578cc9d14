#ifndef OC_UNDERSTEER_H
#define OC_UNDERSTEER_H
/* (38): the understeer gradient in bends, once the offset is trusted: the slope through the origin of
 *     (measured angle - offset)/i - L*r/v
 * over the lateral acceleration. Sums are at the steering wheel, of y = angle - i*L*r/v and x = i*a_y. So the slope of
 * y over x is K_us/g at the road wheel. */

#include "mean.h"

typedef struct {
    double x, xy, xx;              /* sums over all ticks used */
    double weight;                 /* ticks */
    oc_moments filling;            /* the growing batch */
    double batches;                /* whole ones */
    double batches_xx;             /* sum over them */
    double xy_xy, x_x, xx_xx, xy_x, xy_xx, x_xx; /* squares and products of the batches' sums */
} oc_understeer;

void oc_understeer_update(oc_understeer *understeer, const oc_moments *block, double ticks_per_batch);

/* rad/(m/s^2) for an offset in rad. */
double oc_understeer_value(const oc_understeer *understeer, double offset);

/* (rad/(m/s^2))^2, by the scatter of batches at that offset; 1 below two batches. */
double oc_understeer_variance(const oc_understeer *understeer, double offset, double understeer_gradient);

/* 1/(m/s^2), derivative of the gradient by the offset; negative where left bends prevail. */
double oc_understeer_per_offset(const oc_understeer *understeer);

/* Separability of gradient and offset; straight_x: mean of x on straights. Usually near 1; 0 where straights and bends
 * have the same signs of x, as with a large accelerometer bias. Both errors are proportional to its inverse. */
double oc_understeer_separability(const oc_understeer *understeer, double straight_x);

/* The gradient that satisfies (37) and (38) at once, for the straights' means of y and x. Only where
 * oc_understeer_apart is well above 0. */
double oc_understeer_with_offset(const oc_understeer *understeer, double straight_y, double straight_x);

#endif

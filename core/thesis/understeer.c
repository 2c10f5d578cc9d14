#include "understeer.h"

#include "estimate.h"

/* Numerical. */
static const double gradient_variance_unknown = 1.0; /* (rad/(m/s^2))^2, for unknown: sd 57 deg/(m/s^2) */

void oc_understeer_update(oc_understeer *understeer, const oc_moments *block, double ticks_per_batch) {
    const double sum = block->weight * block->x;
    understeer->weight += block->weight;
    understeer->x += sum;
    understeer->xx += block->xx + sum * block->x;
    understeer->xy += block->xy + sum * block->y;

    oc_moments_merge(&understeer->filling, block);
    const oc_moments *b = &understeer->filling;
    if (b->weight < ticks_per_batch) {
        return;
    }
    const double x = b->weight * b->x;
    const double xx = b->xx + x * b->x;
    const double xy = b->xy + x * b->y;
    understeer->batches += 1.0;
    understeer->batches_xx += xx;
    understeer->xy_xy += xy * xy;
    understeer->x_x += x * x;
    understeer->xx_xx += xx * xx;
    understeer->xy_x += xy * x;
    understeer->xy_xx += xy * xx;
    understeer->x_xx += x * xx;
    understeer->filling = (oc_moments){0};
}

double oc_understeer_value(const oc_understeer *understeer, double offset) {
    return understeer->xx > 0.0 ? (understeer->xy - offset * understeer->x) / understeer->xx : 0.0;
}

double oc_understeer_per_offset(const oc_understeer *understeer) {
    return understeer->xx > 0.0 ? -understeer->x / understeer->xx : 0.0;
}

double oc_understeer_separability(const oc_understeer *understeer, double straight_x) {
    return understeer->xx > 0.0 ? 1.0 - straight_x * understeer->x / understeer->xx : 0.0;
}

double oc_understeer_with_offset(const oc_understeer *understeer, double straight_y, double straight_x) {
    return oc_understeer_value(understeer, straight_y) / oc_understeer_separability(understeer, straight_x);
}

double oc_understeer_variance(const oc_understeer *understeer, double offset, double understeer_gradient) {
    const oc_understeer *u = understeer;
    const double o = offset;
    const double K = understeer_gradient;
    if (!(u->batches > 1.0) || !(u->batches_xx > 0.0)) {
        return gradient_variance_unknown;
    }
    /* the squares of the batches' sums of x (y - o - K x) give the variance of the slope's numerator */
    const double of_both = K * u->x_xx - u->xy_x, of_gradient = K * u->xx_xx - u->xy_xx;
    const double squares = u->xy_xy + o * (o * u->x_x + of_both + of_both) + K * (of_gradient - u->xy_xx);
    const double factor = oc_few_batches_factor(u->batches) / u->batches_xx;
    const double unbiased = u->batches / (u->batches - 1.0);
    return factor * factor * unbiased * (squares > 0.0 ? squares : 0.0);
}

#include "offset.h"

/* Numerical. */
static const double offset_variance_unknown = 10.0; /* rad^2, for unknown: 95 % within a turn either way */

void oc_offset_update(oc_offset *offset, const oc_moments *block, double ticks_per_batch) {
    oc_moments_merge(&offset->ticks, block);
    oc_moments_merge(&offset->filling, block);
    if (offset->filling.weight < ticks_per_batch) {
        return;
    }
    const oc_moments mean = {.weight = 1.0, .y = offset->filling.y, .x = offset->filling.x, .w = offset->filling.w};
    oc_moments_merge(&offset->batches, &mean);
    offset->filling = (oc_moments){0};
}

double oc_offset_value(const oc_offset *offset, double understeer_gradient) {
    return offset->ticks.y - understeer_gradient * offset->ticks.x;
}

double oc_offset_variance_if_independent(const oc_offset *offset, double understeer_gradient) {
    if (!(offset->ticks.weight > 1.0)) {
        return offset_variance_unknown;
    }
    return oc_moments_variance(&offset->ticks, understeer_gradient) / offset->ticks.weight;
}

double oc_offset_variance(const oc_offset *offset, double understeer_gradient) {
    const double batches = offset->batches.weight;
    if (!(batches > 1.0)) {
        return offset_variance_unknown;
    }
    const double factor = oc_few_batches_factor(batches);
    return factor * factor * oc_moments_variance(&offset->batches, understeer_gradient) / batches;
}

#include "mean.h"

void oc_sums_add(oc_sums *sums, double y, double x, double w) {
    sums->weight += 1.0;
    sums->y += y;
    sums->x += x;
    sums->w += w;
    sums->yy += y * y;
    sums->xy += x * y;
    sums->xx += x * x;
}

/* Rounding can make a sum of squares negative. */
static double not_negative(double squares) {
    return squares > 0.0 ? squares : 0.0;
}

oc_moments oc_moments_of(const oc_sums *sums) {
    const double n = sums->weight;
    if (!(n > 0.0)) {
        return (oc_moments){0};
    }
    const double y = sums->y / n;
    const double x = sums->x / n, all_x = n * x;
    return (oc_moments){
        .weight = n,
        .y = y,
        .x = x,
        .w = sums->w / n,
        .yy = not_negative(sums->yy - n * y * y),
        .xy = sums->xy - all_x * y,
        .xx = not_negative(sums->xx - all_x * x),
    };
}

void oc_moments_merge(oc_moments *into, const oc_moments *other) {
    const double total = into->weight + other->weight;
    if (!(other->weight > 0.0)) {
        return;
    }
    const double share = other->weight / total;
    const double between = into->weight * share;
    const double y = other->y - into->y;
    const double x = other->x - into->x, between_x = between * x;
    into->yy += other->yy + between * y * y;
    into->xy += other->xy + between_x * y;
    into->xx += other->xx + between_x * x;
    into->y += share * y;
    into->x += share * x;
    into->w += share * (other->w - into->w);
    into->weight = total;
}

double oc_moments_variance(const oc_moments *moments, double slope) {
    if (!(moments->weight > 1.0)) {
        return 0.0;
    }
    const double squares = moments->yy + slope * (slope * moments->xx - moments->xy - moments->xy);
    return squares > 0.0 ? squares / (moments->weight - 1.0) : 0.0;
}

#ifndef OC_MEAN_H
#define OC_MEAN_H
/* Means updated by their innovation, (36). They can be merged, so no sample is stored, and logs can be joined. */

/* Of a tick's regression quantities: y, the residual; x, the regressor of K_us; w, that of a yaw rate bias. */
typedef struct {
    double weight;     /* ticks (or batches) */
    double yy, xx;     /* sums of squared deviations from the means */
    double y, x, w;    /* means: rad, m/s^2, s */
    double xy;         /* sum of products of deviations */
} oc_moments;

/* Plain sums over one short block, cheap enough for every tick. */
typedef struct {
    double weight;
    double y, x, w;
    double yy, xy, xx;
} oc_sums;

void oc_sums_add(oc_sums *sums, double y, double x, double w);
oc_moments oc_moments_of(const oc_sums *sums);
void oc_moments_merge(oc_moments *into, const oc_moments *other);

/* Variance of y - slope * x about its mean, divisor n - 1; 0 below a weight of two. */
double oc_moments_variance(const oc_moments *moments, double slope);

#endif

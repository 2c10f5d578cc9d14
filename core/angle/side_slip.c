#include "side_slip.h"

#include <math.h>

/* Tuned, in tuned.toml: side_slip */
static const double slip_noise = 0.005; /* rad: noise of side slip and steering, as a mean over a second */
/* rad, 1, rad/(m/s^2): misalignment of a receiver, its place over the wheelbase, tyre slip by 2.3 */
static const double prior_mean[OC_SIDE_SLIP_TERMS] = {0.0, 0.5, 0.008};
/* rad, 1, rad/(m/s^2): standard deviations of prior_mean */
static const double prior_sd[OC_SIDE_SLIP_TERMS] = {0.02, 0.3, 0.005};
/* end */

static void terms_of(const oc_side_slip *tick, double *x) {
    x[0] = 1.0;
    x[1] = tick->yaw_rate / tick->speed;
    x[2] = tick->lateral_acceleration;
}

void oc_side_slip_learn(oc_side_slip_evidence *e, const oc_side_slip *tick, double front_wheel, double tick_s,
                        double memory_s) {
    const double keep = 1.0 - tick_s / memory_s;
    const double weight = tick_s / (slip_noise * slip_noise);
    const double slip = front_wheel - tick->lateral_speed / tick->speed;
    double x[OC_SIDE_SLIP_TERMS];
    terms_of(tick, x);
    for (int32_t row = 0; row < OC_SIDE_SLIP_TERMS; ++row) {
        for (int32_t column = 0; column < OC_SIDE_SLIP_TERMS; ++column) {
            e->information[row][column] = keep * e->information[row][column] + weight * x[row] * x[column];
        }
        e->sums[row] = keep * e->sums[row] + weight * x[row] * slip;
    }
}

/* Least squares with the prior, by elimination: the matrix is positive definite. */
static void slip_terms(const oc_side_slip_evidence *e, double wheelbase, double *terms) {
    double a[OC_SIDE_SLIP_TERMS][OC_SIDE_SLIP_TERMS];
    for (int32_t row = 0; row < OC_SIDE_SLIP_TERMS; ++row) {
        const double unit = row == 1 ? wheelbase : 1.0;
        const double sd = prior_sd[row] * unit;
        const double prior = 1.0 / (sd * sd);
        for (int32_t column = 0; column < OC_SIDE_SLIP_TERMS; ++column) {
            a[row][column] = e->information[row][column] + (row == column ? prior : 0.0);
        }
        terms[row] = e->sums[row] + prior * prior_mean[row] * unit;
    }
    for (int32_t pivot = 0; pivot < OC_SIDE_SLIP_TERMS; ++pivot) {
        for (int32_t row = pivot + 1; row < OC_SIDE_SLIP_TERMS; ++row) {
            const double factor = a[row][pivot] / a[pivot][pivot];
            for (int32_t column = pivot; column < OC_SIDE_SLIP_TERMS; ++column) {
                a[row][column] -= factor * a[pivot][column];
            }
            terms[row] -= factor * terms[pivot];
        }
    }
    for (int32_t row = OC_SIDE_SLIP_TERMS - 1; row >= 0; --row) {
        for (int32_t column = row + 1; column < OC_SIDE_SLIP_TERMS; ++column) {
            terms[row] -= a[row][column] * terms[column];
        }
        terms[row] /= a[row][row];
    }
}

double oc_side_slip_front_wheel(const oc_side_slip_evidence *e, const oc_side_slip *tick, double wheelbase) {
    double terms[OC_SIDE_SLIP_TERMS];
    slip_terms(e, wheelbase, terms);
    return oc_front_wheel_by_side_slip(tick->speed, tick->lateral_speed, tick->yaw_rate, terms[1],
                                       -terms[0] - terms[2] * tick->lateral_acceleration);
}

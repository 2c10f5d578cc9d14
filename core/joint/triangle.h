#ifndef OC_TRIANGLE_H
#define OC_TRIANGLE_H
/* Symmetric matrices of the hypotheses' terms as lower triangles, row by row, and their Cholesky factors. */

#include <stdint.h>

enum {
    /* terms.toml: count */
    OC_TERMS = 15, /* of a hypothesis, without the offset */
    /* end */
    OC_TERMS_TRIANGLE = OC_TERMS * (OC_TERMS + 1) / 2 /* cells of such a matrix */
};

float oc_triangle_cell(const float *triangle, int32_t row, int32_t column);

/* vector -= times * row of the whole matrix. */
void oc_triangle_subtract_row(const float *triangle, int32_t row, float times, float *vector);

/* Multiplies a row and its column of the whole matrix by `by`, the diagonal by its square. */
void oc_triangle_scale(float *triangle, int32_t row, float by);

/* triangle -= times * row row^T; `row`: of the whole matrix. */
void oc_triangle_subtract_product(float *triangle, const float *row, float times);

/* Cholesky's lower factor of triangle + diag(information), in its place. `inverse`: 1 over the factor's diagonal. */
void oc_triangle_factor(float *triangle, const float *information, float *inverse);

/* The vector is zero before `first`. */
void oc_triangle_solve_lower(const float *lower, const float *inverse, int32_t first, float *vector);
void oc_triangle_solve_upper(const float *lower, const float *inverse, float *vector);

/* Variance of a weighted sum of the terms. `first`: index of the first weight. Solves for the weights in place. */
float oc_triangle_variance(const float *lower, const float *inverse, int32_t first, float *weights);

/* Covariance of two such sums, by their solved weights, from `first` on. */
float oc_triangle_covariance(const float *a, const float *b, int32_t first);

#endif

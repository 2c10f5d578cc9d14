#ifndef OC_TRIANGLE_H
#define OC_TRIANGLE_H
/* Symmetric matrices of the hypotheses' terms, of which one triangle is kept row by row, and their Cholesky factors. */

#include <stdint.h>

enum {
    OC_TERMS = 13,         /* of a hypothesis, beside the offset */
    OC_TERMS_TRIANGLE = 91 /* of a symmetric matrix of so many rows */
};

float oc_triangle_cell(const float *triangle, int32_t row, int32_t column);

/* Takes so many times a row of the whole matrix from the vector. */
void oc_triangle_subtract_row(const float *triangle, int32_t row, float times, float *vector);

/* A row and column of the whole matrix so many times as large, the cell on its diagonal by the square. */
void oc_triangle_scale(float *triangle, int32_t row, float by);

/* Takes so many times the outer product of a row of the whole matrix with itself from the matrix. */
void oc_triangle_subtract_product(float *triangle, const float *row, float times);

/* Cholesky's lower triangle of the scatter in units of the noise, with the prior's information on the diagonal.
 * `inverse` is that of its diagonal. */
void oc_triangle_factor(const float *scatter, const float *information, float noise, float *lower, float *inverse);

/* The vector is zero before `first`. */
void oc_triangle_solve_lower(const float *lower, const float *inverse, int32_t first, float *vector);
void oc_triangle_solve_upper(const float *lower, const float *inverse, float *vector);

/* Of a weighted sum of the terms, from the first that has a weight; uses the weights up. */
float oc_triangle_variance(const float *lower, const float *inverse, int32_t first, float *weights);

#endif

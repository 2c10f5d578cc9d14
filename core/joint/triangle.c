#include "triangle.h"

#include <math.h>

static float minus_products(float sum, const float *a, const float *b, int32_t count) {
    for (int32_t k = 0; k < count; ++k) {
        sum -= a[k] * b[k];
    }
    return sum;
}

/* Numerical. */
static const float rounding = 2e-6f; /* of a diagonal cell, by many sums in single precision */

/* Root of a pivot. Minimum: the prior's information plus the pivot's rounding error. Below it the following rows would
 * grow without bound. */
static float root_of(float square, float prior_information, float diagonal) {
    const float pivot_min = prior_information + rounding * diagonal;
    return sqrtf(square > pivot_min ? square : pivot_min);
}

static void end_row(float *row, int32_t i, const float *information, float *inverse) {
    row[i] = root_of(minus_products(row[i] + information[i], row, row, i), information[i], row[i]);
    inverse[i] = 1.0f / row[i];
}

void oc_triangle_factor(float *triangle, const float *information, float *inverse) {
    enum { SINGLE = 2 - OC_TERMS % 2 }; /* rows before the pairs */
    end_row(triangle, 0, information, inverse);
    for (int32_t i = 1; i < SINGLE; ++i) {
        triangle[1] *= inverse[0];
        end_row(&triangle[1], i, information, inverse);
    }
    /* two rows at a time, which read the rows above them once: a tenth of the worst tick */
    for (int32_t i = SINGLE; i < OC_TERMS; i += 2) {
        float *row = &triangle[i * (i + 1) / 2], *below = row + i + 1;
        const float *above = triangle;
        for (int32_t j = 0; j < i; ++j) {
            float sum = row[j], sum_below = below[j];
            for (int32_t k = 0; k < j; ++k) {
                sum -= row[k] * above[k];
                sum_below -= below[k] * above[k];
            }
            row[j] = sum * inverse[j];
            below[j] = sum_below * inverse[j];
            above += j + 1;
        }
        end_row(row, i, information, inverse);
        below[i] = minus_products(below[i], below, row, i) * inverse[i];
        end_row(below, i + 1, information, inverse);
    }
}

void oc_triangle_solve_lower(const float *lower, const float *inverse, int32_t first, float *vector) {
    const float *row = &lower[first * (first + 1) / 2 + first]; /* where the vector begins */
    for (int32_t i = first; i < OC_TERMS; ++i) {
        vector[i] = minus_products(vector[i], row, &vector[first], i - first) * inverse[i];
        row += i + 1;
    }
}

void oc_triangle_solve_upper(const float *lower, const float *inverse, float *vector) {
    for (int32_t i = OC_TERMS - 1; i >= 0; --i) {
        const float *row = &lower[i * (i + 1) / 2];
        const float solution = vector[i] * inverse[i];
        vector[i] = solution;
        for (int32_t k = 0; k < i; ++k) {
            vector[k] -= row[k] * solution;
        }
    }
}

float oc_triangle_variance(const float *lower, const float *inverse, int32_t first, float *weights) {
    oc_triangle_solve_lower(lower, inverse, first, weights);
    return oc_triangle_covariance(weights, weights, first);
}

float oc_triangle_covariance(const float *a, const float *b, int32_t first) {
    float sum = 0.0f;
    for (int32_t k = first; k < OC_TERMS; ++k) {
        sum += a[k] * b[k];
    }
    return sum;
}

float oc_triangle_cell(const float *triangle, int32_t row, int32_t column) {
    return row >= column ? triangle[row * (row + 1) / 2 + column] : triangle[column * (column + 1) / 2 + row];
}

void oc_triangle_subtract_row(const float *triangle, int32_t row, float times, float *vector) {
    const float *cell = &triangle[row * (row + 1) / 2];
    for (int32_t k = 0; k < row; ++k, ++cell) {
        vector[k] -= *cell * times;
    }
    for (int32_t k = row; k < OC_TERMS; ++k) {
        vector[k] -= *cell * times;
        cell += k + 1;
    }
}

void oc_triangle_subtract_product(float *triangle, const float *row, float times) {
    for (int32_t i = 0; i < OC_TERMS; ++i) {
        const float weighted = times * row[i];
        for (int32_t k = 0; k <= i; ++k, ++triangle) {
            *triangle -= weighted * row[k];
        }
    }
}

void oc_triangle_scale(float *triangle, int32_t row, float by) {
    float *cell = &triangle[row * (row + 1) / 2];
    for (int32_t k = 0; k < row; ++k) {
        cell[k] *= by;
    }
    cell += row;
    *cell *= by * by;
    for (int32_t k = row + 1; k < OC_TERMS; ++k) {
        cell += k;
        *cell *= by;
    }
}

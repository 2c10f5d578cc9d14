#include "triangle.h"

#include <math.h>

void oc_triangle_factor(const float *scatter, const float *information, float noise, int32_t first, int32_t end,
                        float *lower, float *inverse) {
    const float weight = 1.0f / noise;
    for (int32_t i = first; i < end; ++i) {
        float *row = &lower[i * (i + 1) / 2];
        const float *other = lower;
        for (int32_t j = 0; j <= i; ++j) {
            float sum = scatter[i * (i + 1) / 2 + j] * weight + (i == j ? information[i] : 0.0f);
            for (int32_t k = 0; k < j; ++k) {
                sum -= row[k] * other[k];
            }
            row[j] = i == j ? sqrtf(sum > 1e-6f ? sum : 1e-6f) : sum * inverse[j];
            other += j + 1;
        }
        inverse[i] = 1.0f / row[i];
    }
}

void oc_triangle_solve_lower(const float *lower, int32_t first, float *vector) {
    for (int32_t i = first; i < OC_TERMS; ++i) {
        const float *row = lower + i * (i + 1) / 2;
        for (int32_t k = first; k < i; ++k) {
            vector[i] -= row[k] * vector[k];
        }
        vector[i] /= row[i];
    }
}

void oc_triangle_solve_upper(const float *lower, float *vector) {
    for (int32_t i = OC_TERMS - 1; i >= 0; --i) {
        for (int32_t k = i + 1; k < OC_TERMS; ++k) {
            vector[i] -= lower[k * (k + 1) / 2 + i] * vector[k];
        }
        vector[i] /= lower[i * (i + 1) / 2 + i];
    }
}

float oc_triangle_variance(const float *lower, int32_t first, float *weights) {
    oc_triangle_solve_lower(lower, first, weights);
    float sum = 0.0f;
    for (int32_t k = first; k < OC_TERMS; ++k) {
        sum += weights[k] * weights[k];
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

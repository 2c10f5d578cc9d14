#include "bounds.h"

#include <math.h>

float oc_min(float a, float b) {
    return a < b ? a : b;
}

float oc_max(float a, float b) {
    return a > b ? a : b;
}

float oc_clamp(float value, float low, float high) {
    if (value < low) {
        return low;
    }
    return value > high ? high : value;
}

float oc_clamp_size(float value, float limit) {
    if (fabsf(value) <= limit) {
        return value;
    }
    return value < 0.0f ? -limit : limit;
}

double oc_clamp_size_double(double value, double limit) {
    return value > limit ? limit : value < -limit ? -limit : value;
}

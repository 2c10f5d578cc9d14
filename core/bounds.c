#include "bounds.h"

float oc_least(float a, float b) {
    return a < b ? a : b;
}

float oc_most(float a, float b) {
    return a > b ? a : b;
}

float oc_within(float value, float low, float high) {
    if (value < low) {
        return low;
    }
    return value > high ? high : value;
}

float oc_limited(float value, float limit) {
    return oc_within(value, -limit, limit);
}

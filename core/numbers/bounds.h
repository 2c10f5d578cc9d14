#ifndef OC_BOUNDS_H
#define OC_BOUNDS_H
/* Minimum, maximum and clamps in single precision. If an argument is NaN, minimum and maximum return the second one; a
 * clamped NaN is NaN. */

float oc_min(float a, float b);
float oc_max(float a, float b);
float oc_clamp(float value, float low, float high);
float oc_clamp_size(float value, float limit);

#endif

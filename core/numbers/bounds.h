#ifndef OC_BOUNDS_H
#define OC_BOUNDS_H
/* Minimum, maximum and clamps, in single precision but for the last. If an argument is NaN, minimum and maximum return
 * the second one. A clamped NaN is NaN, but oc_clamp_size returns the limit. */

enum { OC_OUTLIER_SDS = 3 }; /* a normal error is beyond so many standard deviations once in 370 times */

float oc_min(float a, float b);
float oc_max(float a, float b);
float oc_clamp(float value, float low, float high);
float oc_clamp_size(float value, float limit);
double oc_clamp_size_double(double value, double limit);

#endif

#ifndef OC_BOUNDS_H
#define OC_BOUNDS_H
/* The lesser and the larger of two, and what stays between two or as small as a limit, in single precision. Where one
 * is no number the second comes out, and what is to stay stays none. */

float oc_least(float a, float b);
float oc_most(float a, float b);
float oc_within(float value, float low, float high);
float oc_limited(float value, float limit);

#endif

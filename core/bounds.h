#ifndef OC_BOUNDS_H
#define OC_BOUNDS_H
/* The lesser and the larger of two, and what stays between two or as small as a limit, in single precision. Where one
 * is no number the second comes out, and what is to stay stays none. */

float oc_min(float a, float b);
float oc_max(float a, float b);
float oc_clamp(float value, float low, float high);
float oc_clamp_size(float value, float limit);

#endif

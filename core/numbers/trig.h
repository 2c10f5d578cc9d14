#ifndef OC_TRIG_H
#define OC_TRIG_H
/* Tangent and arcsine by + - * / and sqrt only, so that all machines have the same bits: libm's functions differ in the
 * last bit between C libraries. */

double oc_tan(double angle);   /* rad; |angle| <= 1e6, else 0 is used; accurate to 2e-15 near 0 */
double oc_asin(double ratio);  /* rad in [-pi/2, pi/2]; ratio is clamped at +-1 */

#endif

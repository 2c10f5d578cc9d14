#ifndef OC_TRIG_H
#define OC_TRIG_H
/* Tangent and arcsine from + - * / and sqrt alone, with the same bits on every machine: libm's differ in the last
 * bit between C libraries. */

double oc_tan(double angle);   /* rad; |angle| <= 1e6, else as of 0; accurate to 2e-15 near 0 */
double oc_asin(double ratio);  /* rad in [-pi/2, pi/2]; ratio is clamped at +-1 */

#endif

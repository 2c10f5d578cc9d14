#ifndef OC_TRIG_H
#define OC_TRIG_H
/* Own sine, tangent and arcsine: libm's differ in the last bit between C libraries, these give the same bits
 * everywhere, from + - * / and sqrt alone. */

double oc_sin(double angle);   /* rad; |angle| <= 1e6, beyond it as of 0; to 2e-15 near zero turns */
double oc_tan(double angle);   /* rad, as oc_sin */
double oc_asin(double ratio);  /* rad in [-pi/2, pi/2]; ratio beyond +-1 is taken as +-1 */

#endif

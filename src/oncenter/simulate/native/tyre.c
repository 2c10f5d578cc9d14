#include "tyre.h"

#include <math.h>

static double brush_force(const sim_tyre *tyre, double slip_angle)
{
    const double sliding = tyre->cornering_stiffness * fabs(slip_angle) / (3.0 * tyre->D); /* share of the contact */
    if (sliding >= 1.0)
        return copysign(tyre->D, slip_angle);
    return copysign(tyre->D * sliding * (3.0 - sliding * (3.0 - sliding)), slip_angle);
}

static double magic_formula_force(const sim_tyre *tyre, double slip_angle)
{
    const double B = tyre->cornering_stiffness / (tyre->C * tyre->D);
    const double Bx = B * slip_angle;
    return tyre->D * sin(tyre->C * atan(Bx - tyre->E * (Bx - atan(Bx))));
}

double sim_tyre_force(const sim_tyre *tyre, double slip_angle)
{
    if (tyre->model == SIM_TYRE_LINEAR)
        return tyre->cornering_stiffness * slip_angle;
    if (tyre->D <= 0.0) /* lifted from the road */
        return 0.0;
    return tyre->model == SIM_TYRE_BRUSH ? brush_force(tyre, slip_angle) : magic_formula_force(tyre, slip_angle);
}

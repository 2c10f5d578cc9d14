#include "backlash.h"

#include <math.h>

static double limited(double value, double low, double high) {
    if (value < low) {
        return low;
    }
    return value > high ? high : value;
}

double oc_backlash_carry(double inner, const oc_backlash *backlash, double outer, double load, double step_s) {
    const double beyond_friction = fabs(load) - backlash->friction;
    if (beyond_friction > 0.0) {
        const double crept = backlash->creep * beyond_friction * step_s;
        inner -= load > 0.0 ? crept : -crept;
    }
    return limited(inner, outer - backlash->half_width, outer + backlash->half_width);
}

double oc_backlash_step(oc_backlash_state *state, const oc_backlash *backlash, double outer, double load,
                        double step_s) {
    const double half = backlash->half_width;
    if (half <= 0.0) {
        state->inner = outer;
        return 0.0;
    }
    state->inner = oc_backlash_carry(state->inner, backlash, outer, load, step_s);
    return limited((outer - state->inner) / half, -1.0, 1.0);
}

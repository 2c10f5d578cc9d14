#ifndef OC_BACKLASH_H
#define OC_BACKLASH_H
/* The play operator: free play between an outer element, the input, and an inner element, which either flank carries.
 *
 * Inside the play the inner element keeps its position (hysteresis). A load beyond its friction makes it creep to a
 * flank of the play, against the sign of the load (5.3.3). */

typedef struct {
    double half_width; /* rad of the outer element, from the midpoint to either end; 0: none */
    double friction;   /* in the load's unit: smaller loads do not move the inner element */
    double creep;      /* rad/s per unit of load beyond friction */
} oc_backlash;

typedef struct {
    double inner; /* rad of the outer element */
} oc_backlash_state;

/* One step of step_s seconds to the outer element's new position. A positive load drives the inner element negative.
 * Returns the place in the play, -1 to 1: (outer - inner) over half the width; 0 without play. */
double oc_backlash_step(oc_backlash_state *state, const oc_backlash *backlash, double outer, double load,
                        double step_s);

/* The same step; returns the inner element, rad. */
double oc_backlash_carry(double inner, const oc_backlash *backlash, double outer, double load, double step_s);

#endif

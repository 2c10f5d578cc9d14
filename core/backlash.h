#ifndef OC_BACKLASH_H
#define OC_BACKLASH_H
/* The play operator: free play between an outer element, the input, and an inner one, which either flank carries along.
 *
 * Inside the play the inner element stays where the last motion left it (hysteresis). A load beyond its friction makes
 * it creep against the load to the flank of the play (5.3.3). */

typedef struct {
    double half_width; /* rad of the outer element, from the midpoint to either end; 0: none */
    double friction;   /* in the load's unit: smaller loads do not move the inner element */
    double creep;      /* rad/s per unit of load beyond friction */
} oc_backlash;

typedef struct {
    double inner; /* rad, in the outer element's measure */
} oc_backlash_state;

/* One step of step_s seconds to where the outer element is now. A positive load drives the inner element negative.
 * Returns the place in the play, from -1 to 1: outer less inner over half the width, 0 where there is no play. */
double oc_backlash_step(oc_backlash_state *state, const oc_backlash *backlash, double outer, double load,
                        double step_s);

/* The same without the place: the inner element after the step, rad. */
double oc_backlash_carry(double inner, const oc_backlash *backlash, double outer, double load, double step_s);

#endif

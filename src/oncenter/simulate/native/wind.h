#ifndef SIM_WIND_H
#define SIM_WIND_H
/* Wind on open land: a mean of constant direction, and gusts. The crosswind depends on the truck's heading. Its lateral
 * force is balanced by the tyres, so that an accelerometer does not measure it. */

#include <stdint.h>

typedef struct {
    double mean;           /* m/s */
    double from;           /* rad, origin of the wind, counter-clockwise from east */
    double gust;           /* m/s, standard deviation of the gusts about the mean */
    double gust_keep;      /* share of a gust kept from one tick to the next, 0 to 1 */
    double force_constant; /* N/(m/s)^2, half of air density * side area * lateral force coefficient; 0: none */
    double arm;            /* m, place of the force ahead of the centre of gravity */
    int32_t with_truck;    /* 1: `from` is counter-clockwise from the truck's nose, whatever its heading */
} sim_wind;

typedef struct {
    double gust;       /* m/s, now */
    double lateral_force; /* N, left positive */
} sim_wind_state;

/* Inputs of a tick. */
typedef struct {
    double heading;  /* rad, counter-clockwise from east */
    double speed;    /* m/s, of the truck */
    double exposure; /* 1, 0: sheltered, 1: open */
    double normal;   /* a standard normal number */
} sim_wind_input;

void sim_wind_blow(sim_wind_state *state, const sim_wind *wind, const sim_wind_input *input);

#endif

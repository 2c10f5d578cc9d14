#ifndef SIM_WIND_H
#define SIM_WIND_H
/* Wind where the land is open: a mean with a compass direction, and gusts. The truck's heading decides how much of it
 * blows from the side. What it does is a side force; the tyres balance it, so that an accelerometer never feels it. */

typedef struct {
    double mean;           /* m/s */
    double from;           /* rad, whence it blows, counter-clockwise from east */
    double gust;           /* m/s, standard deviation of what gusts add to the mean */
    double gust_keep;      /* of a gust from one tick to the next, 0 to 1 */
    double force_constant; /* N/(m/s)^2, half of air density * side area * side force coefficient; 0: none */
    double arm;            /* m, where the force acts, in front of the centre of gravity */
} sim_wind;

typedef struct {
    double gust;       /* m/s, now */
    double side_force; /* N, left positive */
} sim_wind_state;

/* What a tick brings. */
typedef struct {
    double heading;  /* rad, counter-clockwise from east */
    double speed;    /* m/s, of the truck */
    double exposure; /* 1, 0: sheltered, 1: open */
    double normal;   /* a standard normal number */
} sim_wind_input;

void sim_wind_blow(sim_wind_state *state, const sim_wind *wind, const sim_wind_input *input);

#endif

#ifndef SIM_ROAD_H
#define SIM_ROAD_H
/* The road as a table over its length, at even spacing. */

#include <stddef.h>

typedef struct {
    size_t count;              /* at least 2 */
    double spacing;            /* m */
    const double *curvature;   /* 1/m, left positive */
    const double *cross_slope; /* 1, sine of the bank; positive where the road falls to the right */
    const double *speed;       /* m/s, intended speed */
    const double *patch;       /* 1, 0: good grip, 1: in a wet or snowy patch; NULL: good everywhere */
    const double *exposure;    /* 1, 0: sheltered from the wind, 1: open; NULL: open everywhere */
    size_t stop_count;
    const double *stop_station;  /* m, ascending: where the truck stops */
    const double *stop_duration; /* s, duration of the stop */
} sim_road;

/* A column's value at a station (m): linear between points, constant beyond the ends. */
double sim_road_at(const sim_road *road, const double *column, double station);

#endif

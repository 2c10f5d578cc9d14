#include "road.h"

double sim_road_at(const sim_road *road, const double *column, double station)
{
    const double place = station / road->spacing;
    if (place <= 0.0)
        return column[0];
    if (place >= (double)(road->count - 1))
        return column[road->count - 1];
    const size_t before = (size_t)place;
    const double rest = place - (double)before;
    return column[before] + rest * (column[before + 1] - column[before]);
}

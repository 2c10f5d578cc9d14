#ifndef OC_CHANGE_H
#define OC_CHANGE_H
/* Whether what was learned still holds: CUSUMs on the errors of what it foretells, one for an offset that changed, one
 * for bends that take another angle, as after loading or lifting an axle. While one is suspicious nothing is learned;
 * what was learned stays the answer until a change is proven. */

#include <stdbool.h>

typedef enum {
    OC_CHANGE_NONE,
    OC_CHANGE_OFFSET, /* the sensor reads more or less at all times */
    OC_CHANGE_BENDS   /* bends need another angle, straights the same */
} oc_change_kind;

/* Two sums, one for errors that grow and one for those that fall, and how many seconds since either left zero. */
typedef struct {
    float up, down, seconds_up, seconds_down;
} oc_cusum;

typedef struct {
    oc_cusum offset, bends;
    float rest;           /* s, until anything is suspected again */
    float seconds, error, error_curvature, curvature_squares; /* sums since something became suspicious */
} oc_change_watch;

typedef struct {
    oc_change_kind kind;
    float size, size_sd; /* OC_CHANGE_OFFSET: rad */
    float seconds;       /* of driving since it came */
} oc_change;

/* A second's error, and the least that anything believed possible makes of it, both rad; what errors are usual (their
 * sd, rad) and the curvature in 1/m. The least tells whether there was a change, the error how large. What is proven is
 * returned once, and the watch begins anew. */
oc_change oc_change_update(oc_change_watch *watch, float error, float least, float usual, float curvature);

bool oc_change_suspected(const oc_change_watch *watch);

#endif

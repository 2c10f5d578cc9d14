#ifndef OC_SPEED_FLOOR_H
#define OC_SPEED_FLOOR_H
/* The speed below which the vehicle speed reads zero: its dead zone, or its coarse step.
 *
 * A truck that stops and starts spends about as much time in each m/s of low speed. A range below which it spends
 * hardly any is one that the signal does not have. Below it the truck may creep through a turn while the speed says
 * that it stands. */

enum { OC_LOW_SPEEDS = 4 };

typedef struct {
    float low_s[OC_LOW_SPEEDS]; /* s in each range of low speed, the lowest first */
} oc_speed_floor;

/* One tick with a vehicle speed, m/s. */
void oc_speed_floor_update(oc_speed_floor *state, float speed, float tick_s);

/* m/s; a cautious value where the truck has hardly driven slowly yet. */
float oc_speed_floor_get(const oc_speed_floor *state);

#endif

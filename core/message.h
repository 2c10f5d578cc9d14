#ifndef OC_MESSAGE_H
#define OC_MESSAGE_H
/* The result on the bus: one frame of a proprietary PGN, dbc/oncenter_result.dbc.
 *
 * Bytes, least first:  1-2 angle, 1/1024 rad a bit less 31.374 as in SPN 1807;  3-4 offset, 1/4096 rad a bit less
 * 7.84375;  5 standard deviation of the offset and  8 of the angle, 1/2048 rad a bit, rounded up, 250: as much or more;
 * 6 status of the offset (bits 1-4) and source of the angle (5-8);  7 fault of the sensor (1-4) and counter (5-8).
 * All ones is not available.
 *
 * A correction is applied once: the angle is made anew from each tick as the sensor said it, whoever reads it applies
 * nothing, and the source tells whether the offset beside it has been taken off. Who receives such an angle in place of
 * the sensor's gives oc_message_measured to oc_step. */

#include <stdbool.h>
#include <stdint.h>

#include "monitor.h"

enum {
    OC_MESSAGE_BYTES = 8,
    OC_MESSAGE_PGN = 65292 /* 0xFF0C; a truck maker will choose its own among 0xFF00 to 0xFFFF */
};

/* Where the angle is from. */
typedef enum {
    OC_SOURCE_NONE,
    OC_SOURCE_MEASURED,    /* as the sensor says it: its offset is not known well enough to be taken off */
    OC_SOURCE_COMPENSATED, /* the offset beside it has been taken off */
    OC_SOURCE_ESTIMATED,   /* without the sensor, which is lost or at fault */
    OC_SOURCE_COUNT
} oc_angle_source;

typedef struct {
    oc_angle_source source;
    double angle, angle_sd;   /* rad, -31.374 to 31.375; NaN: not available */
    double offset, offset_sd; /* rad, -7.84 to 7.84; NaN: not available */
    oc_status offset_status;
    oc_fault fault;
    uint32_t counter;         /* 0 to 15 */
} oc_message;

const char *oc_angle_source_name(oc_angle_source source);

/* What a tick and what was made of it say to the bus. */
oc_message oc_message_of(const oc_output *output, const oc_signals *tick, uint32_t counter);

/* `data` has OC_MESSAGE_BYTES. A value beyond its range is not available, and an angle without its offset neither. */
void oc_message_encode(const oc_message *message, uint8_t *data);

/* False where a number has no meaning: no such message. */
bool oc_message_decode(oc_message *message, const uint8_t *data);

/* The angle as the sensor said it, rad; false where the message does not tell. */
bool oc_message_measured(const oc_message *message, double *measured);

#endif

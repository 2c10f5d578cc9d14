#ifndef OC_MESSAGE_H
#define OC_MESSAGE_H
/* The result on the bus: two frames of proprietary PGNs, dbc/oncenter_result.dbc.
 *
 * Bytes of the first, lowest first:  1-2 angle, 1/1024 rad per bit less 31.374 as in SPN 1807;  3-4 offset, 1/4096 rad
 * per bit less 7.84375;  5 standard deviation of the offset and  8 of the angle, 1/2048 rad per bit, rounded up, 250:
 * as much or more;  6 status of the offset (bits 1-4) and source of the angle (5-8);  7 fault of the sensor (1-4) and
 * counter (5-8). All bits set: not available.
 *
 * The sender subtracts the offset once, from each tick's measured angle. The source states whether the offset in the
 * message is subtracted. A core that receives this angle in place of the sensor's passes oc_message_measured to
 * oc_step.
 *
 * The second frame splits the offset's standard deviation:  1 this drive's part, then causes that are not identifiable
 * from one drive:  2 a pull,  3 the mean wind,  4 an axle set up for the crown, each as in the first;  7 counter (5-8)
 * of the first frame it belongs to. All other bits are ones. Up to rounding, the squares sum to that of the first
 * frame. */

#include <stdbool.h>
#include <stdint.h>

#include "monitor.h"

enum {
    OC_MESSAGE_BYTES = 8,
    OC_MESSAGE_PGN = 65292, /* 0xFF0C; a truck maker chooses its own from 0xFF00 to 0xFFFF */
    OC_MESSAGE_PARTS_PGN = 65293 /* 0xFF0D */
};

/* Source of the angle. */
typedef enum {
    OC_SOURCE_NONE,
    OC_SOURCE_MEASURED,    /* as measured: the offset is not valid */
    OC_SOURCE_COMPENSATED, /* measured less the offset in the message */
    OC_SOURCE_ESTIMATED,   /* without the sensor, which is lost or faulty */
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

typedef struct {
    double drive_sd, pull_sd, wind_sd, set_up_sd; /* rad; NaN: not available */
    uint32_t counter;                             /* 0 to 15 */
} oc_message_parts;

const char *oc_angle_source_name(oc_angle_source source);

/* The message of a tick and its output. */
oc_message oc_message_of(const oc_output *output, const oc_signals *tick, uint32_t counter);

/* `data`: OC_MESSAGE_BYTES. Not available: a value beyond its range, and a compensated angle with such an offset. */
void oc_message_encode(const oc_message *message, uint8_t *data);

/* False if a field has an undefined value. */
bool oc_message_decode(oc_message *message, const uint8_t *data);

/* The second frame of an output. Not available: all parts of an unobservable offset. */
oc_message_parts oc_message_parts_of(const oc_output *output, uint32_t counter);

/* `data`: OC_MESSAGE_BYTES. */
void oc_message_parts_encode(const oc_message_parts *parts, uint8_t *data);
oc_message_parts oc_message_parts_decode(const uint8_t *data);

/* rad, the sensor's measured angle; false where the message does not have it. */
bool oc_message_measured(const oc_message *message, double *measured);

#endif

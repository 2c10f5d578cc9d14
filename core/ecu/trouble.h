#ifndef OC_TROUBLE_H
#define OC_TROUBLE_H
/* The sensor's diagnostic trouble code: J1939-73's DM1 for SPN 1807, with its failure mode. */

#include <stdint.h>

#include "monitor.h"

enum {
    OC_SPN_STEERING_WHEEL_ANGLE = 1807,
    OC_DM1_BYTES = 8,
    OC_DM1_PGN = 65226 /* 0xFECA, once a second and at each change */
};

/* J1939-73's failure mode identifiers, as far as used. */
typedef enum {
    OC_FMI_ERRATIC = 2,               /* stuck, or its sign is reversed */
    OC_FMI_ABNORMAL_UPDATE_RATE = 9,  /* lost */
    OC_FMI_ABNORMAL_CHANGE_RATE = 10, /* jumped */
    OC_FMI_OUT_OF_CALIBRATION = 13,   /* the offset is too large, or new: remounted */
    OC_FMI_DRIFTED_HIGH = 20,         /* to the left */
    OC_FMI_DRIFTED_LOW = 21           /* to the right */
} oc_fmi;

/* Initially zero: no trouble so far. */
typedef struct {
    int32_t active;
    int32_t by_offset;    /* while active: by the offset, not by a fault */
    oc_fmi fmi;           /* while active, or the last */
    uint32_t occurrences; /* activations, 126 at most */
} oc_trouble;

/* Once a tick. Active during a fault of the sensor. Also active from when a valid offset's 95 % interval is entirely
 * beyond offset_max (rad) until the offset is below it. */
void oc_trouble_update(oc_trouble *trouble, const oc_output *output, const oc_signals *tick, double offset_max);

/* DM1's payload, OC_DM1_BYTES: amber lamp and code while active, else no code. */
void oc_trouble_encode(const oc_trouble *trouble, uint8_t *data);

#endif

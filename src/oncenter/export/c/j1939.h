#ifndef J1939_H
#define J1939_H
/* An example: the signals of VDC2, EBC2 and CCVS1, and the statuses of VDC1, EBC1 and ETC2, as a tick. A value that is
 * reserved, in error or not available is not valid; neither is one of a message that has not come for some of its
 * periods. The angle sensor is absolute; for a relative one, add the turns of SPN 1811. */

#include "signals.h"

enum { /* PGN */
    J1939_VDC2 = 61449,
    J1939_EBC2 = 65215,
    J1939_CCVS1 = 65265,
    J1939_VDC1 = 65103,
    J1939_EBC1 = 61441,
    J1939_ETC2 = 61445
};

typedef struct {
    oc_signals last;                /* of the last message each */
    double vdc2_s, ebc2_s, ccvs1_s, vdc1_s, ebc1_s, etc2_s; /* s, when it came */
} j1939_signals;

void j1939_init(j1939_signals *bus);

/* A frame of 8 bytes; ignores other PGNs. */
void j1939_receive(j1939_signals *bus, uint32_t pgn, const uint8_t *data, double time_s);

/* The tick at a time, for oncenter_tick. */
void j1939_tick(const j1939_signals *bus, double time_s, oc_signals *tick);

#endif

/* Many ticks through the exported ECU program at once, for a test that calls it as a library. */

#include "oncenter_ecu.h"

void ecu_ticks(const oc_signals *ticks, size_t count);

void ecu_ticks(const oc_signals *ticks, size_t count) {
    for (size_t k = 0; k < count; ++k) {
        oncenter_tick = ticks[k];
        oncenter_ecu_tick();
    }
}

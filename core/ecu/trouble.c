#include "trouble.h"

#include <math.h>
#include <stdbool.h>

/* Derived. */
static const uint32_t occurrences_max = 126; /* J1939-73: 127 is not available */

static oc_fmi fmi_of(const oc_output *output, const oc_signals *tick) {
    switch (output->fault) {
    case OC_FAULT_LOST: return OC_FMI_ABNORMAL_UPDATE_RATE;
    case OC_FAULT_JUMPED: return OC_FMI_ABNORMAL_CHANGE_RATE;
    case OC_FAULT_REMOUNTED: return OC_FMI_OUT_OF_CALIBRATION;
    case OC_FAULT_DRIFTING:
        return tick->steering_wheel_angle - output->offset > output->angle.estimate ? OC_FMI_DRIFTED_HIGH
                                                                                    : OC_FMI_DRIFTED_LOW;
    default: return OC_FMI_ERRATIC;
    }
}

/* It has hysteresis: from 1.96 standard deviations beyond the limit until the value is below it. */
static bool is_out_of_calibration(const oc_trouble *trouble, const oc_output *output, double offset_max) {
    const double size = fabs(output->offset);
    const bool was = trouble->active && trouble->by_offset;
    return output->offset_status == OC_VALID && (was ? size : size - 1.96 * output->offset_sd) > offset_max;
}

void oc_trouble_update(oc_trouble *trouble, const oc_output *output, const oc_signals *tick, double offset_max) {
    const bool faulty =
        output->fault != OC_FAULT_NONE || (output->signals_at_fault & OC_HAS_STEERING_WHEEL_ANGLE) != 0;
    if (!faulty && !is_out_of_calibration(trouble, output, offset_max)) {
        trouble->active = 0;
        return;
    }
    const bool drifts = trouble->active && (trouble->fmi == OC_FMI_DRIFTED_HIGH || trouble->fmi == OC_FMI_DRIFTED_LOW);
    if (drifts && output->fault == OC_FAULT_DRIFTING) {
        return; /* the direction at its onset holds */
    }
    const oc_fmi fmi = faulty ? fmi_of(output, tick) : OC_FMI_OUT_OF_CALIBRATION;
    if (!trouble->active || fmi != trouble->fmi) {
        trouble->occurrences += trouble->occurrences < occurrences_max ? 1u : 0u;
    }
    trouble->active = 1;
    trouble->by_offset = !faulty;
    trouble->fmi = fmi;
}

void oc_trouble_encode(const oc_trouble *trouble, uint8_t *data) {
    const uint32_t spn = OC_SPN_STEERING_WHEEL_ANGLE;
    const bool active = trouble->active != 0;
    data[0] = active ? 0x04 : 0x00; /* lamps, two bits each: protect, amber warning, red stop, malfunction */
    data[1] = 0xFF;                 /* none of them flashes */
    data[2] = (uint8_t)(active ? spn & 0xFFu : 0u);
    data[3] = (uint8_t)(active ? spn >> 8 & 0xFFu : 0u);
    data[4] = (uint8_t)(active ? (uint32_t)trouble->fmi & 31u : 0u); /* and the SPN's high bits, none here */
    data[5] = (uint8_t)(active ? trouble->occurrences & 127u : 0u);
    data[6] = data[7] = 0xFF;
}

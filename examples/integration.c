/* How an ECU uses the core: restore at power-on, step at 100 Hz, a result with its parts every 100 ms, DM1 every
 * second, an image every minute. The ECU provides the functions named ecu_. */

#include "message.h"
#include "save.h"
#include "trouble.h"

enum { SLOT_BYTES = sizeof(oc_state) + OC_SAVE_OVERHEAD, RATE_HZ = 100 };

bool ecu_read_signals(oc_signals *tick); /* false at ignition off */
void ecu_send(uint32_t pgn, const uint8_t *data);
const uint8_t *ecu_slot(uint32_t slot);
void ecu_write_slot(uint32_t slot, const uint8_t *image, size_t size);

static oc_coefficients coefficients;
static oc_state state;
static uint8_t image[SLOT_BYTES];

static void save(uint32_t *sequence) {
    ++*sequence;
    const size_t size = oc_save(&state, &coefficients, *sequence, image, sizeof image);
    ecu_write_slot(*sequence % OC_SAVE_SLOTS, image, size);
}

oc_error run_monitor(const oc_vehicle *vehicle, double offset_max);

oc_error run_monitor(const oc_vehicle *vehicle, double offset_max) {
    oc_params params;
    oc_params_defaults(&params);
    params.method = OC_METHOD_JOINT;
    const oc_error error = oc_setup(&coefficients, vehicle, &params, RATE_HZ);
    if (error != OC_OK) {
        return error;
    }
    uint32_t sequence;
    (void)oc_restore_newest(&state, &coefficients, ecu_slot(0), ecu_slot(1), SLOT_BYTES, &sequence);
    oc_restart(&state, 0.0); /* the ignition was off */

    oc_signals tick;
    oc_output output;
    oc_trouble trouble = {0};
    for (uint32_t count = 1; ecu_read_signals(&tick); ++count) {
        uint8_t data[8];
        oc_step(&state, &coefficients, &tick, &output);
        oc_trouble_update(&trouble, &output, &tick, offset_max);
        if (count % (RATE_HZ / 10) == 0) {
            const oc_message message = oc_message_of(&output, &tick, count / (RATE_HZ / 10));
            oc_message_encode(&message, data);
            ecu_send(OC_MESSAGE_PGN, data);
            const oc_message_parts parts = oc_message_parts_of(&output, message.counter);
            oc_message_parts_encode(&parts, data);
            ecu_send(OC_MESSAGE_PARTS_PGN, data);
        }
        if (count % RATE_HZ == 0) {
            oc_trouble_encode(&trouble, data);
            ecu_send(OC_DM1_PGN, data);
        }
        if (count % (60 * RATE_HZ) == 0) {
            save(&sequence);
        }
    }
    save(&sequence);
    return OC_OK;
}

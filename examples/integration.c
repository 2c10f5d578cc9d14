/* How an ECU uses the core: restore at power-on, step at 100 Hz, a result with its parts every 100 ms, DM1 every
 * second, an image after ignition off. One task does all of it, so no tick comes while the image is made in pieces. The
 * ECU provides the functions named ecu_. */

#include "message.h"
#include "save.h"
#include "trouble.h"

enum { SLOT_BYTES = sizeof(oc_state) + OC_SAVE_OVERHEAD, PIECE_BYTES = 256, RATE_HZ = 100 };

bool ecu_read_signals(oc_signals *tick); /* false at ignition off */
void ecu_send(uint32_t pgn, const uint8_t *data);
const uint8_t *ecu_slot(uint32_t slot); /* SLOT_BYTES, in memory that can be addressed */
void ecu_write_slot(uint32_t slot, uint32_t at, const uint8_t *piece, size_t size);

static oc_coefficients coefficients;
static oc_state state;

static void save(uint32_t sequence) {
    static uint8_t piece[PIECE_BYTES];
    oc_image_place place;
    uint32_t at = 0;
    oc_save_begin(&place, &state, sequence);
    size_t size = oc_save_piece(&place, &state, &coefficients, piece, sizeof piece);
    while (size > 0) {
        ecu_write_slot(sequence % OC_SAVE_SLOTS, at, piece, size);
        at += (uint32_t)size;
        size = oc_save_piece(&place, &state, &coefficients, piece, sizeof piece);
    }
}

static void send(const oc_output *output, const oc_signals *tick, uint32_t counter) {
    uint8_t data[OC_MESSAGE_BYTES];
    const oc_message message = oc_message_of(output, tick, counter);
    oc_message_encode(&message, data);
    ecu_send(OC_MESSAGE_PGN, data);
    const oc_message_parts parts = oc_message_parts_of(output, message.counter);
    oc_message_parts_encode(&parts, data);
    ecu_send(OC_MESSAGE_PARTS_PGN, data);
}

oc_error run_monitor(const oc_vehicle *vehicle, double offset_max);

oc_error run_monitor(const oc_vehicle *vehicle, double offset_max) {
    oc_params params;
    oc_params_defaults(&params);
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
        (void)oc_step(&state, &coefficients, &tick, &output); /* set up and restored: it returns OC_OK */
        oc_trouble_update(&trouble, &output, &tick, offset_max);
        if (count % (RATE_HZ / 10) == 0) {
            send(&output, &tick, count / (RATE_HZ / 10));
        }
        if (count % RATE_HZ == 0) {
            uint8_t data[OC_DM1_BYTES];
            oc_trouble_encode(&trouble, data);
            ecu_send(OC_DM1_PGN, data);
        }
    }
    save(sequence + 1u);
    return OC_OK;
}

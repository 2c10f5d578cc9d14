/* An ECU around examples/integration.c: ticks as six doubles each on stdin, frames as text on stdout, slots in files */

#include <stdio.h>

#include "message.h"
#include "save.h"

bool ecu_read_signals(oc_signals *tick);
void ecu_send(uint32_t pgn, const uint8_t *data);
const uint8_t *ecu_slot(uint32_t slot);
void ecu_write_slot(uint32_t slot, uint32_t at, const uint8_t *piece, size_t size);
oc_error run_monitor(const oc_vehicle *vehicle, double offset_max);

static uint8_t slots[2][1 << 16];
static const char *const files[2] = {"slot_0", "slot_1"};

bool ecu_read_signals(oc_signals *tick) {
    double in[5];
    if (fread(in, sizeof in, 1, stdin) != 1) {
        return false;
    }
    *tick = (oc_signals){.time = in[0], .steering_wheel_angle = in[1], .yaw_rate = in[2], .vehicle_speed = in[3],
                         .lateral_acceleration = in[4], .valid = 15};
    return true;
}

void ecu_send(uint32_t pgn, const uint8_t *data) {
    printf("%u ", (unsigned)pgn);
    for (int k = 0; k < 8; ++k) {
        printf("%02x", data[k]);
    }
    printf("\n");
}

const uint8_t *ecu_slot(uint32_t slot) {
    FILE *file = fopen(files[slot], "rb");
    if (file != NULL) {
        (void)!fread(slots[slot], 1, sizeof slots[slot], file);
        fclose(file);
    }
    return slots[slot];
}

void ecu_write_slot(uint32_t slot, uint32_t at, const uint8_t *piece, size_t size) {
    FILE *file = fopen(files[slot], at == 0 ? "wb" : "r+b");
    fseek(file, (long)at, SEEK_SET);
    fwrite(piece, 1, size, file);
    fclose(file);
}

int main(void) {
    const oc_vehicle vehicle = {.wheelbase = 3.9, .steering_ratio = 19.3, .traffic_side = 1.0};
    return (int)run_monitor(&vehicle, 0.02);
}

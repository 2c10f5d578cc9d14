/* The four functions that the main program of an exported README needs, as C and as C++: ticks as five doubles each on
 * stdin, valid offsets as text on stdout, slots in files. */

#include <stdio.h>
#include <string.h>

#include "oncenter.h"

bool read_signals(oc_signals *tick);
void use_offset(double offset, double offset_sd);
void read_slot(uint32_t slot, uint32_t at, uint8_t *to, size_t size);
void write_slot(uint32_t slot, uint32_t at, const uint8_t *from, size_t size);

static const char *const files[2] = {"slot_0", "slot_1"};

bool read_signals(oc_signals *tick) {
    double in[5];
    if (fread(in, sizeof in, 1, stdin) != 1) {
        return false;
    }
    memset(tick, 0, sizeof *tick);
    tick->time = in[0];
    tick->steering_wheel_angle = in[1];
    tick->yaw_rate = in[2];
    tick->vehicle_speed = in[3];
    tick->lateral_acceleration = in[4];
    tick->valid = 15u;
    return true;
}

void use_offset(double offset, double offset_sd) {
    printf("%a %a\n", offset, offset_sd);
}

/* As erased flash where nothing was written. */
void read_slot(uint32_t slot, uint32_t at, uint8_t *to, size_t size) {
    FILE *file = fopen(files[slot], "rb");
    memset(to, 0xFF, size);
    if (file != NULL) {
        fseek(file, (long)at, SEEK_SET);
        (void)!fread(to, 1, size, file);
        fclose(file);
    }
}

void write_slot(uint32_t slot, uint32_t at, const uint8_t *from, size_t size) {
    FILE *file = fopen(files[slot], at == 0 ? "wb" : "r+b");
    fseek(file, (long)at, SEEK_SET);
    fwrite(from, 1, size, file);
    fclose(file);
}

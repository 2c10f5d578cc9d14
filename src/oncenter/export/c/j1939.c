#include "j1939.h"

#include <string.h>

static const double long_ago = -1e9;                       /* s */
static const double vdc2_held_s = 0.05, slow_held_s = 0.3; /* periods are 0.01 s, and 0.1 s of the others */
static const double m_s_per_km_h = 1.0 / 3.6;

static const uint32_t vdc2_bits = OC_HAS_STEERING_WHEEL_ANGLE | OC_HAS_YAW_RATE | OC_HAS_LATERAL_ACCELERATION;
static const uint32_t ebc2_bits = OC_HAS_WHEEL_SPEED_FRONT_LEFT | OC_HAS_WHEEL_SPEED_FRONT_RIGHT |
                                  OC_HAS_WHEEL_SPEED_REAR_LEFT | OC_HAS_WHEEL_SPEED_REAR_RIGHT;

void j1939_init(j1939_signals *bus) {
    memset(bus, 0, sizeof *bus);
    bus->vdc2_s = bus->ebc2_s = bus->ccvs1_s = bus->vdc1_s = bus->ebc1_s = bus->etc2_s = long_ago;
}

static void set(oc_signals *last, uint32_t bit, double *signal, double value, bool is_number) {
    last->valid = is_number ? last->valid | bit : last->valid & ~bit;
    *signal = is_number ? value : *signal;
}

/* Two bytes, the lower first. Above 0xFAFF is no number. */
static void set_word(oc_signals *last, uint32_t bit, double *signal, const uint8_t *at, double scale, double offset) {
    const uint32_t raw = (uint32_t)at[0] | (uint32_t)at[1] << 8;
    set(last, bit, signal, (double)raw * scale + offset, raw <= 0xFAFFu);
}

/* A wheel's speed relative to that of the front axle, 1/16 km/h less 7.8125. */
static void set_wheel(oc_signals *last, uint32_t bit, double *signal, const uint8_t *data, uint32_t byte) {
    const uint32_t axle = (uint32_t)data[0] | (uint32_t)data[1] << 8;
    const double km_h = (double)axle / 256.0 + (double)data[byte] / 16.0 - 7.8125;
    set(last, bit, signal, km_h * m_s_per_km_h, axle <= 0xFAFFu && data[byte] <= 0xFAu);
}

/* States of two bits each: 0 passive, 1 active, else no number. Active where one of them is. */
static void set_states(oc_signals *last, uint32_t bit, double *signal, uint32_t states, uint32_t count) {
    bool is_active = false, is_known = false;
    for (uint32_t k = 0; k < count; ++k) {
        const uint32_t state = states >> (2u * k) & 3u;
        is_active = is_active || state == 1u;
        is_known = is_known || state <= 1u;
    }
    set(last, bit, signal, is_active ? 1.0 : 0.0, is_known);
}

void j1939_receive(j1939_signals *bus, uint32_t pgn, const uint8_t *data, double time_s) {
    oc_signals *last = &bus->last;
    switch (pgn) {
    case J1939_VDC2:
        set_word(last, OC_HAS_STEERING_WHEEL_ANGLE, &last->steering_wheel_angle, data, 1.0 / 1024.0, -31.374);
        set_word(last, OC_HAS_YAW_RATE, &last->yaw_rate, data + 3, 1.0 / 8192.0, -3.92);
        set_word(last, OC_HAS_LATERAL_ACCELERATION, &last->lateral_acceleration, data + 5, 1.0 / 2048.0, -15.687);
        bus->vdc2_s = time_s;
        break;
    case J1939_EBC2:
        set_wheel(last, OC_HAS_WHEEL_SPEED_FRONT_LEFT, &last->wheel_speed_front_left, data, 2);
        set_wheel(last, OC_HAS_WHEEL_SPEED_FRONT_RIGHT, &last->wheel_speed_front_right, data, 3);
        set_wheel(last, OC_HAS_WHEEL_SPEED_REAR_LEFT, &last->wheel_speed_rear_left, data, 4);
        set_wheel(last, OC_HAS_WHEEL_SPEED_REAR_RIGHT, &last->wheel_speed_rear_right, data, 5);
        bus->ebc2_s = time_s;
        break;
    case J1939_CCVS1:
        set_word(last, OC_HAS_VEHICLE_SPEED, &last->vehicle_speed, data + 1, m_s_per_km_h / 256.0, 0.0);
        bus->ccvs1_s = time_s;
        break;
    case J1939_VDC1: /* roll-over prevention and yaw control, by engine and brakes */
        set_states(last, OC_HAS_STABILITY_CONTROL_ACTIVE, &last->stability_control_active, data[1], 4);
        bus->vdc1_s = time_s;
        break;
    case J1939_EBC1: /* bits 5 and 6 */
        set_states(last, OC_HAS_ANTI_LOCK_ACTIVE, &last->anti_lock_active, (uint32_t)data[0] >> 4, 1);
        bus->ebc1_s = time_s;
        break;
    case J1939_ETC2: /* gears of -15 to 25 */
        set(last, OC_HAS_REVERSE, &last->reverse, data[3] < 125u ? 1.0 : 0.0, data[3] >= 110u && data[3] <= 150u);
        bus->etc2_s = time_s;
        break;
    default: break;
    }
}

void j1939_tick(const j1939_signals *bus, double time_s, oc_signals *tick) {
    *tick = bus->last;
    tick->time = time_s;
    tick->valid &= time_s - bus->vdc2_s < vdc2_held_s ? ~0u : ~vdc2_bits;
    tick->valid &= time_s - bus->ebc2_s < slow_held_s ? ~0u : ~ebc2_bits;
    tick->valid &= time_s - bus->ccvs1_s < slow_held_s ? ~0u : ~(uint32_t)OC_HAS_VEHICLE_SPEED;
    tick->valid &= time_s - bus->vdc1_s < slow_held_s ? ~0u : ~(uint32_t)OC_HAS_STABILITY_CONTROL_ACTIVE;
    tick->valid &= time_s - bus->ebc1_s < slow_held_s ? ~0u : ~(uint32_t)OC_HAS_ANTI_LOCK_ACTIVE;
    tick->valid &= time_s - bus->etc2_s < slow_held_s ? ~0u : ~(uint32_t)OC_HAS_REVERSE;
}

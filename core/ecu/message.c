#include "message.h"

#include <math.h>

/* Derived. */
static const double angle_step = 1.0 / 1024.0, angle_min = -31.374; /* rad, SPN 1807's */
static const double offset_step = 1.0 / 4096.0, offset_min = -7.84375; /* rad, dbc/oncenter_result.dbc */
static const double sd_step = 1.0 / 2048.0;                             /* rad, the same */
static const uint32_t word_last = 0xFAFFu, byte_last = 0xFAu; /* J1939: larger values are no numbers */
static const uint32_t no_word = 0xFFFFu, no_byte = 0xFFu; /* J1939: not available */

const char *oc_angle_source_name(oc_angle_source source) {
    static const char *const names[OC_SOURCE_COUNT] = {"none", "measured", "compensated", "estimated"};
    return (unsigned)source < OC_SOURCE_COUNT ? names[source] : "unknown";
}

oc_message oc_message_of(const oc_output *output, const oc_signals *tick, uint32_t counter) {
    const bool has_sensor = (tick->valid & OC_HAS_STEERING_WHEEL_ANGLE) && output->fault == OC_FAULT_NONE;
    const bool has_offset = output->offset_status != OC_UNOBSERVABLE;
    const bool has_estimate = output->angle.status == OC_VALID || output->angle.status == OC_CONVERGING;
    oc_message message = {
        .angle = (double)NAN,
        .angle_sd = (double)NAN,
        .offset = has_offset ? output->offset : (double)NAN,
        .offset_sd = has_offset ? output->offset_sd : (double)NAN,
        .offset_status = output->offset_status,
        .fault = output->fault,
        .counter = counter & 15u,
    };
    if (has_sensor && output->offset_status == OC_VALID) {
        message.source = OC_SOURCE_COMPENSATED;
        message.angle = tick->steering_wheel_angle - output->offset;
        message.angle_sd = output->offset_sd;
    } else if (has_sensor) {
        message.source = OC_SOURCE_MEASURED;
        message.angle = tick->steering_wheel_angle;
    } else if (has_estimate) {
        message.source = OC_SOURCE_ESTIMATED;
        message.angle = output->angle.angle;
        message.angle_sd = output->angle.standard_deviation;
    }
    return message;
}

static uint32_t word_of(double value, double step, double minimum) {
    const double steps = (value - minimum) / step + 0.5;
    return steps >= 0.0 && steps < (double)(word_last + 1u) ? (uint32_t)(int32_t)steps : no_word;
}

/* Rounded up, so that a receiver never gets a smaller sd. */
static uint32_t byte_of(double sd) {
    const double steps = sd / sd_step;
    if (!(steps >= 0.0)) {
        return no_byte;
    }
    if (steps > (double)byte_last) {
        return byte_last;
    }
    const int32_t whole = (int32_t)steps;
    return (uint32_t)whole + (whole < steps ? 1u : 0u);
}

void oc_message_encode(const oc_message *message, uint8_t *data) {
    const uint32_t offset = word_of(message->offset, offset_step, offset_min);
    uint32_t angle = word_of(message->angle, angle_step, angle_min);
    if (message->source == OC_SOURCE_NONE || (message->source == OC_SOURCE_COMPENSATED && offset == no_word)) {
        angle = no_word;
    }
    const uint32_t source = angle == no_word ? (uint32_t)OC_SOURCE_NONE : (uint32_t)message->source;
    data[0] = (uint8_t)(angle & 0xFFu);
    data[1] = (uint8_t)(angle >> 8);
    data[2] = (uint8_t)(offset & 0xFFu);
    data[3] = (uint8_t)(offset >> 8);
    data[4] = (uint8_t)(offset == no_word ? no_byte : byte_of(message->offset_sd));
    data[5] = (uint8_t)(((uint32_t)message->offset_status & 15u) | source << 4);
    data[6] = (uint8_t)(((uint32_t)message->fault & 15u) | (message->counter & 15u) << 4);
    data[7] = (uint8_t)(angle == no_word ? no_byte : byte_of(message->angle_sd));
}

static double number_of_word(uint32_t word, double step, double minimum) {
    return word <= word_last ? (double)word * step + minimum : (double)NAN;
}

static double number_of_byte(uint32_t byte) {
    return byte <= byte_last ? (double)byte * sd_step : (double)NAN;
}

bool oc_message_decode(oc_message *message, const uint8_t *data) {
    const uint32_t status = data[5] & 15u, source = (uint32_t)data[5] >> 4, fault = data[6] & 15u;
    if (status >= OC_STATUS_COUNT || source >= OC_SOURCE_COUNT || fault >= OC_FAULT_COUNT) {
        return false;
    }
    *message = (oc_message){
        .source = (oc_angle_source)source,
        .angle = number_of_word((uint32_t)data[0] | (uint32_t)data[1] << 8, angle_step, angle_min),
        .angle_sd = number_of_byte(data[7]),
        .offset = number_of_word((uint32_t)data[2] | (uint32_t)data[3] << 8, offset_step, offset_min),
        .offset_sd = number_of_byte(data[4]),
        .offset_status = (oc_status)status,
        .fault = (oc_fault)fault,
        .counter = (uint32_t)data[6] >> 4,
    };
    return true;
}

oc_message_parts oc_message_parts_of(const oc_output *output, uint32_t counter) {
    const oc_offset_parts *parts = &output->offset_parts;
    if (output->offset_status == OC_UNOBSERVABLE) {
        const double nothing = (double)NAN;
        return (oc_message_parts){nothing, nothing, nothing, nothing, counter & 15u};
    }
    return (oc_message_parts){(double)parts->drive_sd, (double)parts->pull_sd, (double)parts->wind_sd,
                              (double)parts->set_up_sd, counter & 15u};
}

void oc_message_parts_encode(const oc_message_parts *parts, uint8_t *data) {
    data[0] = (uint8_t)byte_of(parts->drive_sd);
    data[1] = (uint8_t)byte_of(parts->pull_sd);
    data[2] = (uint8_t)byte_of(parts->wind_sd);
    data[3] = (uint8_t)byte_of(parts->set_up_sd);
    data[4] = (uint8_t)no_byte;
    data[5] = (uint8_t)no_byte;
    data[6] = (uint8_t)(15u | (parts->counter & 15u) << 4);
    data[7] = (uint8_t)no_byte;
}

oc_message_parts oc_message_parts_decode(const uint8_t *data) {
    return (oc_message_parts){number_of_byte(data[0]), number_of_byte(data[1]), number_of_byte(data[2]),
                              number_of_byte(data[3]), (uint32_t)data[6] >> 4};
}

bool oc_message_measured(const oc_message *message, double *measured) {
    const bool compensated = message->source == OC_SOURCE_COMPENSATED;
    *measured = compensated ? message->angle + message->offset : message->angle;
    return (compensated || message->source == OC_SOURCE_MEASURED) && !isnan(*measured);
}

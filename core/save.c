#include "save.h"

#include <string.h>

#include "saved_members.h"

/* To be raised when a member means something else than before, or an image is laid out otherwise; members more, fewer
 * or of another type are noticed without. */
static const uint32_t layout_number = 4;

static const uint32_t magic = 0x5653434Fu; /* "OCSV" */

enum { AT_MAGIC = 0, AT_LAYOUT = 4, AT_KEY = 8, AT_SEQUENCE = 12, AT_LENGTH = 16, AT_STATE = 20, CRC_BYTES = 4 };

const char *oc_image_fault_name(oc_image_fault fault) {
    static const char *const names[OC_IMAGE_FAULT_COUNT] = {"ok",     "missing", "truncated",  "damaged",
                                                            "layout", "foreign", "implausible"};
    return (unsigned)fault < OC_IMAGE_FAULT_COUNT ? names[fault] : "unknown";
}

static void put(uint8_t *to, uint64_t value, size_t bytes) {
    for (size_t k = 0; k < bytes; ++k, value >>= 8) {
        to[k] = (uint8_t)(value & 0xFFu);
    }
}

static uint64_t got(const uint8_t *from, size_t bytes) {
    uint64_t value = 0;
    for (size_t k = bytes; k > 0; --k) {
        value = value << 8 | from[k - 1];
    }
    return value;
}

static uint32_t got_word(const uint8_t *from) {
    return (uint32_t)got(from, 4);
}

/* CRC-32 of IEEE 802.3, four bits at a time: the table of all bytes would be a kilobyte of flash. */
static uint32_t crc_over(uint32_t crc, const uint8_t *bytes, size_t count) {
    static const uint32_t of[16] = {0x00000000u, 0x1DB71064u, 0x3B6E20C8u, 0x26D930ACu, 0x76DC4190u, 0x6B6B51F4u,
                                    0x4DB26158u, 0x5005713Cu, 0xEDB88320u, 0xF00F9344u, 0xD6D6A3E8u, 0xCB61B38Cu,
                                    0x9B64C2B0u, 0x86D3D2D4u, 0xA00AE278u, 0xBDBDF21Cu};
    crc = ~crc;
    for (size_t k = 0; k < count; ++k) {
        crc = crc >> 4 ^ of[(crc ^ bytes[k]) & 15u];
        crc = crc >> 4 ^ of[(crc ^ (uint32_t)bytes[k] >> 4) & 15u];
    }
    return ~crc;
}

/* All enums are of one size here, or this does not compile. */
enum { ENUMS_ARE_ALIKE = 1 / (sizeof(oc_status) == sizeof(oc_fault) && sizeof(oc_status) == sizeof(oc_change_kind)) };

/* A number as its bits, wherever it lies; memcpy is what C99 lets look at them. */
static uint64_t bits_at(const uint8_t *from, size_t bytes) {
    uint64_t wide = 0;
    uint32_t narrow = 0;
    switch (bytes) {
    case sizeof wide: memcpy(&wide, from, sizeof wide); return wide;
    case sizeof narrow: memcpy(&narrow, from, sizeof narrow); return narrow;
    default: return *from;
    }
}

static void set_bits(uint8_t *to, size_t bytes, uint64_t bits) {
    const uint32_t narrow = (uint32_t)bits;
    switch (bytes) {
    case sizeof bits: memcpy(to, &bits, sizeof bits); break;
    case sizeof narrow: memcpy(to, &narrow, sizeof narrow); break;
    default: *to = (uint8_t)narrow; break;
    }
}

/* What the bits stand for, to be compared with limits. */
static double number_of(oc_saved_kind kind, uint64_t bits) {
    const uint32_t low = (uint32_t)bits, high = (uint32_t)(bits >> 32);
    double wide;
    float narrow;
    int32_t whole;
    switch (kind) {
    case OC_SAVED_DOUBLE: memcpy(&wide, &bits, sizeof wide); return wide;
    case OC_SAVED_FLOAT: memcpy(&narrow, &low, sizeof narrow); return (double)narrow;
    case OC_SAVED_INT32: memcpy(&whole, &low, sizeof whole); return whole;
    default: return (double)high * 4294967296.0 + (double)low;
    }
}

/* All members to the image. */
static void save_members(const oc_state *state, uint8_t *to) {
    oc_saved_cursor at = {0};
    while (oc_saved_next(&at)) {
        const oc_saved_kind kind = oc_saved_kind_of(at.member);
        const size_t step = oc_saved_native_bytes(kind), bytes = oc_saved_image_bytes(kind);
        const uint8_t *from = (const uint8_t *)state + at.place;
        for (size_t k = 0; k < at.member->count; ++k, to += bytes) {
            put(to, bits_at(from + k * step, step), bytes);
        }
    }
}

/* All members from the image; false where a number is out of its range. */
static bool restore_members(oc_state *state, const uint8_t *from) {
    oc_saved_cursor at = {0};
    while (oc_saved_next(&at)) {
        const oc_saved_kind kind = oc_saved_kind_of(at.member);
        const size_t step = oc_saved_native_bytes(kind), bytes = oc_saved_image_bytes(kind);
        uint8_t *to = (uint8_t *)state + at.place;
        for (size_t k = 0; k < at.member->count; ++k, from += bytes) {
            const uint64_t bits = got(from, bytes);
            if (!oc_saved_in_range(at.member, number_of(kind, bits))) {
                return false;
            }
            set_bits(to + k * step, step, bits);
        }
    }
    return true;
}

/* How long the state is in the image, and what it is made of. */
typedef struct {
    size_t bytes;
    uint32_t crc;
} measuring;

static measuring measure_state(void) {
    measuring m = {.crc = layout_number};
    oc_saved_cursor at = {0};
    while (oc_saved_next(&at)) {
        const oc_saved_kind kind = oc_saved_kind_of(at.member);
        const size_t bytes = at.member->count * oc_saved_image_bytes(kind);
        uint8_t told[5];
        put(told, bytes, 4);
        told[4] = (uint8_t)kind;
        m.bytes += bytes;
        m.crc = crc_over(m.crc, told, sizeof told);
    }
    return m;
}

uint32_t oc_save_key(const oc_coefficients *c) {
    const uint8_t methods[2] = {(uint8_t)c->params.method, (uint8_t)c->params.angle_method};
    uint32_t crc = crc_over(0, methods, sizeof methods);
    const oc_saved_member *member = oc_keyed_member(0);
    for (size_t number = 1; member != NULL; member = oc_keyed_member(number), ++number) {
        const size_t step = oc_saved_native_bytes(oc_saved_kind_of(member));
        const uint8_t *from = (const uint8_t *)c + member->offset;
        for (size_t k = 0; k < member->count; ++k) {
            uint8_t told[8];
            put(told, bits_at(from + k * step, step), sizeof told);
            crc = crc_over(crc, told, sizeof told);
        }
    }
    return crc;
}

size_t oc_save_size(void) {
    return AT_STATE + measure_state().bytes + CRC_BYTES;
}

size_t oc_save(const oc_state *state, const oc_coefficients *c, uint32_t sequence, uint8_t *image, size_t size) {
    const measuring measured = measure_state();
    const size_t covered = AT_STATE + measured.bytes;
    if (size < covered + CRC_BYTES) {
        return 0;
    }
    put(image + AT_MAGIC, magic, 4);
    put(image + AT_LAYOUT, measured.crc, 4);
    put(image + AT_KEY, oc_save_key(c), 4);
    put(image + AT_SEQUENCE, sequence, 4);
    put(image + AT_LENGTH, covered + CRC_BYTES, 4);
    save_members(state, image + AT_STATE);
    put(image + covered, crc_over(0, image, covered), CRC_BYTES);
    return covered + CRC_BYTES;
}

/* All that can be said against an image before its numbers are looked at. */
static oc_image_fault fault_of(const oc_coefficients *c, const uint8_t *image, size_t size) {
    if (size < AT_MAGIC + 4 || got_word(image + AT_MAGIC) != magic) {
        return OC_IMAGE_MISSING;
    }
    if (size < AT_STATE + CRC_BYTES || got_word(image + AT_LENGTH) > size) {
        return OC_IMAGE_TRUNCATED;
    }
    const size_t length = got_word(image + AT_LENGTH);
    if (length < AT_STATE + CRC_BYTES ||
        crc_over(0, image, length - CRC_BYTES) != got_word(image + length - CRC_BYTES)) {
        return OC_IMAGE_DAMAGED;
    }
    const measuring measured = measure_state();
    if (got_word(image + AT_LAYOUT) != measured.crc || length != AT_STATE + measured.bytes + CRC_BYTES) {
        return OC_IMAGE_LAYOUT;
    }
    return got_word(image + AT_KEY) == oc_save_key(c) ? OC_IMAGE_OK : OC_IMAGE_FOREIGN;
}

oc_image_fault oc_restore(oc_state *state, const oc_coefficients *c, const uint8_t *image, size_t size,
                          uint32_t *sequence) {
    const oc_image_fault fault = fault_of(c, image, size);
    oc_init(state);
    *sequence = 0;
    if (fault != OC_IMAGE_OK) {
        return fault;
    }
    if (!restore_members(state, image + AT_STATE) || !oc_saved_plausible(state, c)) {
        oc_init(state);
        return OC_IMAGE_IMPLAUSIBLE;
    }
    *sequence = got_word(image + AT_SEQUENCE);
    return OC_IMAGE_OK;
}

oc_image_fault oc_restore_newest(oc_state *state, const oc_coefficients *c, const uint8_t *slot_0,
                                 const uint8_t *slot_1, size_t size, uint32_t *sequence) {
    /* by the difference, so that a sequence may run over */
    const bool second = size >= AT_STATE &&
                        got_word(slot_1 + AT_SEQUENCE) - got_word(slot_0 + AT_SEQUENCE) - 1u < 0x7FFFFFFFu;
    const oc_image_fault fault = oc_restore(state, c, second ? slot_1 : slot_0, size, sequence);
    if (fault == OC_IMAGE_OK) {
        return OC_IMAGE_OK;
    }
    const oc_image_fault other = oc_restore(state, c, second ? slot_0 : slot_1, size, sequence);
    return other == OC_IMAGE_OK ? OC_IMAGE_OK : fault;
}

#include "save.h"

#include <string.h>

#include "saved_layout.h"
#include "saved_plausible.h"

/* Derived. */
static const uint32_t magic = 0x5653434Fu; /* "OCSV" in ASCII, little-endian */
/* Offsets in the image, save.h. */
enum { AT_MAGIC = 0, AT_LAYOUT = 4, AT_KEY = 8, AT_SEQUENCE = 12, AT_LENGTH = 16, AT_STATE = 20, CRC_BYTES = 4 };

/* Numerical. */
/* Exponents of IEEE 754, against overflow in products of a few numbers; infinity and NaN are beyond them, too. */
enum { DOUBLE_EXPONENT_MAX = 1023 + 60, FLOAT_EXPONENT_MAX = 127 + 30 };
static const uint64_t count_max = 9007199254740992u; /* 2^53, against rounding as double */

const char *oc_image_fault_name(oc_image_fault fault) {
    static const char *const names[OC_IMAGE_FAULT_COUNT] = {"ok",     "missing", "truncated",  "damaged",
                                                            "layout", "foreign", "implausible"};
    return (unsigned)fault < OC_IMAGE_FAULT_COUNT ? names[fault] : "unknown";
}

static void write_number(uint8_t *to, uint64_t value, size_t bytes) {
    for (size_t k = 0; k < bytes; ++k, value >>= 8) {
        to[k] = (uint8_t)(value & 0xFFu);
    }
}

static uint64_t read_number(const uint8_t *from, size_t bytes) {
    uint64_t value = 0;
    for (size_t k = bytes; k > 0; --k) {
        value = value << 8 | from[k - 1];
    }
    return value;
}

static uint32_t read_word(const uint8_t *from) {
    return (uint32_t)read_number(from, 4);
}

/* CRC-32 of IEEE 802.3, four bits at a time: a table of all bytes would take a kilobyte of flash. */
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

/* Compiles only if all enums have the same size. */
enum { ENUMS_ARE_ALIKE = 1 / (sizeof(oc_status) == sizeof(oc_fault) && sizeof(oc_status) == sizeof(oc_change_kind)) };

/* Bytes of one number in the image, and in memory. */
static size_t bytes_saved(uint8_t kind) {
    return kind == OC_SAVED_DOUBLE || kind == OC_SAVED_UINT64 ? 8u : 4u;
}

static size_t bytes_in_memory(uint8_t kind) {
    return kind == OC_SAVED_ENUM ? sizeof(oc_status) : bytes_saved(kind);
}

/* A number's bits; C99 allows memcpy only. */
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

/* Whether the bits are an acceptable number; integers are flags and indices, -1 at least. */
static bool is_number(uint8_t kind, uint64_t bits) {
    const uint32_t low = (uint32_t)bits, high = (uint32_t)(bits >> 32);
    switch (kind) {
    case OC_SAVED_DOUBLE: return (high >> 20 & 0x7FFu) < DOUBLE_EXPONENT_MAX;
    case OC_SAVED_FLOAT: return (low >> 23 & 0xFFu) < FLOAT_EXPONENT_MAX;
    case OC_SAVED_UINT64: return bits <= count_max;
    case OC_SAVED_ENUM: return low <= 0x7Fu;
    default: return low + 1u <= 1000000001u;
    }
}

/* Writes a run's numbers to the image; returns the end. */
static uint8_t *save_run(const uint8_t *from, const oc_saved_run *run, uint8_t *to) {
    const size_t step = bytes_in_memory(run->kind), bytes = bytes_saved(run->kind);
    for (size_t each = 0; each < run->times; ++each) {
        const uint8_t *next = from + run->place + each * run->step * 4u;
        for (size_t k = 0; k < run->count; ++k, next += step, to += bytes) {
            write_number(to, bits_at(next, step), bytes);
        }
    }
    return to;
}

/* Reads a run's numbers; NULL where one is not acceptable. */
static const uint8_t *restore_run(uint8_t *to, const oc_saved_run *run, const uint8_t *from) {
    const size_t step = bytes_in_memory(run->kind), bytes = bytes_saved(run->kind);
    for (size_t each = 0; each < run->times; ++each) {
        uint8_t *next = to + run->place + each * run->step * 4u;
        for (size_t k = 0; k < run->count; ++k, next += step, from += bytes) {
            const uint64_t bits = read_number(from, bytes);
            if (!is_number(run->kind, bits)) {
                return NULL;
            }
            set_bits(next, step, bits);
        }
    }
    return from;
}

static bool restore_state(oc_state *state, const uint8_t *from) {
    size_t count;
    const oc_saved_run *runs = oc_saved_state(&count);
    for (size_t k = 0; k < count && from != NULL; ++k) {
        from = restore_run((uint8_t *)state, &runs[k], from);
    }
    return from != NULL;
}

uint32_t oc_save_key(const oc_coefficients *c) {
    uint32_t crc = 0;
    size_t count;
    const oc_saved_run *runs = oc_saved_keyed(&count);
    for (const oc_saved_run *run = runs; run < runs + count; ++run) {
        const size_t step = bytes_in_memory(run->kind);
        const uint8_t *from = (const uint8_t *)c + run->place;
        for (size_t k = 0; k < run->count; ++k) {
            uint8_t word[8];
            write_number(word, bits_at(from + k * step, step), sizeof word);
            crc = crc_over(crc, word, sizeof word);
        }
    }
    return crc;
}

size_t oc_save_size(void) {
    size_t bytes = AT_STATE + CRC_BYTES, count;
    const oc_saved_run *runs = oc_saved_state(&count);
    for (size_t k = 0; k < count; ++k) {
        bytes += runs[k].times * runs[k].count * bytes_saved(runs[k].kind);
    }
    return bytes;
}

size_t oc_save(const oc_state *state, const oc_coefficients *c, uint32_t sequence, uint8_t *image, size_t size) {
    const size_t length = oc_save_size();
    if (size < length) {
        return 0;
    }
    write_number(image + AT_MAGIC, magic, 4);
    write_number(image + AT_LAYOUT, oc_saved_layout(), 4);
    write_number(image + AT_KEY, oc_save_key(c), 4);
    write_number(image + AT_SEQUENCE, sequence, 4);
    write_number(image + AT_LENGTH, length, 4);
    uint8_t *to = image + AT_STATE;
    size_t count;
    const oc_saved_run *runs = oc_saved_state(&count);
    for (size_t k = 0; k < count; ++k) {
        to = save_run((const uint8_t *)state, &runs[k], to);
    }
    write_number(to, crc_over(0, image, length - CRC_BYTES), CRC_BYTES);
    return length;
}

/* All checks except those of the numbers. */
static oc_image_fault fault_of(const oc_coefficients *c, const uint8_t *image, size_t size) {
    if (size < AT_MAGIC + 4 || read_word(image + AT_MAGIC) != magic) {
        return OC_IMAGE_MISSING;
    }
    if (size < AT_STATE + CRC_BYTES || read_word(image + AT_LENGTH) > size) {
        return OC_IMAGE_TRUNCATED;
    }
    const size_t length = read_word(image + AT_LENGTH);
    if (length < AT_STATE + CRC_BYTES ||
        crc_over(0, image, length - CRC_BYTES) != read_word(image + length - CRC_BYTES)) {
        return OC_IMAGE_DAMAGED;
    }
    if (read_word(image + AT_LAYOUT) != oc_saved_layout() || length != oc_save_size()) {
        return OC_IMAGE_LAYOUT;
    }
    return read_word(image + AT_KEY) == oc_save_key(c) ? OC_IMAGE_OK : OC_IMAGE_FOREIGN;
}

oc_image_fault oc_restore(oc_state *state, const oc_coefficients *c, const uint8_t *image, size_t size,
                          uint32_t *sequence) {
    const oc_image_fault fault = fault_of(c, image, size);
    oc_init(state);
    *sequence = 0;
    if (fault != OC_IMAGE_OK) {
        return fault;
    }
    if (!restore_state(state, image + AT_STATE) || !oc_saved_plausible(state, c)) {
        oc_init(state);
        return OC_IMAGE_IMPLAUSIBLE;
    }
    *sequence = read_word(image + AT_SEQUENCE);
    return OC_IMAGE_OK;
}

oc_image_fault oc_restore_newest(oc_state *state, const oc_coefficients *c, const uint8_t *slot_0,
                                 const uint8_t *slot_1, size_t size, uint32_t *sequence) {
    /* by the difference, so that the sequence may overflow */
    const bool second = size >= AT_STATE &&
                        read_word(slot_1 + AT_SEQUENCE) - read_word(slot_0 + AT_SEQUENCE) - 1u < 0x7FFFFFFFu;
    const oc_image_fault fault = oc_restore(state, c, second ? slot_1 : slot_0, size, sequence);
    if (fault == OC_IMAGE_OK) {
        return OC_IMAGE_OK;
    }
    const oc_image_fault other = oc_restore(state, c, second ? slot_0 : slot_1, size, sequence);
    return other == OC_IMAGE_OK ? OC_IMAGE_OK : fault;
}

#include "save.h"

#include <string.h>

#include "methods.h"
#include "saved_layout.h"
#include "saved_plausible.h"

/* Derived. */
static const uint32_t magic = 0x5653434Fu; /* "OCSV" in ASCII, little-endian */
/* Offsets in the image, save.h. */
enum { AT_MAGIC = 0, AT_LAYOUT = 4, AT_KEY = 8, AT_SEQUENCE = 12, AT_LENGTH = 16, CRC_BYTES = 4 };
enum { TIME_BIT = 1 }; /* of OC_REASON_TIME, 1 << 1 */

/* Numerical. */
/* Exponents of IEEE 754, against overflow in products of a few numbers; infinity and NaN are beyond them, too. */
enum { DOUBLE_EXPONENT_MAX = 1023 + 60, FLOAT_EXPONENT_MAX = 127 + 80 };
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

/* Place of the next number of the state. */
static void go_on(oc_image_place *at, const oc_saved_run *run) {
    at->number += 1;
    if (at->number == run->count) {
        at->number = 0;
        at->each += 1;
    }
    if (at->each == run->times) {
        at->each = 0;
        at->run += 1;
    }
}

static size_t place_of(const oc_image_place *at, const oc_saved_run *run) {
    return run->place + at->each * run->step * 4u + at->number * bytes_in_memory(run->kind);
}

/* The next four bytes of the state. */
static uint32_t saved_word(oc_image_place *at, const oc_state *state) {
    size_t count;
    const oc_saved_run *run = oc_saved_state(&count) + at->run;
    const uint64_t bits = bits_at((const uint8_t *)state + place_of(at, run), bytes_in_memory(run->kind));
    if (at->has_low || bytes_saved(run->kind) == 4u) {
        const bool high = at->has_low;
        at->has_low = false;
        go_on(at, run);
        return (uint32_t)(high ? bits >> 32 : bits);
    }
    at->has_low = true;
    return (uint32_t)bits;
}

/* Takes the next four bytes of the state; false where they complete a number that is not acceptable. */
static bool restore_word(oc_image_place *at, oc_state *state, uint32_t word) {
    size_t count;
    const oc_saved_run *run = oc_saved_state(&count) + at->run;
    if (!at->has_low && bytes_saved(run->kind) == 8u) {
        at->low = word;
        at->has_low = true;
        return true;
    }
    const uint64_t bits = at->has_low ? (uint64_t)word << 32 | at->low : word;
    if (is_number(run->kind, bits)) {
        set_bits((uint8_t *)state + place_of(at, run), bytes_in_memory(run->kind), bits);
    }
    at->has_low = false;
    go_on(at, run);
    return is_number(run->kind, bits);
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
    size_t bytes = OC_IMAGE_HEAD_BYTES + CRC_BYTES, count;
    const oc_saved_run *runs = oc_saved_state(&count);
    for (size_t k = 0; k < count; ++k) {
        bytes += runs[k].times * runs[k].count * bytes_saved(runs[k].kind);
    }
    return bytes;
}

/* Ticks change the state between two pieces; so do rejected ones. */
static uint64_t ticks_of(const oc_state *state) {
    return state->evidence.ticks + state->evidence.rejected[TIME_BIT];
}

/* Begins at the image's first byte. */
static void go_to_begin(oc_image_place *at) {
    memset(at, 0, sizeof *at);
    at->fault = OC_IMAGE_TRUNCATED;
}

void oc_save_begin(oc_image_place *at, const oc_state *state, uint32_t sequence) {
    if (at == NULL || state == NULL) {
        return;
    }
    go_to_begin(at);
    at->sequence = sequence;
    at->words = (uint32_t)(oc_save_size() / 4u);
    at->ticks = ticks_of(state);
}

static uint32_t next_word(oc_image_place *at, const oc_state *state, const oc_coefficients *c) {
    const uint32_t k = at->next;
    at->next += 1;
    if (k >= OC_IMAGE_HEAD_BYTES / 4u) {
        return k + 1u == at->words ? at->crc : saved_word(at, state);
    }
    switch (k) {
    case AT_MAGIC / 4: return magic;
    case AT_LAYOUT / 4: return oc_saved_layout();
    case AT_KEY / 4: return oc_save_key(c);
    case AT_SEQUENCE / 4: return at->sequence;
    default: return 4u * at->words; /* AT_LENGTH */
    }
}

size_t oc_save_piece(oc_image_place *at, const oc_state *state, const oc_coefficients *c, uint8_t *piece, size_t size) {
    size_t written = 0;
    if (at == NULL || piece == NULL || oc_check_call(state, c) != OC_OK || ticks_of(state) != at->ticks) {
        return 0;
    }
    while (at->next < at->words && size - written >= 4u) {
        write_number(piece + written, next_word(at, state, c), 4);
        at->crc = crc_over(at->crc, piece + written, 4);
        written += 4u;
    }
    return written;
}

size_t oc_save(const oc_state *state, const oc_coefficients *c, uint32_t sequence, uint8_t *image, size_t size) {
    oc_image_place at;
    if (state == NULL || size < oc_save_size()) {
        return 0;
    }
    oc_save_begin(&at, state, sequence);
    return oc_save_piece(&at, state, c, image, size);
}

void oc_restore_begin(oc_image_place *at, oc_state *state) {
    if (at == NULL || state == NULL) {
        return;
    }
    go_to_begin(at);
    at->acceptable = true;
    oc_init(state);
    state->ready = 0;
}

/* All words of an image are there. */
static oc_image_fault fault_of_all(const oc_image_place *at, const oc_state *state, const oc_coefficients *c) {
    if (at->damaged) {
        return OC_IMAGE_DAMAGED;
    }
    if (at->other_layout) {
        return OC_IMAGE_LAYOUT;
    }
    if (at->foreign) {
        return OC_IMAGE_FOREIGN;
    }
    return at->acceptable && oc_saved_plausible(state, c) ? OC_IMAGE_OK : OC_IMAGE_IMPLAUSIBLE;
}

static void take_length(oc_image_place *at, uint32_t length) {
    at->words = length / 4u;
    at->other_layout = at->other_layout || length != oc_save_size();
}

/* OC_IMAGE_TRUNCATED: the image goes on. */
static oc_image_fault take_word(oc_image_place *at, oc_state *state, const oc_coefficients *c, uint32_t word) {
    const uint32_t k = at->next;
    at->next += 1;
    switch (k) {
    case AT_MAGIC / 4: return word == magic ? OC_IMAGE_TRUNCATED : OC_IMAGE_MISSING;
    case AT_LAYOUT / 4: at->other_layout = word != oc_saved_layout(); return OC_IMAGE_TRUNCATED;
    case AT_KEY / 4: at->foreign = word != oc_save_key(c); return OC_IMAGE_TRUNCATED;
    case AT_SEQUENCE / 4: at->sequence = word; return OC_IMAGE_TRUNCATED;
    case AT_LENGTH / 4:
        take_length(at, word);
        return word < OC_IMAGE_HEAD_BYTES + CRC_BYTES || word % 4u != 0 ? OC_IMAGE_DAMAGED : OC_IMAGE_TRUNCATED;
    default: break;
    }
    if (k + 1u == at->words) {
        at->damaged = word != at->crc;
        return fault_of_all(at, state, c);
    }
    if (!at->other_layout && !at->foreign) {
        const bool acceptable = restore_word(at, state, word);
        at->acceptable = at->acceptable && acceptable;
    }
    return OC_IMAGE_TRUNCATED;
}

oc_image_fault oc_restore_piece(oc_image_place *at, oc_state *state, const oc_coefficients *c, const uint8_t *piece,
                                size_t size) {
    if (at == NULL || state == NULL || c == NULL || piece == NULL) {
        return OC_IMAGE_MISSING;
    }
    for (size_t k = 0; at->fault == OC_IMAGE_TRUNCATED && size - k >= 4u; k += 4u) {
        at->fault = take_word(at, state, c, read_word(piece + k));
        at->crc = crc_over(at->crc, piece + k, 4);
        if (at->fault == OC_IMAGE_OK) {
            state->ready = OC_STATE_READY;
        } else if (at->fault != OC_IMAGE_TRUNCATED) {
            oc_init(state);
        }
    }
    return at->fault;
}

oc_image_fault oc_restore(oc_state *state, const oc_coefficients *c, const uint8_t *image, size_t size,
                          uint32_t *sequence) {
    oc_image_place at;
    if (sequence != NULL) {
        *sequence = 0;
    }
    if (state == NULL || c == NULL) {
        return OC_IMAGE_MISSING;
    }
    oc_restore_begin(&at, state);
    const oc_image_fault fault = size < 4u ? OC_IMAGE_MISSING : oc_restore_piece(&at, state, c, image, size);
    if (fault != OC_IMAGE_OK) {
        oc_init(state);
    } else if (sequence != NULL) {
        *sequence = at.sequence;
    }
    return fault;
}

uint32_t oc_newer_slot(const uint8_t *head_0, const uint8_t *head_1) {
    /* by the difference, so that the sequence may overflow */
    return read_word(head_1 + AT_SEQUENCE) - read_word(head_0 + AT_SEQUENCE) - 1u < 0x7FFFFFFFu ? 1u : 0u;
}

oc_image_fault oc_restore_newest(oc_state *state, const oc_coefficients *c, const uint8_t *slot_0,
                                 const uint8_t *slot_1, size_t size, uint32_t *sequence) {
    if (slot_0 == NULL || slot_1 == NULL) {
        return oc_restore(state, c, slot_0 == NULL ? slot_1 : slot_0, size, sequence);
    }
    const bool second = size >= OC_IMAGE_HEAD_BYTES && oc_newer_slot(slot_0, slot_1) == 1u;
    const oc_image_fault fault = oc_restore(state, c, second ? slot_1 : slot_0, size, sequence);
    if (fault == OC_IMAGE_OK) {
        return OC_IMAGE_OK;
    }
    const oc_image_fault other = oc_restore(state, c, second ? slot_0 : slot_1, size, sequence);
    return other == OC_IMAGE_OK ? OC_IMAGE_OK : fault;
}

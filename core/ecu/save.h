#ifndef OC_SAVE_H
#define OC_SAVE_H
/* Saves the state over an ignition cycle: an image of bytes, the same on every machine.
 *
 * An image is, all little-endian: magic, layout, vehicle key, sequence and length (4 bytes each), the state's numbers
 * in the order of saved_layout.c (4 or 8 bytes each), CRC-32 (IEEE 802.3) over all bytes before it. The layout is a
 * hash of the numbers' names and kinds. The key is a hash of vehicle, params, methods and rate.
 *
 * The image has the whole state, tracking included. If the tick after restoring is the next one, all outputs are bit
 * for bit the same as without interruption. If it is later, its time reveals the hole, and the filters begin anew.
 * Where the ignition was off, call oc_restart, but not between two pieces: after it, begin again.
 *
 * No tick may come while an image is made, since it is of one moment: save in the task of oc_step, between two ticks,
 * or in another task while that one waits. Saving or restoring takes about a million instructions on a Cortex-M, more
 * than a tick of 10 ms has time for below some 200 MHz. So save where a hole in the ticks costs little, after ignition
 * off or while the truck stands. In pieces it needs no buffer for the whole image.
 *
 * For years of operation use OC_METHOD_JOINT, which forgets. In the other methods all hours have the same weight, so
 * after a thousand hours they hardly follow a remounted sensor. The key identifies the type of vehicle, not the truck:
 * store a serial number with images that may get into another truck.
 *
 * There are two slots. An image goes to slot sequence modulo OC_SAVE_SLOTS and overwrites the older one, so that a
 * power cut during writing leaves the newer one intact. */

#include <stddef.h>
#include <stdint.h>

#include "monitor.h"

enum {
    OC_SAVE_OVERHEAD = 24, /* sizeof(oc_state) + OC_SAVE_OVERHEAD bytes hold any image */
    OC_SAVE_SLOTS = 2,
    OC_IMAGE_HEAD_BYTES = 20
};

/* Reason for refusing an image. */
typedef enum {
    OC_IMAGE_OK,
    OC_IMAGE_MISSING,     /* no magic: never written, or erased; or a NULL */
    OC_IMAGE_TRUNCATED,   /* shorter than its length; in pieces: the next one is needed */
    OC_IMAGE_DAMAGED,     /* the CRC-32 does not fit */
    OC_IMAGE_LAYOUT,      /* intact, of an older or newer version of this library */
    OC_IMAGE_FOREIGN,     /* intact, of another vehicle, or of other params, methods or rate */
    OC_IMAGE_IMPLAUSIBLE, /* intact, with a value that no drive can produce */
    OC_IMAGE_FAULT_COUNT
} oc_image_fault;

/* Where the saving or restoring of an image in pieces has come to; its members are the library's. */
typedef struct {
    uint64_t ticks;     /* of the state when the saving began */
    uint32_t sequence;
    uint32_t next;      /* word of four bytes */
    uint32_t words;     /* of the image */
    uint32_t crc;       /* over the words so far */
    uint32_t low;       /* first word of a number of eight bytes */
    uint32_t run, each, number; /* the next number of the state, saved_layout.h */
    bool has_low;
    bool damaged, other_layout, foreign, acceptable;
    oc_image_fault fault;
} oc_image_place;

const char *oc_image_fault_name(oc_image_fault fault);

/* Hash of vehicle, params, methods and rate; images with another key are refused. */
uint32_t oc_save_key(const oc_coefficients *coefficients);

/* Bytes of an image. */
size_t oc_save_size(void);

/* Bytes written to `image`, 0 where `size` is too small, or where oc_step would return an error. The sequence increases
 * by one with each image of a vehicle. */
size_t oc_save(const oc_state *state, const oc_coefficients *coefficients, uint32_t sequence, uint8_t *image,
               size_t size);

/* The same in pieces, of any multiples of four bytes: begin, then call oc_save_piece until it returns 0. Returns the
 * bytes written to `piece`. A tick in between ends the saving: 0, and what was written is refused as damaged. */
void oc_save_begin(oc_image_place *place, const oc_state *state, uint32_t sequence);
size_t oc_save_piece(oc_image_place *place, const oc_state *state, const oc_coefficients *coefficients, uint8_t *piece,
                     size_t size);

/* Restores the saved state, or that of oc_init if the image is refused. Ignores bytes after the image. Call oc_restart
 * afterwards if the ignition was off or the clock was reset since saving: sensors, steering wheel and heading may have
 * changed. Sets the sequence to the image's, to 0 if it is refused; it may be NULL. */
oc_image_fault oc_restore(oc_state *state, const oc_coefficients *coefficients, const uint8_t *image, size_t size,
                          uint32_t *sequence);

/* The same in pieces, of any multiples of four bytes: begin, then call oc_restore_piece while it returns
 * OC_IMAGE_TRUNCATED. Until the last piece oc_step refuses the state; without one, call oc_init. */
void oc_restore_begin(oc_image_place *place, oc_state *state);
oc_image_fault oc_restore_piece(oc_image_place *place, oc_state *state, const oc_coefficients *coefficients,
                                const uint8_t *piece, size_t size);

/* The slot to try first, by the OC_IMAGE_HEAD_BYTES first bytes of each. */
uint32_t oc_newer_slot(const uint8_t *head_0, const uint8_t *head_1);

/* The same from two slots of `size` bytes each: the newer valid image. If both are refused, the newer one's fault. */
oc_image_fault oc_restore_newest(oc_state *state, const oc_coefficients *coefficients, const uint8_t *slot_0,
                                 const uint8_t *slot_1, size_t size, uint32_t *sequence);

#endif

#ifndef OC_SAVE_H
#define OC_SAVE_H
/* Saves the state over an ignition cycle: an image of bytes, the same on every machine.
 *
 * An image is, all little-endian: magic, layout, vehicle key, sequence and length (4 bytes each), the state's numbers
 * as saved_layout.c has them, of 4 or 8 bytes each, CRC-32 (IEEE 802.3) over all before. The layout is a hash of the
 * numbers' names and kinds, the key one of all that the estimates depend on: vehicle, params, methods and rate.
 *
 * The image has the whole state, tracking included. If the tick after the restoration is the next one, all outputs are
 * the same bit for bit as without the cut. If it is later, its time shows the hole, and the filters begin anew. Where
 * the ignition was off, call oc_restart.
 *
 * Saving or restoring takes half a million instructions on a Cortex-M4F: run it outside a tick's task, and call no
 * oc_step meanwhile.
 *
 * For years of operation use OC_METHOD_JOINT, which forgets. The other methods weigh the first hour as the last, and
 * hardly follow a sensor that is remounted after a thousand. The key identifies the vehicle's kind, not the truck: keep
 * a serial number beside images that could get into another truck.
 *
 * Two slots: an image goes to slot sequence modulo OC_SAVE_SLOTS, over the older one, so that a power cut while it is
 * written leaves the newer one whole. */

#include <stddef.h>
#include <stdint.h>

#include "monitor.h"

enum {
    OC_SAVE_OVERHEAD = 24, /* sizeof(oc_state) + OC_SAVE_OVERHEAD bytes hold any image */
    OC_SAVE_SLOTS = 2
};

/* Why an image is refused. */
typedef enum {
    OC_IMAGE_OK,
    OC_IMAGE_MISSING,     /* no magic: never written, or erased */
    OC_IMAGE_TRUNCATED,   /* shorter than its length */
    OC_IMAGE_DAMAGED,     /* the CRC-32 does not fit */
    OC_IMAGE_LAYOUT,      /* intact, of an older or newer version of this library */
    OC_IMAGE_FOREIGN,     /* intact, of another vehicle, or of other params, methods or rate */
    OC_IMAGE_IMPLAUSIBLE, /* intact, with a value that no drive can produce */
    OC_IMAGE_FAULT_COUNT
} oc_image_fault;

const char *oc_image_fault_name(oc_image_fault fault);

/* A hash of all that the estimates depend on; images of another key are refused. */
uint32_t oc_save_key(const oc_coefficients *coefficients);

/* Bytes of an image. */
size_t oc_save_size(void);

/* Bytes written to `image`, 0 when `size` is too small. The sequence grows by one with each image of a vehicle. */
size_t oc_save(const oc_state *state, const oc_coefficients *coefficients, uint32_t sequence, uint8_t *image,
               size_t size);

/* Restores the saved state, or the one of oc_init when the image is refused. Bytes after the image are ignored. Call
 * oc_restart after it where the ignition was off or the clock began anew since the save: sensors, wheel and heading may
 * have moved. Sets the sequence to the image's, to 0 when it is refused. */
oc_image_fault oc_restore(oc_state *state, const oc_coefficients *coefficients, const uint8_t *image, size_t size,
                          uint32_t *sequence);

/* The same from two slots of `size` bytes each: the newer valid image. When both are refused, the newer one's fault. */
oc_image_fault oc_restore_newest(oc_state *state, const oc_coefficients *coefficients, const uint8_t *slot_0,
                                 const uint8_t *slot_1, size_t size, uint32_t *sequence);

#endif

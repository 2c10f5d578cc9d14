#ifndef OC_SAVE_H
#define OC_SAVE_H
/* What outlives an ignition cycle: the state as an image of bytes, the same on every machine.
 *
 * An image is, all little-endian: magic, layout, vehicle key, sequence and length (4 bytes each), the state's numbers
 * as saved_layout.c has them, of 4 or 8 bytes each, CRC-32 (IEEE 802.3) over all before. The layout is a hash of the
 * numbers' names and kinds, the key one of all that the learned depends on: vehicle, params, methods and rate.
 *
 * The whole state is in it, what moves with the truck as well: whoever is restored goes on to the last bit as if there
 * had been no cut, wherever the truck was, if the tick that comes is the next one. If it is not, its time tells so:
 * after a hole the filters begin anew, as after any. Where the ignition was off, oc_restart says what time may not.
 *
 * To save or to restore takes half a million instructions on a Cortex-M4F: not for the task of a tick, and
 * without a step meanwhile.
 *
 * Who keeps what was learned for years wants OC_METHOD_JOINT, which forgets: the thesis's means and the wheel speeds'
 * weigh the first hour as the last, and hardly move for a sensor that is remounted after a thousand. The key is the
 * vehicle's kind, not the truck: where images may come to another one, a serial number beside them tells.
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

/* What is wrong with an image. */
typedef enum {
    OC_IMAGE_OK,
    OC_IMAGE_MISSING,     /* it does not begin as one: never written, or erased */
    OC_IMAGE_TRUNCATED,   /* shorter than it says */
    OC_IMAGE_DAMAGED,     /* the CRC-32 does not fit */
    OC_IMAGE_LAYOUT,      /* intact, of an older or newer version of this library */
    OC_IMAGE_FOREIGN,     /* intact, of another vehicle, or of other params, methods or rate */
    OC_IMAGE_IMPLAUSIBLE, /* intact, with a value that no drive can have taught */
    OC_IMAGE_FAULT_COUNT
} oc_image_fault;

const char *oc_image_fault_name(oc_image_fault fault);

/* Of all that the learned numbers depend on: what was learned with coefficients of another key is another vehicle's. */
uint32_t oc_save_key(const oc_coefficients *coefficients);

/* Bytes of an image. */
size_t oc_save_size(void);

/* Bytes written to `image`, 0 when `size` is too small. The sequence grows by one with each image of a vehicle. */
size_t oc_save(const oc_state *state, const oc_coefficients *coefficients, uint32_t sequence, uint8_t *image,
               size_t size);

/* Power is back: the state as it was saved; when the image is refused, as oc_init makes it. Bytes after the image do
 * not matter. Where the ignition was off or the clock began anew since it was saved, oc_restart after it tells so:
 * tracking is lost then, and sensors, wheel and heading may be elsewhere. The sequence is set to the image's, to 0 when
 * it is refused. */
oc_image_fault oc_restore(oc_state *state, const oc_coefficients *coefficients, const uint8_t *image, size_t size,
                          uint32_t *sequence);

/* The same from two slots of `size` bytes each: the newer image that is not refused. The fault is the newer's when both
 * are. */
oc_image_fault oc_restore_newest(oc_state *state, const oc_coefficients *coefficients, const uint8_t *slot_0,
                                 const uint8_t *slot_1, size_t size, uint32_t *sequence);

#endif

#ifndef ONCENTER_ECU_H
#define ONCENTER_ECU_H
/* One truck's monitor in the static memory of an ECU project, with the names that oncenter.a2l describes. monitor.h is
 * the manual of signs, units and ranges.
 *
 * After power-up: oncenter_ecu_defaults, then your own calibration if there is one, then restore a saved image, then
 * oncenter_ecu_start. At an ignition without power-up: oncenter_ecu_start alone. Then oncenter_ecu_tick at the rate.
 * After ignition off: save.
 *
 * All functions belong to one task: none may interrupt another. */

#include "monitor.h"
#include "save.h"

/* Hz, of oncenter_ecu_tick, 20 to 200: another one by the compiler's option -D. */
#ifndef ONCENTER_RATE_HZ
#define ONCENTER_RATE_HZ 100
#endif

/* Calibration: oncenter_ecu_defaults sets it. Effective from the next oncenter_ecu_start on. */
extern oc_vehicle oncenter_vehicle;
extern oc_params oncenter_params;
extern const double oncenter_offset_limit; /* rad, of the vehicle file: for oc_trouble_update */

/* Measurements: the input tick, its output, the answer of all ticks. */
extern oc_signals oncenter_tick;
extern oc_output oncenter_output;
extern oc_answer oncenter_answer;

/* The monitor itself: to read, and for functions of monitor.h and save.h. */
extern oc_coefficients oncenter_coefficients;
extern oc_state oncenter_state;
extern uint32_t oncenter_key;      /* of the calibration with which the state was learned; images contain it */
extern uint32_t oncenter_sequence; /* of the image that was restored or saved last; 0: none */

/* Once after power-up: the values of the vehicle file, the joint method, and nothing learned. */
void oncenter_ecu_defaults(void);

/* At each ignition. Returns OC_OK, or the wrong part of the calibration: then ticks are refused, and oc_vehicle_check
 * or oc_params_check names the member. What was learned or restored stays, less certain by what may change while the
 * ignition is off, unless the calibration has changed. Ends a saving that is not complete. */
oc_error oncenter_ecu_start(void);

/* At ONCENTER_RATE_HZ, after oncenter_tick is filled. Any result but OC_OK: the tick is refused, and oncenter_output
 * has no result. OC_ERROR_SETUP: oncenter_ecu_start is missing or has failed. OC_ERROR_STATE: an image is being saved.
 */
oc_error oncenter_ecu_tick(void);

/* Updates oncenter_answer, when it is read. */
oc_error oncenter_ecu_update_answer(void);

/* Saves an image in pieces, for slot `sequence` % OC_SAVE_SLOTS: call oncenter_ecu_save_piece, and write its bytes one
 * after the other, until it returns 0. Until then ticks are refused. The sequence is oncenter_sequence + 1. Returns
 * OC_OK, or why there is nothing to save. */
oc_error oncenter_ecu_save(uint32_t sequence);
size_t oncenter_ecu_save_piece(uint8_t *piece, size_t size); /* size: a multiple of 4 */

/* Restores an image in pieces, before oncenter_ecu_start: call oncenter_ecu_restore_piece with its bytes one after the
 * other while it returns OC_IMAGE_TRUNCATED. Any other result but OC_IMAGE_OK: the image is refused, and nothing is
 * learned. Bytes after the image are ignored. */
void oncenter_ecu_restore(void);
oc_image_fault oncenter_ecu_restore_piece(const uint8_t *piece, size_t size); /* size: a multiple of 4 */

#endif

#ifndef OC_SAVED_LAYOUT_H
#define OC_SAVED_LAYOUT_H
/* The numbers of an image in order: the whole state, as runs of one kind. */

#include <stddef.h>
#include <stdint.h>

typedef enum {
    OC_SAVED_DOUBLE,
    OC_SAVED_FLOAT,
    OC_SAVED_INT32,
    OC_SAVED_UINT64,
    OC_SAVED_ENUM   /* of the compiler's size; four bytes in the image */
} oc_saved_kind;

/* Numbers of one kind that follow one another; of structs in an array those of the first. */
typedef struct {
    uint16_t place; /* bytes, offset of the first number in state or coefficients */
    uint16_t count;
    uint16_t step;  /* words of four bytes to the next struct */
    uint8_t times;  /* number of structs */
    uint8_t kind;   /* oc_saved_kind */
} oc_saved_run;

/* Hash of all numbers' names and kinds. */
uint32_t oc_saved_layout(void);

/* The runs of oc_state, and those of oc_coefficients for the key. */
const oc_saved_run *oc_saved_state(size_t *count);
const oc_saved_run *oc_saved_keyed(size_t *count);

#endif

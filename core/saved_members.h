#ifndef OC_SAVED_MEMBERS_H
#define OC_SAVED_MEMBERS_H
/* Which members of the state an image holds, in which order and within what range: all. And of which the vehicle's key
 * is made. A member more or less is a row more or less in saved_members.c, nothing else. */

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "monitor.h"

typedef enum {
    OC_SAVED_DOUBLE,
    OC_SAVED_FLOAT,
    OC_SAVED_INT32,
    OC_SAVED_UINT64,
    OC_SAVED_ENUM, /* of whatever size the compiler has them: one byte in the image */
    OC_SAVED_KIND_COUNT
} oc_saved_kind;

/* Numbers one after the other: a member, or several of one kind. */
typedef struct {
    uint16_t offset; /* bytes, in its struct */
    uint8_t count;   /* of numbers */
    uint8_t what;    /* kind and limit */
} oc_saved_member;

oc_saved_kind oc_saved_kind_of(const oc_saved_member *member);

/* Where one is among the members of oc_state; begins as all zero. */
typedef struct {
    const oc_saved_member *member;
    size_t place;              /* of it in the state, bytes */
    uint8_t part, number, row; /* the next one's */
} oc_saved_cursor;

/* To the next member; false after the last. */
bool oc_saved_next(oc_saved_cursor *cursor);

/* Of oc_coefficients, the k-th of those that the learned numbers depend on, methods aside; NULL after the last. */
const oc_saved_member *oc_keyed_member(size_t k);

/* Bytes of one number on this machine, and in the image. */
size_t oc_saved_native_bytes(oc_saved_kind kind);
size_t oc_saved_image_bytes(oc_saved_kind kind);

/* Whether a member may have the value; NaN and infinity never. */
bool oc_saved_in_range(const oc_saved_member *member, double value);

/* What no single member shows: covariances that are none, equations without a solution, places beyond the design's
 * ends. The state is not changed. */
bool oc_saved_plausible(oc_state *state, const oc_coefficients *coefficients);

#endif

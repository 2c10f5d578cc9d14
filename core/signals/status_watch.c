#include "status_watch.h"

#include "bounds.h"

/* Tuned, in tuned.toml: status_watch */
/* s: time after which another value of a status counts: stability control, ABS, steering assistance, reverse, lifted
 * axle */
static const float settles_s[OC_WATCHED_STATUSES] = {0.25f, 0.25f, 0.25f, 0.5f, 2.0f};
/* s: length above which a status of stability control or ABS is no intervention */
static const float intervention_max_s = 30.0f;
/* end */

static const uint32_t first_bit = OC_HAS_STABILITY_CONTROL_ACTIVE; /* the others follow */
static const uint32_t interventions = OC_HAS_STABILITY_CONTROL_ACTIVE | OC_HAS_ANTI_LOCK_ACTIVE;

/* Time in the other value counts up, time in the settled one down, so that a status settles though single messages are
 * wrong. */
static void settle(oc_status_watch *watch, uint32_t k, bool differs, float tick_s) {
    float *const differs_s = &watch->differs_s[k];
    *differs_s = oc_max(*differs_s + (differs ? tick_s : -tick_s), 0.0f);
    if (*differs_s > settles_s[k]) {
        *differs_s = 0.0f;
        watch->is_true = (int32_t)((uint32_t)watch->is_true ^ (first_bit << k));
    }
}

uint32_t oc_status_watch_update(oc_status_watch *watch, const oc_signals *tick, float tick_s) {
    const uint32_t available = tick->valid & OC_STATUSES;
    if (available == 0) {
        return 0;
    }
    const uint32_t is_true = oc_signals_true(tick);
    watch->is_true |= (int32_t)(is_true & ~(uint32_t)watch->known);
    watch->known |= (int32_t)available;
    const uint32_t differ = (is_true ^ (uint32_t)watch->is_true) & available;
    for (uint32_t k = 0; k < (uint32_t)OC_WATCHED_STATUSES; ++k) {
        settle(watch, k, (differ & (first_bit << k)) != 0, tick_s);
    }
    const uint32_t settled = (uint32_t)watch->is_true & available;
    watch->intervenes_s = (settled & interventions) != 0 ? watch->intervenes_s + tick_s : 0.0f;
    return watch->intervenes_s > intervention_max_s ? settled & ~interventions : settled;
}

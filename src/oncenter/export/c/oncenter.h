#ifndef ONCENTER_H
#define ONCENTER_H
/* The one header for your code, in C and C++. monitor.h is the manual, oncenter_ecu.h has the functions of an ECU. */

/* major * 10000 + minor * 100 + patch, for #if */
#define ONCENTER_VERSION @VERSION_NUMBER@

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#include "message.h"
#include "monitor.h"
#include "oncenter_ecu.h"
#include "save.h"
#include "trouble.h"

/* Does not compile with the core of another version. */
typedef char oncenter_version_of_core[ONCENTER_VERSION == OC_VERSION_MAJOR * 10000 + OC_VERSION_MINOR * 100 +
                                              OC_VERSION_PATCH ? 1 : -1];

#ifdef __cplusplus
}
#endif

#endif

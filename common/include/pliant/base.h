// base.h: what every face of Pliant shares: version, status, error text, small vectors.
//
// A status says at once what happened and what it cost: 0 done; > 0 a valid state but a lesser
// result; < 0 refused, with no effect. Calls on cold paths also fill a caller's pliant_error (which
// may be NULL) with one line naming the thing, what was expected and what was found.
#pragma once

#include <stdint.h>

#define PLIANT_VERSION_MAJOR 0
#define PLIANT_VERSION_MINOR 3
#define PLIANT_VERSION_PATCH 0
#define PLIANT_VERSION_TEXT  "0.3.0"

#ifdef __cplusplus
#define PLIANT_EXTERN extern "C"
#else
#define PLIANT_EXTERN
#endif

#if defined(__GNUC__)
#define PLIANT_VISIBLE       __attribute__((visibility("default")))
#define PLIANT_UNUSED_RESULT __attribute__((warn_unused_result))
#else
#define PLIANT_VISIBLE
#define PLIANT_UNUSED_RESULT
#endif

// Exported by the library.
#define PLIANT_API PLIANT_EXTERN PLIANT_VISIBLE
// Exported, and its status must be looked at.
#define PLIANT_CALL PLIANT_EXTERN PLIANT_VISIBLE PLIANT_UNUSED_RESULT

typedef enum pliant_status {
    PLIANT_OK = 0,
    PLIANT_LATE = 1,   // the deadline came first: constraints are met on a coarser level
    PLIANT_ROUGH = 2,  // the stored contact compliance is not definite: finite, unreliable
    PLIANT_ERR_ARGUMENT = -1,   // a value outside what the call accepts
    PLIANT_ERR_MEMORY = -2,     // allocation refused
    PLIANT_ERR_IO = -3,         // the system refused to open, read, map or write
    PLIANT_ERR_FORMAT = -4,     // the file's content is broken or inconsistent
    PLIANT_ERR_VERSION = -5,    // the file is newer than this library
    PLIANT_ERR_MISSING = -6,    // the file is sound but lacks what the call needs
    PLIANT_ERR_CAPACITY = -7,   // more constraints than the definition reserved
    PLIANT_ERR_SINGULAR = -8,   // a matrix cannot be inverted
} pliant_status;

// One line of text, without the program's name and without a line break.
typedef struct pliant_error {
    char text[512];
} pliant_error;

typedef struct pliant_vec3 {
    float x, y, z;
} pliant_vec3;

// The status's name, "PLIANT_OK" and so on; static.
PLIANT_API const char *pliant_status_name(pliant_status status);

// error.h: fill a caller's pliant_error and hand the status on.
#pragma once

#include "pliant/base.h"

// Write one formatted line into `err` (nullable; cut at its size) and return `status`, so that a
// refusal reads `return pliant_error_set(err, PLIANT_ERR_FORMAT, "...", ...);`.
#if defined(__GNUC__)
__attribute__((format(printf, 3, 4)))
#endif
pliant_status
pliant_error_set(pliant_error *err, pliant_status status, const char *format, ...);

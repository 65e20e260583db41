// error.c: status names, and the one place that formats error lines.
#include "pliant/error.h"

#include <stdarg.h>
#include <stdio.h>

pliant_status pliant_error_set(pliant_error *err, pliant_status status, const char *format, ...)
{
    if (!err) return status;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(err->text, sizeof err->text, format, arguments);
    va_end(arguments);
    return status;
}

const char *pliant_status_name(pliant_status status)
{
    switch (status) {
    case PLIANT_OK: return "PLIANT_OK";
    case PLIANT_LATE: return "PLIANT_LATE";
    case PLIANT_ROUGH: return "PLIANT_ROUGH";
    case PLIANT_ERR_ARGUMENT: return "PLIANT_ERR_ARGUMENT";
    case PLIANT_ERR_MEMORY: return "PLIANT_ERR_MEMORY";
    case PLIANT_ERR_IO: return "PLIANT_ERR_IO";
    case PLIANT_ERR_FORMAT: return "PLIANT_ERR_FORMAT";
    case PLIANT_ERR_VERSION: return "PLIANT_ERR_VERSION";
    case PLIANT_ERR_MISSING: return "PLIANT_ERR_MISSING";
    case PLIANT_ERR_CAPACITY: return "PLIANT_ERR_CAPACITY";
    case PLIANT_ERR_SINGULAR: return "PLIANT_ERR_SINGULAR";
    }
    return "PLIANT_UNKNOWN";
}

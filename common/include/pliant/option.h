// option.h: how the programs refuse an option: one line, in the same words everywhere.
#pragma once

#include "pliant/base.h"

#include <getopt.h>

// What getopt_long did not like: it returned `code`, ':' or '?' (opterr 0, short options that begin
// with ':'). Says whether the option is unknown, or has a value too many or too few.
PLIANT_UNUSED_RESULT pliant_status pliant_option_refuse(int code, int argc, char **argv,
                                                        const struct option *known,
                                                        pliant_error *err);

// An option's value as a whole number from `least` to `most`.
PLIANT_UNUSED_RESULT pliant_status pliant_option_integer(const char *option, const char *text,
                                                         int32_t least, int32_t most,
                                                         int32_t *value, pliant_error *err);

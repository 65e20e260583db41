// option.c: how the programs refuse an option: one line, in the same words everywhere.
#include "pliant/option.h"

#include "pliant/error.h"

#include <errno.h>
#include <stdlib.h>

pliant_status pliant_option_refuse(int code, int argc, char **argv, const struct option *known,
                                   pliant_error *err)
{
    // getopt leaves what it looked at before optind, and a known option's value in optopt.
    const char *text = optind > 0 && optind <= argc ? argv[optind - 1] : "";
    if (code == ':')
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%.60s: expected a value, found nothing", text);
    for (const struct option *o = known; optopt && o->name; o++)
        if (o->val == optopt && o->has_arg == no_argument)
            return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--%s: expected no value, found %.60s",
                                    o->name, text);
    if (optopt > 0 && optopt < 256)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "-%c: unknown option; see --help", optopt);
    return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%.60s: unknown option; see --help", text);
}

pliant_status pliant_option_integer(const char *option, const char *text, int32_t least,
                                    int32_t most, int32_t *value, pliant_error *err)
{
    char *end;
    errno = 0;
    const long long found = strtoll(text, &end, 10);
    if (end == text || *end || errno || found < least || found > most)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%s: expected a whole number from %d to %d, found '%.60s'",
                                option, (int)least, (int)most, text);
    *value = (int32_t)found;
    return PLIANT_OK;
}

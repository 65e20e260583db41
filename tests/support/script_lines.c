// script_lines.c: statements of a contact script, given as text, played in a test.
#include "script_lines.h"

#include "pliant/error.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const char script_name[] = "t.script";

pliant_status check_play(pliant_player *player, const pliant_observer *observer, pliant_error *err,
                         const char *text)
{
    static const char version[] = "pliant-script 1";
    pliant_statement statement;
    for (int64_t line = 1; *text; line++) {
        const size_t length = strcspn(text, "\n");
        const int is_version = line == 1 && strncmp(text, version, sizeof version - 1) == 0;
        pliant_status status =
            pliant_statement_parse(text, length, script_name, line, is_version, &statement, err);
        if (status >= 0) status = pliant_player_execute(player, &statement, observer, err);
        if (status < 0) return status;
        text += length + (text[length] == '\n');
    }
    return PLIANT_OK;
}

void check_play_ok(pliant_player *player, const char *format, ...)
{
    char text[4096];
    pliant_error err;
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    assert_in_range(length, 0, sizeof text - 1);
    check_ok(check_play(player, NULL, &err, text), &err);
}

void check_play_refused(pliant_player *player, const char *text, const char *part)
{
    pliant_error err = {""};
    const size_t name = sizeof script_name - 1;
    if (check_play(player, NULL, &err, text) >= 0) fail_msg("\"%s\" was not refused", text);
    if (strncmp(err.text, script_name, name) != 0 || err.text[name] != ':' ||
        !strstr(err.text, part) || strchr(err.text, '\n'))
        fail_msg("\"%s\": \"%s\", expected \"%s\"", text, err.text, part);
}

// command.c: run a program as a user would, and look at what it said.
#include "command.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

const char *check_build(void)
{
    const char *build = getenv("PLIANT_BUILD");
    return build && *build ? build : "build";
}

static char folder[256];
static pid_t owner;

static void remove_folder(void)
{
    char command[300];
    if (getpid() != owner) return;  // a child that exits must not take it away
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    if (system(command) != 0) fprintf(stderr, "cannot remove %s\n", folder);
}

const char *check_folder(void)
{
    if (!folder[0]) {
        const char *temporary = getenv("TMPDIR");
        snprintf(folder, sizeof folder, "%s/pliant-test-XXXXXX", temporary && *temporary ? temporary : "/tmp");
        assert_non_null(mkdtemp(folder));
        owner = getpid();
        atexit(remove_folder);
    }
    return folder;
}

static void read_file(const char *path, char *text, size_t size)
{
    FILE *file = fopen(path, "rb");
    const size_t count = file ? fread(text, 1, size - 1, file) : 0;
    text[count] = 0;
    if (file) fclose(file);
}

void check_run(check_command *command, const char *format, ...)
{
    char line[8192], output[300], errors[300];
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    assert_true(length >= 0 && (size_t)length < sizeof line);
    snprintf(output, sizeof output, "%s/stdout", check_folder());
    snprintf(errors, sizeof errors, "%s/stderr", check_folder());
    char whole[9000];
    snprintf(whole, sizeof whole, "{ %s\n} >'%s' 2>'%s' </dev/null", line, output, errors);
    const int status = system(whole);
    command->status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    read_file(output, command->output, sizeof command->output);
    read_file(errors, command->errors, sizeof command->errors);
}

void check_one_line_at(const check_command *command, const char *prefix, const char *part,
                       const char *file, int line)
{
    const char *text = command->errors, *end = strchr(text, '\n');
    if (strncmp(text, prefix, strlen(prefix)) == 0 && strstr(text, part) && end && end[1] == 0) return;
    print_error("expected one line '%s...%s...', found:\n%s", prefix, part, text);
    _fail(file, line);
}

// interruption.c: Ctrl-C, SIGTERM and SIGUSR1: the run ends at the next good place, whole.
//
// mpirun gives a Ctrl-C or SIGTERM of its own to the ranks as SIGTERM, and one second later kills
// them (Open MPI 4.1, odls_base_sigkill_timeout); SIGUSR1 it passes on and waits.
#include "interruption.h"

#include "pliant/error.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

// A signal handler has no other way to learn anything. Texts are whole before they are pointed to,
// and of each there are two, so that one is never changed while a handler reads it.
enum { TEXT_SIZE = 1400, PATH_SIZE = 4200 };
typedef struct reaction {
    int is_at_once;
    char text[TEXT_SIZE], file[PATH_SIZE], folder[PATH_SIZE];
} reaction;
static reaction reactions[2];
static reaction *volatile current = &reactions[0];
static volatile sig_atomic_t received;
static const char *speaker;

static const int signals[] = {SIGINT, SIGTERM, SIGUSR1};

static void handle(int number)
{
    const int saved = errno;
    const reaction *r = current;
    if (!received && r->text[0] && write(STDERR_FILENO, r->text, strlen(r->text)) < 0)
        errno = saved;
    if (received || r->is_at_once) {
        if (r->file[0]) unlink(r->file);
        if (r->folder[0]) rmdir(r->folder);
        _exit(128 + number);
    }
    received = number;
    errno = saved;
}

void pliant_interruption_install(const char *program)
{
    speaker = program;
    struct sigaction action = {.sa_handler = handle, .sa_flags = SA_RESTART};
    sigemptyset(&action.sa_mask);
    for (size_t i = 0; i < sizeof signals / sizeof *signals; i++)
        sigaddset(&action.sa_mask, signals[i]);
    for (size_t i = 0; i < sizeof signals / sizeof *signals; i++) {
        // Who starts a program in the background, or under nohup, may want it not to listen.
        struct sigaction before;
        if (signals[i] == SIGINT && sigaction(SIGINT, NULL, &before) == 0 &&
            before.sa_handler == SIG_IGN)
            continue;
        sigaction(signals[i], &action, NULL);
    }
    signal(SIGXFSZ, SIG_IGN);
}

static void react(int is_at_once, const char *first, const char *hint, const char *file,
                  const char *folder)
{
    reaction *next = current == &reactions[0] ? &reactions[1] : &reactions[0];
    next->is_at_once = is_at_once;
    next->text[0] = next->file[0] = next->folder[0] = 0;
    if (speaker)
        snprintf(next->text, sizeof next->text, "%s: interrupted: %s%s\n", speaker, first, hint);
    if (file) snprintf(next->file, sizeof next->file, "%s", file);
    if (folder) snprintf(next->folder, sizeof next->folder, "%s", folder);
    current = next;
}

void pliant_interruption_wait(const char *hint)
{
    react(0, "finishing what is in hand (a second signal ends at once); ", hint, NULL, NULL);
}

void pliant_interruption_at_once(const char *hint, const char *file, const char *folder)
{
    react(1, "", hint, file, folder);
}

pliant_status pliant_interruption_check(pliant_error *err)
{
    if (!received) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_IO, "interrupted");
}

PetscErrorCode pliant_interruption_agree(MPI_Comm comm, int *number)
{
    PetscFunctionBegin;
    int mine = received;
    PetscCallMPI(MPI_Allreduce(&mine, number, 1, MPI_INT, MPI_MAX, comm));
    PetscFunctionReturn(0);
}

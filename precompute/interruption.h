// interruption.h: Ctrl-C, SIGTERM and SIGUSR1: the run ends at the next good place, whole.
//
// A signal is told of at once by the rank that speaks. Where work is in hand it is only remembered,
// and whoever works asks pliant_interruption_check now and then; the second signal ends the
// process. Where nothing can be lost (pliant_interruption_at_once) the first one does. A disk
// limit's SIGXFSZ is ignored, so that a write says what is wrong.
#pragma once

#include "pliant/base.h"

#include <petscsys.h>

// Once per process, after PetscInitialize, which has handlers of its own. `program` begins
// messages; NULL: this rank says nothing. Borrowed.
void pliant_interruption_install(const char *program);

// From here on a signal is remembered; `hint` (copied, cut at a few hundred bytes) ends what is
// said.
void pliant_interruption_wait(const char *hint);
// From here on a signal ends the process with exit status 128 + signal, after `hint` has been said
// and `file` has been removed, and with it `folder`; both copied, NULL: nothing.
void pliant_interruption_at_once(const char *hint, const char *file, const char *folder);

// PLIANT_ERR_IO with a text when this rank has had a signal.
PLIANT_UNUSED_RESULT pliant_status pliant_interruption_check(pliant_error *err);
// Collective: the signal that any rank has had, or 0.
PetscErrorCode pliant_interruption_agree(MPI_Comm comm, int *signal);

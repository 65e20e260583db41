// refusal.h: where a pliant_status becomes the program's answer, on every rank at once.
//
// Bad input on any rank has to end all of them, with one line and no trace. PliantCall lets the
// ranks agree on the worst status; the refusal then travels up as PLIANT_REFUSED, a PETSc error code
// that the program's error handler passes on in silence.
#pragma once

#include "pliant/base.h"

#include <petscsys.h>

#define PLIANT_REFUSED PETSC_ERR_MAX_VALUE

// Collective. Agree on the worst status of all ranks (lowest rank wins ties) and copy its text into
// everybody's `err`. Returns 0 or PLIANT_REFUSED.
PetscErrorCode pliant_refusal_agree(MPI_Comm comm, pliant_status status, pliant_error *err);

// Print traces of PETSc's own errors, but not of a refusal. Call once after PetscInitialize.
PetscErrorCode pliant_refusal_install(void);

// Collective: evaluate a call that returns pliant_status on every rank of comm.
#define PliantCall(comm, call, err) PetscCall(pliant_refusal_agree((comm), (call), (err)))

// refusal.c: where a pliant_status becomes the program's answer, on every rank at once.
#include "refusal.h"

PetscErrorCode pliant_refusal_agree(MPI_Comm comm, pliant_status status, pliant_error *err)
{
    PetscFunctionBegin;
    struct {
        int status, rank;
    } mine = {status < 0 ? (int)status : 0, 0}, worst;
    PetscCallMPI(MPI_Comm_rank(comm, &mine.rank));
    PetscCallMPI(MPI_Allreduce(&mine, &worst, 1, MPI_2INT, MPI_MINLOC, comm));
    if (worst.status == 0) PetscFunctionReturn(0);
    PetscCallMPI(MPI_Bcast(err->text, sizeof err->text, MPI_CHAR, worst.rank, comm));
    PetscFunctionReturn(PLIANT_REFUSED);
}

static PetscErrorCode pass_on(MPI_Comm comm, int line, const char *function, const char *file,
                              PetscErrorCode code, PetscErrorType type, const char *text,
                              void *context)
{
    if (code == PLIANT_REFUSED) return code;
    return PetscTraceBackErrorHandler(comm, line, function, file, code, type, text, context);
}

PetscErrorCode pliant_refusal_install(void)
{
    PetscFunctionBegin;
    PetscCall(PetscPushErrorHandler(pass_on, NULL));
    PetscFunctionReturn(0);
}

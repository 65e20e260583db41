// partial.h: what a run has finished, kept beside its output so that another run can go on from
// there.
//
// OUTPUT.partial holds a journal, which the first rank writes, and files of columns, one for each
// rank and each time the run was taken up. A batch of columns counts when the journal says so,
// which it does after the columns are on the disk: whatever moment a run is killed at, the journal
// is true.
#pragma once

#include "progress.h"
#include "stretches.h"

#include <petscsys.h>

typedef struct pliant_partial pliant_partial;

// What to do about an earlier run's partial data.
typedef enum pliant_partial_wish {
    PLIANT_PARTIAL_REFUSE,   // refuse when any column would be lost
    PLIANT_PARTIAL_DISCARD,  // --force
    PLIANT_PARTIAL_RESUME,   // --resume; nothing there: begin
} pliant_partial_wish;

typedef struct pliant_partial_def {
    const char *output;  // borrowed during create
    pliant_partial_wish wish;
    const char *identity;  // first rank: identity.h; borrowed during create
    int32_t row_limit;     // no column has more coefficients
    int32_t batch;         // columns solved for at once
    int32_t column_count[PLIANT_COLUMN_DOMAINS];
    int32_t domain[PLIANT_PARTIAL_STREAMS];  // of each stream; -1: not used
} pliant_partial_def;

// Collective: what is there is taken up or refused; nothing is solved yet. *partial is NULL when
// the ranks do not all see the output's folder: then nothing is kept (said to `progress`).
PetscErrorCode pliant_partial_create(MPI_Comm comm, const pliant_partial_def *def,
                                     pliant_progress *progress, pliant_partial **partial,
                                     pliant_error *err);
// Collective. What is kept stays, unless it is nothing: then the folder goes. NULL is fine.
PetscErrorCode pliant_partial_destroy(pliant_partial **partial);
// The output is there, or the columns are of no use: destroy takes the folder away.
void pliant_partial_finish(pliant_partial *partial);

// Everything was solved already: no system is needed.
int pliant_partial_is_whole(const pliant_partial *partial);
// Created, not refused.
int pliant_partial_is_taken_up(const pliant_partial *partial);
// Anything to resume from, as far as the journal says now?
int pliant_partial_is_kept(const pliant_partial *partial);
// Columns of a domain that are there: 0 .. done - 1, whole batches, or all.
int32_t pliant_partial_done(const pliant_partial *partial, pliant_column_domain domain);
// A column that was there at create; 0: none. Borrowed until destroy.
int pliant_partial_find(const pliant_partial *partial, int32_t stream, int32_t column,
                        pliant_spooled *found);
double pliant_partial_residual(const pliant_partial *partial);  // the largest of all batches so far
const char *pliant_partial_folder(const pliant_partial *partial);
const char *pliant_partial_journal(const pliant_partial *partial);  // path
double pliant_partial_bytes(const pliant_partial *partial);  // of columns, of all ranks, at create

// Collective: make the files that columns go to from now on.
PetscErrorCode pliant_partial_begin(pliant_partial *partial, pliant_error *err);
// This rank's, after begin: borrowed until destroy.
pliant_column_file *pliant_partial_file(const pliant_partial *partial);
// Collective: the columns up to `done` of a domain are in their files. From time to time, and when
// the run is interrupted (then it returns PLIANT_REFUSED), and when all are done, the journal says
// so.
PetscErrorCode pliant_partial_advance(pliant_partial *partial, pliant_column_domain domain,
                                      int32_t done, double residual, pliant_error *err);

// Gravity's columns: `count` numbers, the same on every rank. Collective.
PetscErrorCode pliant_partial_store_gravity(pliant_partial *partial, const float *values,
                                            size_t count, pliant_error *err);
// 1 when an earlier run has stored them; every rank gets them.
int pliant_partial_gravity(const pliant_partial *partial, float *values, size_t count);

// First rank: the file at `path` is whole and will get the output's name now.
PLIANT_UNUSED_RESULT pliant_status pliant_partial_name(pliant_partial *partial, const char *path,
                                                       pliant_error *err);
// First rank, before anything else: an output stands under its name; is it what an interrupted run
// had finished and only not cleaned up after? Then that is done here and 1 returned.
int pliant_partial_was_finished(const char *output);

// "640 of 2137 columns are kept: ..."; borrowed until the next call.
const char *pliant_partial_text(pliant_partial *partial);

// lattice_check.h: is the /lattice of a model file one that the runtime may trust?
#pragma once

#include "pliant/model_view.h"

// Check the contents of a view's lattice sections, whose shapes are right: every order, index and
// number that formats/README.md promises, in time linear in them. Fills `dims` with the largest
// particle coordinates + 1. `name` is the file's, for messages.
PLIANT_UNUSED_RESULT pliant_status pliant_lattice_check(const char *name,
                                                        const pliant_model_view *view,
                                                        int32_t dims[3], pliant_error *err);

// gmsh_library.h: the functions of gmsh that are used, bound when they are first needed.
//
// libgmsh brings ninety libraries along (windows, CAD kernels) that take 0.1 s of every start; so
// it is opened only by runs that need a mesher. One at a time in a process, as gmsh's own state is
// global.
#pragma once

#include "pliant/base.h"

#ifndef PLIANT_WITHOUT_FEM
#include <gmshc.h>

// clang-format off
#define PLIANT_GMSH_FUNCTIONS(X) \
    X(gmshInitialize) X(gmshFinalize) X(gmshFree) X(gmshOpen) X(gmshClear) X(gmshOptionSetNumber) \
    X(gmshModelAdd) X(gmshModelGetEntities) X(gmshModelGetPhysicalGroups) \
    X(gmshModelGetPhysicalGroupsForEntity) X(gmshModelGetPhysicalName) X(gmshModelAddDiscreteEntity) \
    X(gmshModelMeshGenerate) X(gmshModelMeshSetSizeCallback) X(gmshModelMeshRemoveSizeCallback) \
    X(gmshModelMeshAddNodes) X(gmshModelMeshGetNodes) \
    X(gmshModelMeshAddElementsByType) X(gmshModelMeshGetElementTypes) X(gmshModelMeshGetElementsByType) \
    X(gmshModelGeoAddSurfaceLoop) X(gmshModelGeoAddVolume) X(gmshModelGeoSynchronize) \
    X(gmshLoggerGetLastError)
// clang-format on

typedef struct pliant_gmsh_library {
    void *handle;
#define PLIANT_GMSH_MEMBER(name) __typeof__(name) *name;
    PLIANT_GMSH_FUNCTIONS(PLIANT_GMSH_MEMBER)
#undef PLIANT_GMSH_MEMBER
} pliant_gmsh_library;

// Open and initialize, silent, on one thread; PLIANT_ERR_MISSING when the library is not there.
PLIANT_UNUSED_RESULT pliant_status pliant_gmsh_library_open(pliant_gmsh_library *gmsh,
                                                            pliant_error *err);
void pliant_gmsh_library_close(pliant_gmsh_library *gmsh);
// The last error's text in `text`, one line; "no reason given" when there is none.
void pliant_gmsh_library_reason(const pliant_gmsh_library *gmsh, char *text, size_t size);
#endif

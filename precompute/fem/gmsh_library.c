// gmsh_library.c: the functions of gmsh that are used, bound when they are first needed.
#include "fem/gmsh_library.h"

#include "pliant/error.h"

#include <dlfcn.h>
#include <stdio.h>
#include <string.h>

#ifdef PLIANT_WITHOUT_FEM
typedef int pliant_gmsh_library_absent;
#else

#define TEXT_OF(x) #x
#define TEXT(x)    TEXT_OF(x)
static const char file_name[] =
    "libgmsh.so." TEXT(GMSH_API_VERSION_MAJOR) "." TEXT(GMSH_API_VERSION_MINOR);

pliant_status pliant_gmsh_library_open(pliant_gmsh_library *gmsh, pliant_error *err)
{
    *gmsh = (pliant_gmsh_library){.handle = dlopen(file_name, RTLD_NOW | RTLD_LOCAL)};
    if (!gmsh->handle)
        return pliant_error_set(err, PLIANT_ERR_MISSING,
                                "%s: cannot be opened (%.200s): install it, or use --method bem",
                                file_name, dlerror());
#define BIND(name)                                                                                 \
    {                                                                                              \
        void *symbol = dlsym(gmsh->handle, #name);                                                 \
        if (!symbol) {                                                                             \
            dlclose(gmsh->handle);                                                                 \
            return pliant_error_set(err, PLIANT_ERR_MISSING, "%s: has no %s", file_name, #name);   \
        }                                                                                          \
        memcpy(&gmsh->name, &symbol, sizeof symbol);                                               \
    }
    PLIANT_GMSH_FUNCTIONS(BIND)
#undef BIND
    int code;
    gmsh->gmshInitialize(0, NULL, 0, &code);
    gmsh->gmshOptionSetNumber("General.Terminal", 0, &code);
    // More threads make other meshes.
    gmsh->gmshOptionSetNumber("General.NumThreads", 1, &code);
    // Nodes keep the numbers that they were given.
    gmsh->gmshOptionSetNumber("Mesh.Renumber", 0, &code);
    return PLIANT_OK;
}

void pliant_gmsh_library_close(pliant_gmsh_library *gmsh)
{
    if (!gmsh->handle) return;
    int code;
    gmsh->gmshFinalize(&code);
    // The library stays: unloading what its own libraries registered at exit is unsafe.
    gmsh->handle = NULL;
}

void pliant_gmsh_library_reason(const pliant_gmsh_library *gmsh, char *text, size_t size)
{
    char *reason = NULL;
    int code = 1;
    gmsh->gmshLoggerGetLastError(&reason, &code);
    snprintf(text, size, "%s", reason && *reason ? reason : "no reason given");
    text[strcspn(text, "\n")] = 0;
    if (reason) gmsh->gmshFree(reason);
}
#endif

# Pliant. One Makefile, everything under build/. `make help` lists the targets.
#
# The include path is the permission: each module compiles with only the -I it may use, so an
# include against the arrows of README.md does not compile.

BUILD  ?= release
PREFIX ?= /usr/local
T      ?= *
OUT    := $(if $(filter release,$(BUILD)),build,build/$(BUILD))
OBJ    := $(OUT)/obj
.DEFAULT_GOAL := all
MAKEFLAGS += --no-builtin-rules
.SUFFIXES:
.SECONDARY:
.DELETE_ON_ERROR:

REVISION := $(shell git describe --always --dirty 2>/dev/null || echo unknown)
VERSION := $(shell sed -n 's/^.define PLIANT_VERSION_TEXT *"\(.*\)"/\1/p' common/include/pliant/base.h)

# ---- Tools and packages ----

CC       ?= cc
PKG      := pkg-config
have      = $(shell $(PKG) --exists $(1) 2>/dev/null && echo yes)
HAVE_HDF5   := $(call have,hdf5-serial)
HAVE_PETSC  := $(and $(call have,petsc),$(call have,ompi-c),$(call have,hdf5-openmpi),$(call have,assimp),yes)
HAVE_PNG    := $(call have,libpng)
# Without .pc files: does their header compile?
HAVE_FEM    := $(and $(HAVE_PETSC),$(shell printf '\043include <gmshc.h>\n\043include <metis.h>\n' | $(CC) -fsyntax-only -x c - 2>/dev/null && echo yes))
HAVE_CMOCKA := $(call have,cmocka)

WARNINGS := -Wall -Wextra -Wpedantic -Wshadow -Wstrict-prototypes -Wmissing-prototypes
# No errno from libm and no floating-point traps: both only stop vectorisation. Results stay IEEE.
MATHS    := -fno-math-errno -fno-trapping-math
FLAVOUR_release := -O3 -DNDEBUG
FLAVOUR_debug   := -O0 -g
FLAVOUR_asan    := -O1 -g -fsanitize=address,undefined -fno-omit-frame-pointer -fno-sanitize-recover=undefined
FLAVOUR_tsan    := -O1 -g -fsanitize=thread
FLAVOUR  := $(or $(FLAVOUR_$(BUILD)),$(error BUILD=$(BUILD): choose release, debug, asan or tsan))
CFLAGS   ?=
ALL_CFLAGS := -std=c11 -D_GNU_SOURCE $(WARNINGS) $(MATHS) $(FLAVOUR) -fPIC -fvisibility=hidden $(CFLAGS)
LINK     := $(filter -fsanitize=%,$(FLAVOUR)) -Wl,--as-needed $(LDFLAGS)

HDF5_CFLAGS  := $(if $(HAVE_HDF5),$(shell $(PKG) --cflags hdf5-serial),-DPLIANT_WITHOUT_HDF5)
HDF5_LIBS    := $(if $(HAVE_HDF5),$(shell $(PKG) --libs hdf5-serial))
PETSC_CFLAGS := $(if $(HAVE_PETSC),$(patsubst -I%,-isystem %,$(shell $(PKG) --cflags petsc ompi-c)))
PETSC_LIBS   := $(if $(HAVE_PETSC),$(shell $(PKG) --libs petsc ompi-c hdf5-openmpi))
MPI_LIBS     := $(if $(HAVE_PETSC),$(shell $(PKG) --libs ompi-c))
PHDF5_CFLAGS := $(if $(HAVE_PETSC),$(patsubst -I%,-isystem %,$(shell $(PKG) --cflags hdf5-openmpi)))
ASSIMP_CFLAGS := $(if $(HAVE_PETSC),$(patsubst -I%,-isystem %,$(shell $(PKG) --cflags assimp)))
ASSIMP_LIBS  := $(if $(HAVE_PETSC),$(shell $(PKG) --libs assimp))
FEM_CFLAGS   := $(if $(HAVE_FEM),,-DPLIANT_WITHOUT_FEM)
FEM_LIBS     := $(if $(HAVE_FEM),-lmetis -ldl)
PNG_CFLAGS   := $(if $(HAVE_PNG),$(shell $(PKG) --cflags libpng))
PNG_LIBS     := $(if $(HAVE_PNG),$(shell $(PKG) --libs libpng))
CMOCKA_LIBS  := $(if $(HAVE_CMOCKA),$(shell $(PKG) --libs cmocka))
LAPACK_LIBS  := -llapack -lblas

# ---- What each module may see ----

I_common     := -Icommon/include -Icommon
I_formats    := -Icommon/include -Iformats/include -Iformats
I_precompute := -Icommon/include -Iformats/include -Iprecompute
I_runtime    := -Icommon/include -Iformats/include -Iruntime/include -Iruntime -Iruntime/play
I_examples   := -Icommon/include -Iruntime/include
I_tests      := -Icommon/include -Iformats/include -Iruntime/include -Iprecompute -Iruntime -Iruntime/play -Icommon -Iformats -Itests/support

SRC_common     := $(sort $(wildcard common/*.c))
SRC_formats    := $(sort $(filter-out %_hdf5.c,$(wildcard formats/*.c)))
SRC_hdf5       := $(sort $(wildcard formats/*_hdf5.c))
SRC_precompute := $(sort $(filter-out precompute/main.c,$(wildcard precompute/*.c precompute/*/*.c)))
SRC_runtime    := $(sort $(wildcard runtime/*.c runtime/lattice/*.c))
SRC_play       := $(sort $(filter-out runtime/play/main.c,$(wildcard runtime/play/*.c)))
SRC_info       := $(sort $(filter-out runtime/info/main.c,$(wildcard runtime/info/*.c)))
SRC_draw       := $(sort $(filter-out runtime/draw/main.c,$(wildcard runtime/draw/*.c)))
SRC_examples   := $(sort $(wildcard runtime/examples/*.c))
SRC_support    := $(sort $(wildcard tests/support/*.c))
objects = $(patsubst %.c,$(OBJ)/%.o,$(1))

LIB_common     := $(OBJ)/libcommon.a
LIB_formats    := $(OBJ)/libformats.a
LIB_hdf5       := $(OBJ)/libformats_hdf5.a
LIB_phdf5      := $(OBJ)/libformats_phdf5.a
LIB_precompute := $(OBJ)/libprecompute.a
LIB_play       := $(OBJ)/libplay.a
LIB_info       := $(OBJ)/libinfo.a
LIB_draw       := $(OBJ)/libdraw.a
LIB_support    := $(OBJ)/libsupport.a
LIB_pliant     := $(OUT)/libpliant.a
SO_pliant      := $(OUT)/libpliant.so.$(VERSION)
# Before 1.0 a minor version may change the interface.
SONAME         := libpliant.so.$(if $(filter 0.%,$(VERSION)),0.$(word 2,$(subst ., ,$(VERSION))),$(firstword $(subst ., ,$(VERSION))))

PROGRAMS := $(OUT)/pliant-play $(OUT)/pliant-info
SKIPPED  :=
ifeq ($(HAVE_PETSC),yes)
PROGRAMS += $(OUT)/pliant-precompute
else
SKIPPED += pliant-precompute(needs petsc-dev libopenmpi-dev libhdf5-openmpi-dev libassimp-dev)
endif
ifeq ($(HAVE_PETSC)$(HAVE_FEM),yes)
SKIPPED += pliant-precompute--method-fem(needs libgmsh-dev libmetis-dev)
endif
ifeq ($(HAVE_PNG),yes)
PROGRAMS += $(OUT)/pliant-draw
else
SKIPPED += pliant-draw(needs libpng-dev)
endif
ifneq ($(HAVE_HDF5),yes)
SKIPPED += pliant-play--frames(needs libhdf5-dev)
endif

# ---- Targets ----

EXAMPLES := $(patsubst runtime/examples/%.c,$(OUT)/examples/%,$(SRC_examples))

all: $(PROGRAMS) $(EXAMPLES) $(SO_pliant) $(LIB_pliant)  ## build what this machine can, say what was skipped
	@$(if $(strip $(SKIPPED)),echo "skipped: $(SKIPPED)",:)

runtime: $(OUT)/pliant-play $(OUT)/pliant-info $(SO_pliant) $(LIB_pliant)  ## the runtime alone: a C compiler, and LAPACK for the player

help:  ## this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1|\2/p' $(MAKEFILE_LIST) | sed "s/|/  \t/"

configure:  ## what was found on this machine
	@echo "compiler   $(CC)  $(shell $(CC) --version | head -1)"
	@echo "flavour    BUILD=$(BUILD) -> $(OUT)"
	@echo "hdf5       $(or $(HAVE_HDF5),no)"
	@echo "petsc etc. $(or $(HAVE_PETSC),no)"
	@echo "gmsh metis $(or $(HAVE_FEM),no)"
	@echo "libpng     $(or $(HAVE_PNG),no)"
	@echo "cmocka     $(or $(HAVE_CMOCKA),no)"

print-%:  ## print-VAR prints a variable of the Makefile
	@echo '$* = $($*)'

clean:  ## remove build/
	rm -rf build

# ---- Compile: flags are a prerequisite, so changed flags rebuild ----

FLAGS_STAMP := $(OBJ)/flags
FLAGS_TEXT  := $(CC) $(ALL_CFLAGS) $(HDF5_CFLAGS) $(PETSC_CFLAGS) $(FEM_CFLAGS)
$(shell mkdir -p $(OBJ); printf '%s\n' '$(FLAGS_TEXT)' | cmp -s - $(FLAGS_STAMP) || printf '%s\n' '$(FLAGS_TEXT)' > $(FLAGS_STAMP))

# The revision goes into files: a new one recompiles its only user.
REVISION_STAMP := $(OBJ)/revision
$(shell printf '%s\n' '$(REVISION)' | cmp -s - $(REVISION_STAMP) || printf '%s\n' '$(REVISION)' > $(REVISION_STAMP))

compile = @mkdir -p $(@D); $(if $(V),,echo "  cc   $<";) $(CC) $(ALL_CFLAGS) $(1) -MMD -MP -c $< -o $@

$(OBJ)/common/%.o: common/%.c $(FLAGS_STAMP)
	$(call compile,$(I_common))
$(OBJ)/formats/%_hdf5.o: formats/%_hdf5.c $(FLAGS_STAMP)
	$(call compile,$(I_formats) $(HDF5_CFLAGS))
$(OBJ)/formats/%_phdf5.o: formats/%_hdf5.c $(FLAGS_STAMP)
	$(call compile,$(I_formats) $(PHDF5_CFLAGS))
$(OBJ)/formats/%.o: formats/%.c $(FLAGS_STAMP)
	$(call compile,$(I_formats))
$(OBJ)/precompute/mesh/%.o: precompute/mesh/%.c $(FLAGS_STAMP)
	$(call compile,$(I_precompute) $(ASSIMP_CFLAGS))
$(OBJ)/precompute/bem/%.o: precompute/bem/%.c $(FLAGS_STAMP)
	$(call compile,$(I_precompute))
$(OBJ)/precompute/remesh/%.o: precompute/remesh/%.c $(FLAGS_STAMP)
	$(call compile,$(I_precompute))
$(OBJ)/precompute/lattice/%.o: precompute/lattice/%.c $(FLAGS_STAMP)
	$(call compile,$(I_precompute))
$(OBJ)/precompute/fem/%.o: precompute/fem/%.c $(FLAGS_STAMP)
	$(call compile,$(I_precompute) $(PETSC_CFLAGS) $(FEM_CFLAGS))
$(OBJ)/precompute/provenance.o: precompute/provenance.c $(FLAGS_STAMP) $(REVISION_STAMP)
	$(call compile,$(I_precompute) $(PETSC_CFLAGS) $(PHDF5_CFLAGS) -DPLIANT_REVISION='"$(REVISION)"')
$(OBJ)/precompute/%.o: precompute/%.c $(FLAGS_STAMP)
	$(call compile,$(I_precompute) $(PETSC_CFLAGS))
$(OBJ)/runtime/draw/%.o: runtime/draw/%.c $(FLAGS_STAMP)
	$(call compile,$(I_runtime) $(PNG_CFLAGS))
$(OBJ)/runtime/examples/%.o: runtime/examples/%.c $(FLAGS_STAMP)
	$(call compile,$(I_examples))
$(OBJ)/runtime/%.o: runtime/%.c $(FLAGS_STAMP)
	$(call compile,$(I_runtime) $(if $(HAVE_HDF5),,-DPLIANT_WITHOUT_HDF5))
$(OBJ)/tests/precompute/%.o: tests/precompute/%.c $(FLAGS_STAMP)
	$(call compile,$(I_tests) $(PETSC_CFLAGS))
$(OBJ)/tests/bench/bench_levels.o: tests/bench/bench_levels.c $(FLAGS_STAMP)
	$(call compile,$(I_tests) $(PETSC_CFLAGS))
$(OBJ)/tests/%.o: tests/%.c $(FLAGS_STAMP)
	$(call compile,$(I_tests) $(HDF5_CFLAGS))

archive = @rm -f $@; mkdir -p $(@D); ar rcs $@ $^
$(LIB_common): $(call objects,$(SRC_common))
	$(archive)
$(LIB_formats): $(call objects,$(SRC_formats))
	$(archive)
$(LIB_hdf5): $(call objects,$(if $(HAVE_HDF5),$(SRC_hdf5)))
	$(archive)
$(LIB_phdf5): $(patsubst %_hdf5.c,$(OBJ)/%_phdf5.o,$(SRC_hdf5))
	$(archive)
$(LIB_precompute): $(call objects,$(SRC_precompute))
	$(archive)
$(LIB_play): $(call objects,$(SRC_play))
	$(archive)
$(LIB_info): $(call objects,$(SRC_info))
	$(archive)
$(LIB_draw): $(call objects,$(SRC_draw))
	$(archive)
$(LIB_support): $(call objects,$(SRC_support))
	$(archive)
$(LIB_pliant): $(call objects,$(SRC_runtime) $(SRC_common) $(SRC_formats))
	$(archive)

# libpliant links whole (-z defs) against all it may know: a stray H5Dopen does not link.
$(SO_pliant): $(call objects,$(SRC_runtime) $(SRC_common) $(SRC_formats)) | runtime/libpliant.map
	@echo "  link $@"; $(CC) $(LINK) -shared -Wl,-soname,$(SONAME) -Wl,--version-script=runtime/libpliant.map $(if $(filter -fsanitize=%,$(FLAVOUR)),,-Wl,-z,defs) -o $@ $^ -lm -lpthread
	@ln -sf libpliant.so.$(VERSION) $(OUT)/$(SONAME); ln -sf $(SONAME) $(OUT)/libpliant.so

program = @mkdir -p $(@D); echo "  link $@"; $(CC) $(LINK) -o $@ $(filter %.o %.a,$^)
$(OUT)/pliant-precompute: $(OBJ)/precompute/main.o $(LIB_precompute) $(LIB_phdf5) $(LIB_formats) $(LIB_common)
	$(program) $(ASSIMP_LIBS) $(FEM_LIBS) $(PETSC_LIBS) $(LAPACK_LIBS) -lm
$(OUT)/pliant-play: $(OBJ)/runtime/play/main.o $(LIB_play) $(LIB_pliant) $(LIB_hdf5) $(LIB_formats) $(LIB_common)
	$(program) $(HDF5_LIBS) $(LAPACK_LIBS) -lm -lpthread
$(OUT)/pliant-info: $(OBJ)/runtime/info/main.o $(LIB_info) $(LIB_pliant)
	$(program) -lm -lpthread
$(OUT)/pliant-draw: $(OBJ)/runtime/draw/main.o $(LIB_draw) $(LIB_play) $(LIB_pliant) $(LIB_hdf5) $(LIB_formats) $(LIB_common)
	$(program) $(HDF5_LIBS) $(PNG_LIBS) $(LAPACK_LIBS) -lm -lpthread
# Examples see what a user sees: the public headers and the library.
$(OUT)/examples/%: $(OBJ)/runtime/examples/%.o $(LIB_pliant)
	$(program) -lm -lpthread

# ---- Tests, benchmarks, fuzzers ----

# The longest first: they run side by side. The paper-sized models are for the release alone: under a
# sanitizer they take a quarter of an hour and see nothing that test_compression does not.
LONG_TESTS := $(wildcard $(if $(filter release,$(BUILD)),tests/precompute/test_models.c) tests/programs/test_*.c)
TEST_SRC  := $(LONG_TESTS) $(filter-out $(LONG_TESTS) tests/precompute/test_models.c,$(sort $(wildcard tests/common/test_*.c tests/formats/test_*.c tests/runtime/test_*.c tests/lattice/test_*.c tests/precompute/test_*.c)))
ifneq ($(HAVE_PETSC),yes)
TEST_SRC  := $(filter-out tests/precompute/% tests/programs/%,$(TEST_SRC))
endif
# The thread sanitizer sees races in MPI's and PETSc's own libraries, which are not built for it.
ifeq ($(BUILD),tsan)
TEST_SRC  := $(filter-out tests/precompute/% tests/programs/%,$(TEST_SRC))
endif
ifneq ($(HAVE_FEM),yes)
TEST_SRC  := $(filter-out tests/precompute/test_fem_% $(addprefix tests/programs/test_,precompute_fem.c groups.c cluster.c),$(TEST_SRC))
endif
ifneq ($(HAVE_PNG),yes)
TEST_SRC  := $(filter-out $(addprefix tests/runtime/test_,draw.c raster.c camera.c colour_map.c) tests/lattice/test_scene_drawing.c,$(TEST_SRC))
endif
TESTS     := $(patsubst tests/%.c,$(OUT)/tests/%,$(filter $(wildcard tests/*/test_$(T).c),$(TEST_SRC)))
BENCH_SRC := $(sort $(wildcard tests/bench/bench_*.c))
ifneq ($(HAVE_PETSC),yes)
BENCH_SRC := $(filter-out tests/bench/bench_bem.c tests/bench/bench_levels.c tests/bench/bench_precompute.c,$(BENCH_SRC))
endif
BENCHES   := $(patsubst tests/%.c,$(OUT)/tests/%,$(BENCH_SRC))

TEST_LIBS := $(LIB_support) $(if $(HAVE_PNG),$(LIB_draw)) $(LIB_play) $(LIB_info) $(LIB_pliant) $(LIB_hdf5) $(LIB_formats) $(LIB_common)
$(OUT)/tests/precompute/%: $(OBJ)/tests/precompute/%.o $(LIB_support) $(LIB_precompute) $(LIB_pliant) $(LIB_phdf5) $(LIB_formats) $(LIB_common)
	$(program) $(CMOCKA_LIBS) $(ASSIMP_LIBS) $(FEM_LIBS) $(PETSC_LIBS) $(LAPACK_LIBS) -lm -lpthread
$(OUT)/tests/bench/%: $(OBJ)/tests/bench/%.o $(LIB_support) $(if $(HAVE_PETSC),$(LIB_precompute)) $(LIB_pliant) $(LIB_hdf5) $(LIB_formats) $(LIB_common)
	$(program) $(CMOCKA_LIBS) $(HDF5_LIBS) $(ASSIMP_LIBS) $(MPI_LIBS) $(LAPACK_LIBS) -lm -lpthread
$(OUT)/tests/%: $(OBJ)/tests/%.o $(TEST_LIBS)
	$(program) $(CMOCKA_LIBS) $(HDF5_LIBS) $(PNG_LIBS) $(LAPACK_LIBS) -lm -lpthread

tests: $(TESTS) $(BENCHES)  ## build the tests and the benchmarks
check: $(PROGRAMS) $(EXAMPLES) $(TESTS)  ## run the tests; T=pattern chooses (make check T=wavelet)
	@$(if $(HAVE_CMOCKA),:,echo "tests need libcmocka-dev"; exit 1)
	@PLIANT_BUILD=$(OUT) scripts/run-tests $(TESTS)
# The sample at RMS 5%, MAX 11%, with the default wavelets and without their update.
SAMPLE       := scripts/sample/whale.obj --subdivide 4 --fixed 'z<0.027' --young 50000 --poisson 0.4 --density 1000
BENCH_MODELS := $(if $(HAVE_PETSC),$(OUT)/bench/sample-rms5.h5 $(OUT)/bench/sample-rms5-unlifted.h5)
$(OUT)/bench/sample-rms5-unlifted.h5: WAVELET := --no-lift
# The same body on 642 vertices, with 40962 of detail; the last --subdivide holds.
DETAIL_MODEL := $(if $(HAVE_PETSC),$(OUT)/bench/sample-detail.h5)
$(DETAIL_MODEL): MORE := --subdivide 6 --detail 3
$(OUT)/bench/%.h5: $(OUT)/pliant-precompute
	@mkdir -p $(@D); echo "  precompute $@"; . scripts/environment; \
	    mpirun --quiet -n 2 $< -q --force --rms 0.05 --max 0.11 $(WAVELET) $(SAMPLE) $(MORE) -o $@
bench: $(PROGRAMS) $(BENCHES) $(BENCH_MODELS) $(DETAIL_MODEL)  ## run the benchmarks: figures against baselines measured in the same run
	@. scripts/environment; for b in $(BENCHES); do echo "== $${b##*/}"; \
	    case $$b in */bench_solver | */bench_contact | */bench_hierarchy | */bench_patch | */bench_tool | */bench_haptic) models="$(BENCH_MODELS)";; \
	        */bench_detail) models="$(DETAIL_MODEL)";; *) models="";; esac; \
	    PLIANT_BUILD=$(OUT) $$b $$models || exit 1; done
# What a step of a lattice body costs; the cost against the half-width (LSM, Figure 4), drawn.
FIGURES := runtime/lattice/figures
bench-lattice: $(OUT)/tests/bench/bench_lattice $(OUT)/tests/bench/bench_width  ## measure lattice bodies and draw their cost again, 3 minutes
	@$(OUT)/tests/bench/bench_lattice
	@mkdir -p $(FIGURES); $(OUT)/tests/bench/bench_width $(FIGURES)/width.csv
	@scripts/plot-fastlsm $(FIGURES)/width.csv > $(FIGURES)/width.svg
# Where precompute's time goes, and what a column costs against the number of vertices, drawn.
bench-phases: $(OUT)/pliant-precompute  ## measure precompute's phases, scaling and libraries' share, 6 minutes
	@scripts/phases 4 precompute/figures/columns.csv
	@scripts/plot-phases precompute/figures/columns.csv > precompute/figures/columns.svg

# libFuzzer needs clang; everything the target needs is compiled with the sanitizers.
FUZZ_SECONDS ?= 60
FUZZ_SRC     := $(sort $(wildcard tests/fuzz/fuzz_*.c))
FUZZERS      := $(patsubst tests/fuzz/%.c,build/fuzz/%,$(FUZZ_SRC))
build/fuzz/%: tests/fuzz/%.c $(SRC_common) $(SRC_formats) $(SRC_runtime) $(wildcard */include/pliant/*.h formats/*.h runtime/*.h runtime/lattice/*.h)
	@mkdir -p $(@D); echo "  fuzz $@"
	@clang -std=c11 -D_GNU_SOURCE -g -O1 -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=undefined $(MATHS) $(I_tests) $< $(SRC_common) $(SRC_formats) $(SRC_runtime) -o $@ $(LAPACK_LIBS) -lm -lpthread
fuzzers: $(FUZZERS)  ## build the fuzzers
fuzz: $(FUZZERS)  ## run every fuzzer for FUZZ_SECONDS (60)
	@for f in $(FUZZERS); do scripts/run-fuzzer $$f $(FUZZ_SECONDS) || exit 1; done

# ---- Checks on the source, installation ----

HEADERS := $(wildcard */include/pliant/*.h)
headers:  ## every public or cross-module header compiles alone, as C11 and as C++17
	@for h in $(HEADERS); do \
	    $(CC) -std=c11 $(WARNINGS) -Icommon/include -Iformats/include -Iruntime/include -fsyntax-only -x c $$h -Wno-pragma-once-outside-header || exit 1; \
	    $(CXX) -std=c++17 -Wall -Wextra -Icommon/include -Iformats/include -Iruntime/include -fsyntax-only -x c++ $$h -Wno-pragma-once-outside-header || exit 1; \
	done 2>&1 | grep -v 'pragma once in main file' | grep -E 'error' && exit 1 || echo "headers: $(words $(HEADERS)) compile alone"
layers: $(SO_pliant)  ## libpliant depends on nothing it may not know
	@if ldd $(SO_pliant) | grep -E 'hdf5|petsc|mpi'; then echo "layers: libpliant links too much"; exit 1; fi
	@if grep -nE '#include .*(hdf5|petsc|mpi)\.h' common/*.c runtime/*.c runtime/*/*.c formats/*[!5].c 2>/dev/null; then echo "layers: an include points the wrong way"; exit 1; fi
	@echo "layers: libpliant depends on: $$(ldd $(SO_pliant) | awk '{print $$1}' | sed 's/.*\///' | paste -sd' ')"
format:  ## rewrite the sources with clang-format
	clang-format -i $(shell git ls-files '*.c' '*.h')

# Made anew each time: PREFIX is not in a file's date.
$(OUT)/pliant.pc: always
	@mkdir -p $(@D); printf '%s\n' 'prefix=$(PREFIX)' 'libdir=$${prefix}/lib' 'includedir=$${prefix}/include' '' \
	 'Name: pliant' 'Description: precomputed elastic solids in real time' 'Version: $(VERSION)' \
	 'Cflags: -I$${includedir}' 'Libs: -L$${libdir} -lpliant' 'Libs.private: -lm -lpthread' > $@

install: all $(OUT)/pliant.pc  ## install under PREFIX (/usr/local), staged by DESTDIR
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/lib/pkgconfig $(DESTDIR)$(PREFIX)/include/pliant
	install -m 755 $(PROGRAMS) $(DESTDIR)$(PREFIX)/bin
	install -m 644 $(LIB_pliant) $(DESTDIR)$(PREFIX)/lib
	install -m 755 $(SO_pliant) $(DESTDIR)$(PREFIX)/lib
	ln -sf libpliant.so.$(VERSION) $(DESTDIR)$(PREFIX)/lib/$(SONAME)
	ln -sf $(SONAME) $(DESTDIR)$(PREFIX)/lib/libpliant.so
	install -m 644 common/include/pliant/base.h runtime/include/pliant/pliant.h $(DESTDIR)$(PREFIX)/include/pliant
	install -m 644 $(OUT)/pliant.pc $(DESTDIR)$(PREFIX)/lib/pkgconfig

.PHONY: always all runtime help configure clean tests check bench bench-lattice bench-phases fuzz fuzzers headers layers format install
-include $(shell find $(OBJ) -name '*.d' 2>/dev/null)

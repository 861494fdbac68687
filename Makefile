# millsim: `make` builds ./millsim and ./mill, `make help` lists every target. Those not here are in tools/make.
MODE ?= release
BUILD := build/$(MODE)
CC ?= cc
PREFIX ?= /usr/local
JOBS ?= $(shell nproc 2>/dev/null || echo 2)
PARALLEL := --no-print-directory -j$(JOBS)
Q = $(if $(V),,@echo "  $(MODE) $(notdir $@)"; )
# tests start hundreds of Python processes: none of them compiles the libraries again
unexport PYTHONDONTWRITEBYTECODE

# ---- flags; those of other builds (MODE=asan, o2, ...) are in modes.mk ----
# assertions are for the tests under sanitizers and for `make golden`
CFLAGS_release := -O3 -g -DNDEBUG
CFLAGS_debug := -O0 -g
include tools/make/modes.mk
# other options of the compiler make it warn of what cannot be
WERROR_release := -Werror
WARN := -Wall -Wextra -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Wundef -Wvla \
        -Wdouble-promotion $(if $(WERROR),$(WERROR_$(MODE))) $(WARN_$(MODE))
# no contraction, no fast-math: the same deck gives the same bits
FLAGS := -std=c99 -D_POSIX_C_SOURCE=200809L -ffp-contract=off -fno-math-errno $(CFLAGS_$(MODE)) $(CFLAGS)
ALL_CFLAGS := $(FLAGS) $(WARN) -Iinclude -Isrc $(shell pkg-config --cflags gsl hdf5 2>/dev/null)
ALL_LDFLAGS := $(LDFLAGS_$(MODE)) $(LDFLAGS)
LDLIBS := $(shell pkg-config --libs gsl hdf5 2>/dev/null) -ludunits2 -lm -pthread
# a shared HDF5 loads 30 other libraries, for access to remote files: 6 ms of every start
LDLIBS_SMALL := $(patsubst -lhdf5,-l:libhdf5.a -lsz -lz -ldl,$(LDLIBS))

# ---- sources; src/web is the engine as a module for the studio ----
SOURCES := $(filter-out src/web/%,$(wildcard src/*/*.c))
LIB := $(filter-out $(BUILD)/src/app/main.o,$(SOURCES:%.c=$(BUILD)/%.o))
# libmillsim.a is the engine alone: what another program links, with no need of HDF5, UDUNITS or GSL
ENGINE := $(foreach f,base geometry engine start,$(filter $(BUILD)/src/$(f)/%,$(LIB)))
UNIT := $(patsubst %.c,$(BUILD)/%,$(wildcard tests/unit/test_*.c))

# ---- build ----
# The simulator is whole without Python, so packages for ./mill that cannot be had now are one line, not a failure;
# `make mill`, asked for by name, fails.
all: millsim ## build ./millsim, and ./mill with the Python packages of plot, report and compare in .venv
	@cp -f tools/mill.sh mill
	@tools/setup --local --python core share $(EXTRAS) || true

millsim: build/release/millsim ## build ./millsim alone (MODE=release|debug|o2|asan|tsan: build/MODE/millsim)
	@cp -f $< $@

mill: always ## build ./mill; EXTRAS="render study": with the packages of render, study, cluster, export, dem, mesh, contour; all
	@cp -f tools/mill.sh mill
	@tools/setup --local --python core share $(EXTRAS)

LINK = $(CC) $(ALL_LDFLAGS) -o $@ $^ $(LDLIBS_SMALL) 2>/dev/null || $(CC) $(ALL_LDFLAGS) -o $@ $^ $(LDLIBS)
ifneq ($(MODE),musl) # that one is linked from the objects of release: tests.mk
$(BUILD)/millsim: $(BUILD)/src/app/main.o $(LIB)
	$(Q)$(or $(LINK_$(MODE)),$(LINK))
endif

# ./millsim is the release build, whatever else is being built
ifneq ($(BUILD),build/release)
build/release/millsim: always
	@$(MAKE) $(PARALLEL) MODE=release BUILD=build/release $@
endif

$(BUILD)/libmillsim.a: $(ENGINE)
	$(Q)rm -f $@; ar rc $@ $^

$(BUILD)/tests/%: $(BUILD)/tests/%.o $(LIB)
	$(Q)$(CC) $(ALL_LDFLAGS) -o $@ $^ $(LDLIBS) $(shell pkg-config --libs check 2>/dev/null)

$(BUILD)/%.o: %.c $(BUILD)/flags | needed
	@mkdir -p $(@D)
	$(Q)$(CC) $(ALL_CFLAGS) $(DEFINES) -MMD -MP -c -o $@ $<

needed:
	@tools/setup --check build

# 1.0.0+g0123abc: the version and the commit, which a source archive knows from the file tools/commit
COMMIT := $(shell ([ -e .git ] && git describe --always --exclude '*' --dirty=.dirty 2>/dev/null) || \
    grep -x '[0-9a-f]*' tools/commit 2>/dev/null)
VERSION := $(shell cat VERSION)$(COMMIT:%=+g%)
# what a checkpoint is good for: the same sources, flags and compiler
BUILD_ID := $(shell (cat $(sort $(wildcard src/*/*.[ch] include/millsim/*.h)); echo '$(FLAGS)'; $(CC) --version) \
    2>/dev/null | (sha256sum 2>/dev/null || shasum -a 256) | cut -c1-16)
$(BUILD)/src/store/version.o: $(BUILD)/version
$(BUILD)/src/store/version.o: DEFINES = \
    '-DMILL_VERSION="$(VERSION)"' '-DMILL_FLAGS="$(FLAGS)"' '-DMILL_BUILD="$(BUILD_ID)"'

# rewritten only when they change, so that a change rebuilds what depends on it
$(BUILD)/flags: always
	@mkdir -p $(@D); echo '$(CC) $(ALL_CFLAGS)' | cmp -s - $@ || echo '$(CC) $(ALL_CFLAGS)' > $@
$(BUILD)/version: always
	@mkdir -p $(@D); echo '$(VERSION) $(BUILD_ID)' | cmp -s - $@ || echo '$(VERSION) $(BUILD_ID)' > $@

# ---- use; `make run` and `make test` install what a fresh machine lacks, by `make deps` ----
run: ## install what is missing, build, run the reference mill, write its report
	@$(MAKE) --no-print-directory deps PARTS=build
	@$(MAKE) --no-print-directory deps PARTS=python || true
	@$(MAKE) $(PARALLEL) all
	./millsim --force -o reference.h5 input/simoloyer.ini
	@./mill report reference.h5 || echo 'make run: no report, for the reason above; the run is whole, in reference.h5'

# T: files, of Python or tests/unit/test_*.c, tests/web/*.test.mjs; all of such a file is run, slow tests too
CHECKED := $(if $(T),$(filter tests/unit/%,$(T)),$(wildcard tests/unit/test_*.c))
JSTESTS := $(if $(T),$(filter tests/web/%,$(T)),$(wildcard tests/web/*.test.mjs))
PYTESTS := $(if $(T),$(filter-out tests/unit/% tests/web/%,$(T)),tests)
check: ## a minute of tests that need neither root nor other programs (T=FILE: all tests of a file)
	$(foreach file,$(CHECKED),$(if $(wildcard $(file)),,$(error $(file): no such test)))
	@tools/setup --local build test --python check study cluster export dem mesh contour
	@$(MAKE) $(PARALLEL) $(CHECKED:%.c=$(BUILD)/%) $(BUILD)/tests/bench/bench_engine $(BUILD)/millsim millsim
	@$(if $(T),,CK_EXCLUDE_TAGS=slow) $(MAKE) $(PARALLEL) --keep-going --output-sync=line $(if $(PYTESTS),check-python) \
	    $(patsubst tests/unit/test_%.c,unit-%,$(CHECKED)) $(if $(JSTESTS),check-js)

test: ## install what is missing, build, run every test (MODE=asan: under sanitizers; MARKS=1: measure marks)
	@$(MAKE) --no-print-directory deps PARTS='build python test dem slurm render pov browser node wasm'
	@tools/setup --local --python all check test
	@$(MAKE) $(PARALLEL) compiled mill
	@$(if $(filter release,$(MODE)),,CK_EXCLUDE_TAGS=slow) $(MAKE) $(PARALLEL) --output-sync=target unit
	@$(MAKE) --no-print-directory replay $(if $(filter release,$(MODE)),js) cli

# its own objects, or those of a checkout whose every file is compiled with WERROR=1
LINTED := build/$(if $(WERROR),release,lint)
C_FILES := $(wildcard src/*/*.[ch] include/millsim/*.h tests/*/*.[ch] validation/*/*.[ch] examples/*.c)
lint: ## formatting, floors, names, static checks
	@tools/setup --local build lint --python core lint
	clang-format-14 --dry-run -Werror $(C_FILES)
	tools/check-floors
	@$(MAKE) $(PARALLEL) BUILD=$(LINTED) WERROR=1 $(LINTED)/millsim && tools/check-names $(LINTED)/src/*/*.o
	cppcheck --quiet --error-exitcode=1 --std=c99 --inline-suppr --enable=warning,portability \
	    --suppress=normalCheckLevelMaxBranches -Iinclude -Isrc src
	git ls-files -z | xargs -0 codespell -q 3
	tools/check-links
	@$(MAKE) --no-print-directory lint-python lint-js

install: millsim build/release/libmillsim.a ## into PREFIX=/usr/local: programs, library, decks, man pages (MILL=no)
	@DESTDIR='$(DESTDIR)' MILL='$(MILL)' tools/install '$(PREFIX)' $(EXTRAS)

clean: ## remove what was built
	rm -rf build millsim mill tools/milltools/studio/studio.html

TASKS := $(patsubst %,tools/make/%.mk,packages pages measure tests)
help: ## this list
	@awk -F ':[^#]*## ' '/^[a-z-]+:.*## / { printf "make %-14s %s\n", $$1, $$2 }' Makefile $(TASKS)
	@echo 'With all: V=1 shows commands, WERROR=1 makes warnings errors, JOBS=$(JOBS) processes, MODE as for millsim'

include $(TASKS)
-include $(patsubst %.o,%.d,$(LIB)) $(BUILD)/src/app/main.d $(addsuffix .d,$(UNIT))
.SECONDARY:
.PHONY: all needed run check test lint install clean help always

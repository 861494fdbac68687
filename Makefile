# millsim: `make` builds ./millsim and ./mill, `make help` lists the rest.
MODE ?= release
BUILD := build/$(MODE)
WASM := build/wasm
ifeq ($(MODE),clang)
CC := clang-14
endif
CC ?= cc
PREFIX ?= /usr/local
FUZZ_SECONDS ?= 30
Q = $(if $(V),,@echo "  $(MODE) $(notdir $@)"; )
# tests start hundreds of Python processes: none of them compiles the libraries again
unexport PYTHONDONTWRITEBYTECODE
JOBS ?= $(shell nproc 2>/dev/null || echo 2)
PARALLEL := --no-print-directory -j$(JOBS)
# 1.0.0+g0123abc: the version and the commit; the source archive of a release knows its commit from the file tools/commit
COMMIT := $(shell ([ -e .git ] && git describe --always --exclude '*' --dirty=.dirty 2>/dev/null) || grep -x '[0-9a-f]*' tools/commit 2>/dev/null)
VERSION := $(shell cat VERSION)$(COMMIT:%=+g%)

# assertions are for the tests under sanitizers and for `make golden`
CFLAGS_release := -O3 -g -DNDEBUG
CFLAGS_static := $(CFLAGS_release)
STRIP ?= strip
CFLAGS_debug := -O0 -g
CFLAGS_o2 := -O2 -g
CFLAGS_clang := -O3 -g -DNDEBUG
WARN_clang := -Wno-double-promotion
CFLAGS_asan := -O1 -g -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all
LDFLAGS_asan := -fsanitize=address,undefined
CFLAGS_tsan := -O1 -g -fno-omit-frame-pointer -fsanitize=thread
LDFLAGS_tsan := -fsanitize=thread
# for `make mutants`: the code alone; what is only a warning is no mutant
CFLAGS_mutants := -O2 -DNDEBUG -Werror=int-conversion -Werror=incompatible-pointer-types
CFLAGS_cov := -O0 -g --coverage -DNDEBUG
LDFLAGS_cov := --coverage
SANITIZERS_fuzz := -fsanitize=address,undefined,float-cast-overflow
CFLAGS_fuzz := -O1 -g -fno-omit-frame-pointer $(SANITIZERS_fuzz) -fsanitize=fuzzer-no-link -fno-sanitize-recover=all
LDFLAGS_fuzz := $(SANITIZERS_fuzz)
# clang's INFINITY is a float
WARN_fuzz := -Wno-double-promotion
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
# MODE=static, the program of a wheel: in it is all but the C library
STATIC_hdf5 := hdf5 sz aec z
STATIC_udunits2 := udunits2 expat
archives = $(patsubst %,-l:lib%.a,$(or $(STATIC_$(1)),$(1)))
LDLIBS_STATIC := $(foreach l,$(LDLIBS),$(if $(filter -lhdf5 -ludunits2 -lgsl -lgslcblas,$(l)),$(call archives,$(l:-l%=%)),$(l))) -ldl

# src/web is the engine as a module for the studio: make studio
SOURCES := $(filter-out src/web/%,$(wildcard src/*/*.c))
LIB := $(filter-out $(BUILD)/src/app/main.o,$(SOURCES:%.c=$(BUILD)/%.o))
UNIT := $(patsubst %.c,$(BUILD)/%,$(wildcard tests/unit/test_*.c))
BENCH := $(patsubst %.c,$(BUILD)/%,$(wildcard tests/bench/bench_*.c))
FUZZ := $(patsubst tests/fuzz/fuzz_%.c,%,$(wildcard tests/fuzz/fuzz_*.c))
FUZZERS := $(patsubst %,$(BUILD)/tests/fuzz/fuzz_%,$(FUZZ))
# who hands the bytes to a fuzz target: libFuzzer, or files of the corpus one by one
FUZZ_LINK := -Wl,--wrap=mill_units_create,--wrap=mill_units_free $(if $(filter fuzz,$(MODE)),-fsanitize=fuzzer)
FUZZ_MAIN := $(BUILD)/tests/fuzz/units_once.o $(if $(filter fuzz,$(MODE)),,$(BUILD)/tests/fuzz/replay.o)
PROBES := $(patsubst %.c,$(BUILD)/%,$(wildcard validation/*/*.c))
C_FILES := $(wildcard src/*/*.[ch] include/millsim/*.h tests/unit/*.[ch] tests/bench/*.[ch] tests/fuzz/*.[ch] \
             validation/*/*.[ch] examples/*.c)

# The simulator is whole without Python, so packages for ./mill that cannot be had now are one line, not a failure;
# `make mill`, asked for by name, fails.
all: millsim
	@cp -f tools/mill.sh mill
	@tools/setup --local --python core share $(EXTRAS) || true

mill: always
	@cp -f tools/mill.sh mill
	@tools/setup --local --python core share $(EXTRAS)

# The only target that calls apt; `make run` and `make test` ask for it, so that they do all on a fresh machine. Others
# say what is missing.
ALL_PARTS := build python test dem slurm render pov browser node wasm lint fuzz golden valgrind wheel
deps:
	@tools/setup $(or $(PARTS),$(ALL_PARTS))

help:
	@echo 'make           build ./millsim, and ./mill with the Python packages of plot, report and compare in .venv'
	@echo 'make millsim   build ./millsim alone'
	@echo 'make mill EXTRAS="render study"  ./mill with more: render, study, cluster, export, dem, mesh; all'
	@echo 'make run       install what is missing, build, run the reference mill, write its report'
	@echo 'make check     a minute of tests that need neither root nor other programs (T=FILE: all tests of a file)'
	@echo 'make test      install what is missing, build, run every test (MODE=asan: under sanitizers)'
	@echo 'make deps      install the Debian packages of all targets (PARTS="build test": only of these)'
	@echo 'make lint      formatting, floors, names, static checks      make format   reformat'
	@echo 'make golden    the same bits whatever compiler, optimisation and C library, and those frozen in tests/golden'
	@echo 'make valgrind  tiny decks, right and wrong ones, under valgrind'
	@echo 'make validate  the verification ladder: validation/RESULTS.md and figures (some 15 minutes)'
	@echo 'make validate-dem  millsim against LIGGGHTS, some 80 minutes: validation/dem/RESULTS.md'
	@echo 'make validate-study  the wavy chamber, some 40 minutes: validation/study/RESULTS.md'
	@echo 'make validate-paper  the 2007 paper, statement by statement, some 15 minutes: validation/paper/RESULTS.md'
	@echo '               CASES="gas dense" with validate, validate-... or bench: only these parts, and no RESULTS.md'
	@echo 'make studio    a mill that is simulated in a web page, one file: tools/milltools/studio/studio.html'
	@echo 'make docs      the documentation as a site that opens from disk: build/docs/index.html'
	@echo 'make pictures  make those of the README and docs/figures.md anew'
	@echo 'make coverage  every test with lines and branches counted: build/coverage (an hour)'
	@echo 'make mutants   do the tests see a wrong line? MUTANTS=200 in C, as many in Python, SEED=1 (under an hour)'
	@echo 'make lowest    make check with the lowest versions of Python packages that tools/pyproject.toml allows'
	@echo 'make nightly   ten minutes of fuzzing a target, test with measured marks, thorough, coverage, mutants, and all of the validation: some seven hours'
	@echo 'make thorough  the cases of tests that make test leaves out, because there are many like them'
	@echo 'make fuzz      fuzz every target, FUZZ_SECONDS=$(FUZZ_SECONDS) each: tests/fuzz/README.md'
	@echo 'make bench     measure speed, some minutes: docs/performance.md (QUICK=1: try it)'
	@echo 'make bench-parts  nanoseconds of root finding, calendar and observers'
	@echo 'make bench-peers  millsim and other programs in turn: PEERS="single=PROGRAM cell=..."; docs/performance.md'
	@echo 'make wheel     the program and mill as one file for pip: build/wheel (ARCH=arm64: for that machine)'
	@echo 'make release   source archive, wheels, site and check sums of a version, each tried: build/release-VERSION'
	@echo 'make bench-studio  speed of the studio in Chromium beside the program'
	@echo 'make install   millsim, mill, libmillsim.a, decks, man pages into PREFIX=$(PREFIX)'
	@echo '               (MILL=no: all but mill)      make uninstall  removes it again'
	@echo 'make clean     remove what was built        MODE=release|debug|o2|asan|tsan  WERROR=1  V=1'

millsim: build/release/millsim
	@cp -f $< $@

ifeq ($(MODE),musl)
build/musl/millsim: build/release/millsim build/musl/libm.a
	$(Q)$(CC) -o $@ $(patsubst build/musl/%,build/release/%,$(BUILD)/src/app/main.o $(LIB)) build/musl/libm.a $(LDLIBS)
else ifeq ($(MODE),static)
$(BUILD)/millsim: $(BUILD)/src/app/main.o $(LIB)
	$(Q)$(CC) $(ALL_LDFLAGS) -o $@.whole $^ $(LDLIBS_STATIC) && $(STRIP) -o $@ $@.whole
else
$(BUILD)/millsim: $(BUILD)/src/app/main.o $(LIB)
	$(Q)$(CC) $(ALL_LDFLAGS) -o $@ $^ $(LDLIBS_SMALL) 2>/dev/null || $(CC) $(ALL_LDFLAGS) -o $@ $^ $(LDLIBS)
endif

# ./millsim is the release build, whatever else is being built
ifneq ($(BUILD),build/release)
build/release/millsim: always
	@$(MAKE) $(PARALLEL) MODE=release BUILD=build/release $@
endif

$(BUILD)/%.o: %.c $(BUILD)/flags | needed
	@mkdir -p $(@D)
	$(Q)$(CC) $(ALL_CFLAGS) $(DEFINES) -MMD -MP -c -o $@ $<

# what a checkpoint is good for: the same sources, flags and compiler
BUILD_ID := $(shell (cat $(sort $(wildcard src/*/*.[ch] include/millsim/*.h)); echo '$(FLAGS)'; $(CC) --version 2>/dev/null) 2>/dev/null | \
    (sha256sum 2>/dev/null || shasum -a 256) | cut -c1-16)
$(BUILD)/src/base/version.o: $(BUILD)/version
$(BUILD)/src/base/version.o: DEFINES = \
    '-DMILL_VERSION="$(VERSION)"' '-DMILL_FLAGS="$(FLAGS)"' '-DMILL_BUILD="$(BUILD_ID)"'

# rewritten only when they change, so that a change rebuilds what depends on it
$(BUILD)/flags: always
	@mkdir -p $(@D); echo '$(CC) $(ALL_CFLAGS)' | cmp -s - $@ || echo '$(CC) $(ALL_CFLAGS)' > $@
$(BUILD)/version: always
	@mkdir -p $(@D); echo '$(VERSION) $(BUILD_ID)' | cmp -s - $@ || echo '$(VERSION) $(BUILD_ID)' > $@

$(BUILD)/tests/%: $(BUILD)/tests/%.o $(LIB)
	$(Q)$(CC) $(ALL_LDFLAGS) -o $@ $^ $(LDLIBS) $(shell pkg-config --libs check 2>/dev/null)

$(FUZZERS): %: %.o $(FUZZ_MAIN) $(LIB)
	$(Q)$(CC) $(ALL_LDFLAGS) $(FUZZ_LINK) -o $@ $^ $(LDLIBS)

$(BUILD)/validation/%: $(BUILD)/validation/%.o $(LIB)
	$(Q)$(CC) $(ALL_LDFLAGS) -o $@ $^ $(LDLIBS)

needed:
	@tools/setup --check build

run:
	@$(MAKE) --no-print-directory deps PARTS=build
	@$(MAKE) --no-print-directory deps PARTS=python || true
	@$(MAKE) $(PARALLEL) all
	./millsim --force -o reference.h5 input/simoloyer.ini
	@./mill report reference.h5 || echo 'make run: no report, for the reason above; the run is whole, in reference.h5'

test:
	@$(MAKE) --no-print-directory deps PARTS='build python test dem slurm render pov browser node wasm'
	@tools/setup --local --python all check test
	@$(MAKE) $(PARALLEL) compiled mill
	@$(if $(filter release,$(MODE)),,CK_EXCLUDE_TAGS=slow) $(MAKE) $(PARALLEL) --output-sync=target unit
	@$(MAKE) --no-print-directory replay $(if $(filter release,$(MODE)),js) cli

# What needs neither root nor more than a compiler, Check and Python, and no long while. T: files, of Python or
# tests/unit/test_*.c, tests/web/*.test.mjs; all of such a file is run, slow tests too
CHECKED := $(if $(T),$(filter tests/unit/%,$(T)),$(wildcard tests/unit/test_*.c))
JSTESTS := $(if $(T),$(filter tests/web/%,$(T)),$(wildcard tests/web/*.test.mjs))
PYTESTS := $(if $(T),$(filter-out tests/unit/% tests/web/%,$(T)),tests)
check:
	$(foreach file,$(CHECKED),$(if $(wildcard $(file)),,$(error $(file): no such test)))
	@tools/setup --local build test --python check study cluster export dem mesh
	@$(MAKE) $(PARALLEL) $(CHECKED:%.c=$(BUILD)/%) $(BUILD)/tests/bench/bench_engine $(BUILD)/millsim millsim
	@$(if $(T),,CK_EXCLUDE_TAGS=slow) $(MAKE) $(PARALLEL) --keep-going --output-sync=line $(if $(PYTESTS),check-python) \
	    $(patsubst tests/unit/test_%.c,unit-%,$(CHECKED)) $(if $(JSTESTS),check-js)

QUICK := 'not slow and not thorough and not browser and not slurm and not dem and not render'

# one process more than cores: some tests wait
check-python:
	MILLSIM=$(abspath $(BUILD)/millsim) .venv/bin/python -m pytest -q -rs $(PYTESTS) $(if $(MARKS),--marks) \
	    $(if $(T),,-n $$(($(JOBS) + 1)) --dist loadfile --no-loadscope-reorder -m $(QUICK))

check-js:
	@if command -v node >/dev/null; then \
	    $(MAKE) --no-print-directory js $(if $(T),,JSTESTS='$(filter-out %/engine.test.mjs,$(JSTESTS))'); \
	    else echo 'no node: tests/web is left out (tools/setup node)'; fi

# all that `make test` compiles
compiled: $(UNIT) $(FUZZERS) $(BENCH) $(PROBES) $(BUILD)/millsim millsim $(WASM)/millsim.wasm

unit: $(patsubst tests/unit/test_%.c,unit-%,$(wildcard tests/unit/test_*.c))

unit-%: $(BUILD)/tests/unit/test_%
	@$<

# what the scripts of the pages compute, without a browser; engine.test.mjs needs the module
js: $(if $(filter %/engine.test.mjs,$(JSTESTS)),$(WASM)/millsim.wasm millsim)
	MILLSIM=$(abspath millsim) node --test --test-reporter=spec $(JSTESTS)

# the cases that `make test` leaves out: similar ones remain in it; and all draws of the random tests in C (unit.h)
thorough: export UNIT_THOROUGH := 1
thorough:
	@tools/setup --local --python all check test
	@$(MAKE) $(PARALLEL) $(BENCH) $(BUILD)/millsim millsim mill
	MILLSIM=$(abspath $(BUILD)/millsim) .venv/bin/python -m pytest -q -rs -n 2 --timeout 3600 -m thorough $(PYTESTS)
	@for mode in release asan; do $(MAKE) $(PARALLEL) --output-sync=target MODE=$$mode unit || exit 1; done

# the seeds and past finds of the fuzz targets, without a fuzzer
replay: $(FUZZERS)
	@set -e; for t in $(FUZZ); do $(BUILD)/tests/fuzz/fuzz_$$t tests/fuzz/corpus/$$t; done

# The Python tools are what they are in every mode: tested once, with the release build; under sanitizers, what passes
# bytes to the program. Three tests at a time on two cores, those of a file one after the other: most keep one core
# busy, some wait for a cluster or a browser. MARKS=1: are the marks true (tests/marks.py)?
BYTES := $(patsubst %,tests/cli/test_%.py,bad_input bodies deck deck_faults digest export_start resume)
cli: $(BUILD)/millsim millsim
	MILLSIM=$(abspath $(BUILD)/millsim) .venv/bin/python -m pytest -q -rs --durations 15 \
	    -n 3 --dist loadfile --no-loadscope-reorder $(if $(MARKS),--marks) \
	    $(if $(filter release,$(MODE)),tests,$(BYTES) -m 'not thorough and not long')

# The same program whatever the optimisation, the compiler and the C library's mathematics (MODE=musl: the release
# build's objects, with musl's in front of glibc's). At a push GOLDEN='release asan', the others nightly.
GOLDEN := release debug o2 asan clang musl
golden:
	@tools/setup --local build golden --python core
	@set -e; for m in $(GOLDEN); do $(MAKE) $(PARALLEL) MODE=$$m build/$$m/millsim; done
	.venv/bin/python tests/golden/golden.py $(GOLDEN:%=build/%/millsim)

MUSL = $(firstword $(wildcard /usr/lib/*-linux-musl/libc.a))
build/musl/libm.a:
	@rm -rf build/musl/math; mkdir -p build/musl/math
	@cd build/musl/math && ar x $(MUSL) $$(ar t $(MUSL) | grep -xE '(__)?(a?(cos|sin|tan)|atan2|cbrt|exp|exp2|exp_data|floor|ceil|fma|fmod|frexp|ldexp|scalbn|log|log_data|pow|pow_data|fmin|fmax|hypot|sqrt|fabs|rem_pio2|rem_pio2_large|math_.*)\.lo')
	@ar rc $@ build/musl/math/*.lo

# 99: valgrind found something; 2: the deck was refused, as it should be
# (blocks that only glibc's search trees point to, with a tagged pointer, count as possibly lost: not looked at)
VALGRIND := valgrind --quiet --error-exitcode=99 --leak-check=full --show-leak-kinds=definite \
    --errors-for-leak-kinds=definite build/debug/millsim -q -f -o build/valgrind.h5
valgrind:
	@tools/setup --local build valgrind
	@$(MAKE) $(PARALLEL) MODE=debug build/debug/millsim
	$(VALGRIND) -s 'run.time=60 ms' input/single.ini > /dev/null
	$(VALGRIND) -j -s balls.count=100 -s 'run.time=20 ms' -s 'run.sample_from=0 s' input/simoloyer.ini > /dev/null
	$(VALGRIND) -s 'drum.radius=75 s' input/single.ini; test $$? = 2
	$(VALGRIND) -s balls.count=4 input/single.ini; test $$? = 2
	$(VALGRIND) -s balls.count=20000 -s 'run.time=1 s' input/simoloyer.ini -s 'balls.diameter=10 mm'; test $$? = 2

# its own objects, or those of a checkout whose every file is compiled with WERROR=1
LINTED := build/$(if $(WERROR),release,lint)
lint:
	@tools/setup --local build lint --python core lint
	clang-format-14 --dry-run -Werror $(C_FILES)
	tools/check-floors
	@$(MAKE) $(PARALLEL) BUILD=$(LINTED) WERROR=1 $(LINTED)/millsim && tools/check-names $(LINTED)/src/*/*.o
	cppcheck --quiet --error-exitcode=1 --std=c99 --inline-suppr --enable=warning,portability \
	    --suppress=normalCheckLevelMaxBranches -Iinclude -Isrc src
	git ls-files -z | xargs -0 codespell -q 3
	tools/check-links
	.venv/bin/ruff check tests tools validation && .venv/bin/ruff format --check tests tools validation
	PYTHONPATH=tools .venv/bin/lint-imports --config tools/contracts.toml
	MYPYPATH=tools .venv/bin/mypy --config-file tools/pyproject.toml
	.venv/bin/oxlint -c tools/js/oxlint.json tools/milltools tests
	@$(MAKE) --no-print-directory $(TSC)
	for part in page worker; do .venv/bin/node $(TSC) -p tools/js/$$part.json || exit 1; done

# TypeScript's checker, for the scripts of the pages
TSC := build/js/node_modules/typescript/bin/tsc
$(TSC): tools/js/package-lock.json
	@mkdir -p build/js && cp tools/js/package.json tools/js/package-lock.json build/js
	.venv/bin/npm ci --silent --ignore-scripts --no-audit --no-fund --prefix build/js
	@touch $@

format:
	clang-format-14 -i $(C_FILES)
	.venv/bin/ruff format tests tools validation

fuzz:
	@tools/setup --local build fuzz --python core
	@$(MAKE) $(PARALLEL) MODE=fuzz CC=clang-14 fuzzers
	@$(MAKE) --no-print-directory -k -j2 MODE=fuzz CC=clang-14 $(addprefix fuzz-,$(FUZZ) reader)

# fuzzing for longer than a push can wait, and all that takes hours: every step is tried, also after one has failed
nightly:
	@status=0; for step in 'fuzz FUZZ_SECONDS=600' 'test MARKS=1' golden thorough coverage mutants lowest validate validate-paper validate-study validate-dem; do \
	    echo "make $$step"; $(MAKE) --no-print-directory $$step || status=$$?; done; exit $$status

# lines and branches that the tests reach: of C by gcov, of Python by coverage.py in every process that the tests start
coverage:
	@tools/setup --local build test --python all check test coverage
	@$(MAKE) $(PARALLEL) MODE=cov $(UNIT:$(BUILD)/%=build/cov/%) $(FUZZERS:$(BUILD)/%=build/cov/%) build/cov/millsim
	@$(MAKE) $(PARALLEL) $(BENCH) millsim mill $(WASM)/millsim.wasm
	@find build/cov -name '*.gcda' -delete; rm -rf build/coverage; mkdir -p build/coverage
	@status=0; export SLOWER=5; $(MAKE) $(PARALLEL) -k --output-sync=target MODE=cov unit replay || status=$$?; \
	MILLSIM=$(abspath build/cov/millsim) .venv/bin/python -m coverage run --rcfile tests/coverage.ini -m pytest -q -n $(JOBS) \
	    --dist loadfile --timeout 1500 -m 'not unmeasured and not thorough' $(or $(PYTESTS),tests) || status=$$?; \
	.venv/bin/python tests/covered.py || status=$$?; exit $$status

# one line broken at a time, in copies of the repository: do the nearest tests fail? MUTANTS in C, and as many in Python;
# FILES: only of these sources
mutants:
	@tools/setup --local build test --python all check test
	@$(MAKE) $(PARALLEL) MODE=asan $(if $(filter-out %.py,$(or $(FILES),all)),$(UNIT:$(BUILD)/%=build/asan/%) build/asan/millsim) millsim
	@.venv/bin/python tests/mutants.py --jobs $(JOBS) $(MUTANTS:%=--count %) $(SEED:%=--seed %) $(FILES)

# what the tests' lock says of a package, for `make lowest`
$(foreach p,pytest pytest-timeout pytest-xdist mpmath,$(eval LOCKED_$p := $(shell sed -n 's/^$p==//p' tests/requirements.lock)))
build/lowest/made: tools/pyproject.toml tests/requirements.lock
	@rm -rf build/lowest; mkdir -p build; $(or $(PYTHON),python3) -m venv build/lowest
	build/lowest/bin/python -m pip install -q --disable-pip-version-check uv
	build/lowest/bin/python -m uv pip install -q --python build/lowest/bin/python --resolution lowest-direct \
	    './tools[study,cluster,export,dem,mesh]' pytest==$(LOCKED_pytest) pytest-timeout==$(LOCKED_pytest-timeout) \
	    pytest-xdist==$(LOCKED_pytest-xdist) mpmath==$(LOCKED_mpmath)
	@touch $@
lowest: build/lowest/made
	@$(MAKE) $(PARALLEL) $(BUILD)/tests/bench/bench_engine millsim
	MILLSIM=$(abspath millsim) build/lowest/bin/python -m pytest -q $(PYTESTS) -n $(JOBS) --dist loadfile \
	    -m $(QUICK)

fuzzers: $(FUZZERS)

fuzz-%:
	@tools/fuzz $* $(FUZZ_SECONDS) $(FUZZ_SEED)

validate:
	@tools/setup --local build --python check
	@$(MAKE) $(PARALLEL) millsim $(PROBES)
	.venv/bin/python validation/ladder.py $(CASES)

# some 80 minutes, nearly all of them LIGGGHTS at steel stiffness; KEPT=1: kept runs of any version will do
validate-dem:
	@tools/setup --local build dem --python check dem study
	@$(MAKE) $(PARALLEL) millsim mill
	.venv/bin/python validation/dem/validate.py $(if $(KEPT),--kept) $(CASES)

# some 40 minutes of studies on all cores; KEPT=1: kept tables of any version will do
validate-study:
	@tools/setup --local build --python check study
	@$(MAKE) $(PARALLEL) millsim mill
	.venv/bin/python validation/study/validate.py $(if $(KEPT),--kept) $(CASES)

# some 15 minutes; KEPT=1: what is kept of any version will do
validate-paper:
	@tools/setup --local build --python check study
	@$(MAKE) $(PARALLEL) millsim mill
	.venv/bin/python validation/paper/validate.py $(if $(KEPT),--kept) $(CASES)

# JSON=FILE: where to, instead of build/bench.json (build/bench-quick.json with QUICK=1); REPEATS=N
bench:
	@tools/setup --local build --python core
	@$(MAKE) $(PARALLEL) $(BENCH) $(BUILD)/millsim
	.venv/bin/python tests/bench/bench.py --build $(BUILD) $(if $(QUICK),--quick) $(REPEATS:%=--repeats %) \
	    $(JSON:%=--json %) $(CASES)

# PEERS="NAME=PROGRAM ...": programs that the user has built; CASES, QUICK, REPEATS and JSON as for bench
bench-peers:
	@tools/setup --local build --python core
	@$(MAKE) $(PARALLEL) $(BUILD)/tests/bench/bench_engine $(BUILD)/millsim
	.venv/bin/python tests/bench/bench_peers.py --build $(BUILD) $(if $(QUICK),--quick) $(REPEATS:%=--repeats %) \
	    $(JSON:%=--json %) $(CASES:%=--case %) $(PEERS)

# the studio in Chromium; REPEATS as for bench
bench-studio: studio
	@tools/setup --local browser --python test
	.venv/bin/python tests/bench/bench_studio.py $(REPEATS:%=--repeats %)

BENCH_PARTS := $(patsubst %,$(BUILD)/tests/bench/bench_%,poly calendar observers)
bench-parts: $(BENCH_PARTS)
	@set -e; for b in $^; do $$b; done

# what the README and docs/figures.md show, by the program itself: some two minutes
PICTURES := build/pictures
pictures:
	@tools/setup --local build render --python render
	@$(MAKE) $(PARALLEL) millsim mill
	@mkdir -p $(PICTURES)
	./millsim -q -f -o $(PICTURES)/reference.h5 input/simoloyer.ini >/dev/null
	./millsim -q -f -o $(PICTURES)/wavy.h5 -s 'run.precision=0' -s 'run.time=0.3 s' input/wavy.ini >/dev/null
	./mill render $(PICTURES)/reference.h5 docs/img/mill.webp --slow 50 --from '200 ms' --to '259.2 ms' \
	    --size 640x360 --quality final
	./mill render $(PICTURES)/reference.h5 docs/img/mill.png --size 960x540 \
	    --limits $(PICTURES)/wavy.h5
	./mill render $(PICTURES)/wavy.h5 docs/img/wavy.png --size 960x540 \
	    --limits $(PICTURES)/reference.h5
	./mill plot $(PICTURES)/reference.h5 docs/img/reference.png
	for d in planetary attritor stl; do ./millsim -q -f -o $(PICTURES)/$$d.h5 input/$$d.ini >/dev/null && \
	    ./mill render $(PICTURES)/$$d.h5 docs/img/$$d.png --size 640x400 || exit 1; done
	for f in flow speeds axial-rate; do \
	    ./mill plot $(PICTURES)/reference.h5 docs/img/figure-$$f.png --figure $$f || exit 1; done

# the pages as a site; a link that leads nowhere fails
docs: studio
	tools/check-links --stage build/docs-source
	cp tools/milltools/studio/studio.html build/docs-source/studio.html
	@tools/setup --local --python docs
	NO_MKDOCS_2_WARNING=1 .venv/bin/python -m mkdocs build --strict --quiet -f docs/mkdocs.yml
	@echo 'build/docs/index.html'

# The engine as a WebAssembly module, with what needs neither threads nor HDF5 nor UDUNITS; then the page that holds it.
# Clang 14 makes wrong code of geometry/wall.c with vectors (tests/web/engine.test.mjs finds it).
WASM_FLAGS := --target=wasm32-wasi -msimd128 -O3 -std=c99 -D_POSIX_C_SOURCE=200809L -ffp-contract=off -fno-math-errno \
    -DNDEBUG -D_WASI_EMULATED_SIGNAL
NOT_WASM := src/base/version.c src/engine/crew.c src/deck/units.c $(foreach f,frames impactlog observers poses replay \
    series sink_file vtkhdf,src/observe/$f.c)
WASM_OBJECTS := $(patsubst %.c,$(WASM)/%.o,src/app/asked.c $(wildcard src/web/*.c) $(filter-out $(NOT_WASM),$(wildcard \
    $(foreach f,base geometry engine start deck observe,src/$f/*.c))))
$(WASM)/%.o: %.c
	@mkdir -p $(@D)
	$(if $(V),,@echo "  wasm $(notdir $@)";) clang-19 $(WASM_FLAGS) -Wall -Wextra $(if $(WERROR),-Werror) -Iinclude -Isrc -MMD -MP -c -o $@ $<
$(WASM)/millsim.wasm: $(WASM_OBJECTS)
	$(if $(V),,@echo "  wasm $(notdir $@)";) clang-19 --target=wasm32-wasi -mexec-model=reactor -o $@ $^ -fuse-ld=lld \
	    -Wl,--strip-all,--gc-sections,-z,stack-size=1048576

wasm:
	@tools/setup --local wasm
	@$(MAKE) $(PARALLEL) $(WASM)/millsim.wasm

# beside the code that opens it, as in an installed package
studio: wasm millsim
	@tools/setup --local --python core
	PYTHONPATH=tools .venv/bin/python -m milltools.studio.build $(WASM)/millsim.wasm tools/milltools/studio/studio.html \
	    $(wildcard /usr/share/doc/wasi-libc/copyright /usr/share/doc/libclang-rt-*-dev-wasm32/copyright)
	@echo 'tools/milltools/studio/studio.html'

# The program, the Python package and what belongs to them as one file for pip. ARCH=arm64: for that machine
wheel: studio
	@tools/setup --local build --python core study dem share
	@$(MAKE) $(PARALLEL) millsim
	@.venv/bin/python tools/wheel $(ARCH:%=--arch %)

# what is published of the commit that is checked out, each piece tried; ARCHES: of the wheels
ARCHES := amd64 arm64
release:
	@tools/setup --local build --python core study dem share docs
	@tools/release $(ARCHES)

tell-version:
	@echo '$(VERSION)'

# The engine alone: what another program links, with no need of HDF5, UDUNITS or GSL
ENGINE := $(foreach f,base geometry engine start,$(filter $(BUILD)/src/$(f)/%,$(LIB)))
$(BUILD)/libmillsim.a: $(ENGINE)
	$(Q)rm -f $@; ar rc $@ $^

install: millsim build/release/libmillsim.a
	@DESTDIR='$(DESTDIR)' MILL='$(MILL)' tools/install '$(PREFIX)' $(EXTRAS)

uninstall:
	@DESTDIR='$(DESTDIR)' tools/install --remove '$(PREFIX)'

clean:
	rm -rf build millsim mill tools/milltools/studio/studio.html

-include $(patsubst %.o,%.d,$(LIB) $(WASM_OBJECTS)) $(BUILD)/src/app/main.d $(addsuffix .d,$(UNIT) $(BENCH) $(PROBES) $(FUZZERS)) \
    $(BUILD)/tests/fuzz/replay.d $(BUILD)/tests/fuzz/units_once.d
.SECONDARY:
.PHONY: all help needed deps run check check-python check-js test compiled unit js thorough coverage mutants nightly lowest replay fuzz fuzzers cli golden valgrind validate validate-dem validate-study validate-paper lint format docs pictures bench bench-parts bench-peers bench-studio \
        wasm studio wheel release tell-version install uninstall clean always

# The parts of `make check` and `make test`, and what tests besides them

# ---- parts of check and test ----
QUICK_TESTS := 'not slow and not thorough and not browser and not slurm and not dem and not render'

# one process more than cores: some tests wait
check-python:
	MILLSIM=$(abspath $(BUILD)/millsim) .venv/bin/python -m pytest -q -rs $(PYTESTS) $(if $(MARKS),--marks) \
	    $(if $(T),,-n $$(($(JOBS) + 1)) --dist loadfile --no-loadscope-reorder -m $(QUICK_TESTS))

check-js:
	@if command -v node >/dev/null; then \
	    $(MAKE) --no-print-directory js $(if $(T),,JSTESTS='$(filter-out %/engine.test.mjs,$(JSTESTS))'); \
	    else echo 'no node: tests/web is left out (tools/setup node)'; fi

# all that `make test` compiles
FUZZ := $(patsubst tests/fuzz/fuzz_%.c,%,$(wildcard tests/fuzz/fuzz_*.c))
FUZZERS := $(patsubst %,$(BUILD)/tests/fuzz/fuzz_%,$(FUZZ))
compiled: $(UNIT) $(FUZZERS) $(BENCH) $(PROBES) $(BUILD)/millsim millsim $(WASM)/millsim.wasm

unit: $(patsubst tests/unit/test_%.c,unit-%,$(wildcard tests/unit/test_*.c))

unit-%: $(BUILD)/tests/unit/test_%
	@$<

# what the scripts of the pages compute, without a browser; engine.test.mjs needs the module
js: $(if $(filter %/engine.test.mjs,$(JSTESTS)),$(WASM)/millsim.wasm millsim) ## the JavaScript tests of tests/web
	MILLSIM=$(abspath millsim) node --test --test-reporter=spec $(JSTESTS)

# The Python tools are what they are in every mode: tested once, with the release build; under sanitizers, what passes
# bytes to the program. Three tests at a time on two cores, those of a file one after the other: most keep one core
# busy, some wait for a cluster or a browser. MARKS=1: are the marks true (tests/marks.py)?
BYTES := $(patsubst %,tests/cli/test_%.py,bad_input bodies deck deck_faults digest export_start resume)
cli: $(BUILD)/millsim millsim
	MILLSIM=$(abspath $(BUILD)/millsim) .venv/bin/python -m pytest -q -rs --durations 15 \
	    -n 3 --dist loadfile --no-loadscope-reorder $(if $(MARKS),--marks) \
	    $(if $(filter release,$(MODE)),tests,$(BYTES) -m 'not thorough and not long')

# ---- parts of lint ----
lint-python:
	.venv/bin/ruff check tests tools validation && .venv/bin/ruff format --check tests tools validation
	PYTHONPATH=tools .venv/bin/lint-imports --config tools/contracts.toml
	MYPYPATH=tools .venv/bin/mypy --config-file tools/pyproject.toml

format: ## reformat C and Python
	clang-format-14 -i $(C_FILES)
	.venv/bin/ruff format tests tools validation

# ---- the same bits of all builds ----
# The same program whatever the optimisation, the compiler and the C library's mathematics (MODE=musl: the release
# build's objects, with musl's in front of glibc's). At a push GOLDEN='release asan', the others nightly.
GOLDEN := release debug o2 asan clang musl
golden: ## the same bits of all builds and C libraries, and those frozen (GOLDEN='release asan'): tests/golden
	@tools/setup --local build golden --python core
	@set -e; for m in $(GOLDEN); do $(MAKE) $(PARALLEL) MODE=$$m build/$$m/millsim; done
	.venv/bin/python tests/golden/golden.py $(GOLDEN:%=build/%/millsim)

build/musl/millsim: build/release/millsim build/musl/libm.a
	$(Q)$(CC) -o $@ $(patsubst build/musl/%,build/release/%,$(BUILD)/src/app/main.o $(LIB)) build/musl/libm.a $(LDLIBS)

MUSL = $(firstword $(wildcard /usr/lib/*-linux-musl/libc.a))
build/musl/libm.a:
	@rm -rf build/musl/math; mkdir -p build/musl/math
	@cd build/musl/math && ar x $(MUSL) $$(ar t $(MUSL) | grep -xE \
	    -e '(__)?(a?(cos|sin|tan)|atan2|cbrt|exp|exp2|exp_data|floor|ceil|fma|fmod|frexp|ldexp|scalbn|log)\.lo' \
	    -e '(__)?(log_data|pow|pow_data|fmin|fmax|hypot|sqrt|fabs|rem_pio2|rem_pio2_large|math_.*)\.lo')
	@ar rc $@ build/musl/math/*.lo

# ---- fuzzing ----
# who hands the bytes to a fuzz target: libFuzzer, or files of the corpus one by one
FUZZ_LINK := -Wl,--wrap=mill_units_create,--wrap=mill_units_free $(if $(filter fuzz,$(MODE)),-fsanitize=fuzzer)
FUZZ_MAIN := $(BUILD)/tests/fuzz/units_once.o $(if $(filter fuzz,$(MODE)),,$(BUILD)/tests/fuzz/replay.o)
$(FUZZERS): %: %.o $(FUZZ_MAIN) $(LIB)
	$(Q)$(CC) $(ALL_LDFLAGS) $(FUZZ_LINK) -o $@ $^ $(LDLIBS)

fuzzers: $(FUZZERS)

# the seeds and past finds of the fuzz targets, without a fuzzer
replay: $(FUZZERS)
	@set -e; for t in $(FUZZ); do $(BUILD)/tests/fuzz/fuzz_$$t tests/fuzz/corpus/$$t; done

FUZZ_SECONDS ?= 30
fuzz: ## fuzz every target, FUZZ_SECONDS=30 each: tests/fuzz/README.md
	@tools/setup --local build fuzz --python core
	@$(MAKE) $(PARALLEL) MODE=fuzz CC=clang-14 fuzzers
	@$(MAKE) --no-print-directory -k -j2 MODE=fuzz CC=clang-14 $(addprefix fuzz-,$(FUZZ) reader)

fuzz-%:
	@tools/fuzz $* $(FUZZ_SECONDS) $(FUZZ_SEED)

# ---- what takes longer than a push can wait ----
# 99: valgrind found something; 2: the deck was refused, as it should be
# (blocks that only glibc's search trees point to, with a tagged pointer, count as possibly lost: not looked at)
VALGRIND := valgrind --quiet --error-exitcode=99 --leak-check=full --show-leak-kinds=definite \
    --errors-for-leak-kinds=definite build/debug/millsim -q -f -o build/valgrind.h5
valgrind: ## tiny decks, right and wrong ones, under valgrind
	@tools/setup --local build valgrind
	@$(MAKE) $(PARALLEL) MODE=debug build/debug/millsim
	$(VALGRIND) -s 'run.time=60 ms' input/single.ini > /dev/null
	$(VALGRIND) -j -s balls.count=100 -s 'run.time=20 ms' -s 'run.sample_from=0 s' input/simoloyer.ini > /dev/null
	$(VALGRIND) -s 'drum.radius=75 s' input/single.ini; test $$? = 2
	$(VALGRIND) -s balls.count=4 input/single.ini; test $$? = 2
	$(VALGRIND) -s balls.count=20000 -s 'run.time=1 s' input/simoloyer.ini -s 'balls.diameter=10 mm'; test $$? = 2

# similar ones remain in `make test`; and all draws of the random tests in C (unit.h)
thorough: export UNIT_THOROUGH := 1
thorough: ## the cases of tests that make test leaves out, because there are many like them
	@tools/setup --local --python all check test
	@$(MAKE) $(PARALLEL) $(BENCH) $(BUILD)/millsim millsim mill
	MILLSIM=$(abspath $(BUILD)/millsim) .venv/bin/python -m pytest -q -rs -n 2 --timeout 3600 -m thorough $(PYTESTS)
	@for mode in release asan; do $(MAKE) $(PARALLEL) --output-sync=target MODE=$$mode unit || exit 1; done

# lines and branches that the tests reach: of C by gcov, of Python by coverage.py in every process that the tests start
coverage: ## every test with lines and branches counted: build/coverage (an hour)
	@tools/setup --local build test --python all check test coverage
	@$(MAKE) $(PARALLEL) MODE=cov $(UNIT:$(BUILD)/%=build/cov/%) $(FUZZERS:$(BUILD)/%=build/cov/%) build/cov/millsim
	@$(MAKE) $(PARALLEL) $(BENCH) millsim mill $(WASM)/millsim.wasm
	@find build/cov -name '*.gcda' -delete; rm -rf build/coverage; mkdir -p build/coverage
	@status=0; export SLOWER=5; $(MAKE) $(PARALLEL) -k --output-sync=target MODE=cov unit replay || status=$$?; \
	MILLSIM=$(abspath build/cov/millsim) .venv/bin/python -m coverage run --rcfile tests/coverage.ini \
	    -m pytest -q -n $(JOBS) --dist loadfile --timeout 1500 -m 'not unmeasured and not thorough' \
	    $(or $(PYTESTS),tests) || status=$$?; \
	.venv/bin/python tests/covered.py || status=$$?; exit $$status

# one line broken at a time, in copies of the repository: do the nearest tests fail? FILES: only of these sources
mutants: ## do the tests see a wrong line? MUTANTS=200 in C, as many in Python, SEED=1, FILES (under an hour)
	@tools/setup --local build test --python all check test
	@$(MAKE) $(PARALLEL) MODE=asan millsim \
	    $(if $(filter-out %.py,$(or $(FILES),all)),$(UNIT:$(BUILD)/%=build/asan/%) build/asan/millsim)
	@.venv/bin/python tests/mutants.py --jobs $(JOBS) $(MUTANTS:%=--count %) $(SEED:%=--seed %) $(FILES)

# what the tests' lock says of a package
locked = $(1)==$(shell sed -n 's/^$(1)==//p' tests/requirements.lock)
build/lowest/made: tools/pyproject.toml tests/requirements.lock
	@rm -rf build/lowest; mkdir -p build; $(or $(PYTHON),python3) -m venv build/lowest
	build/lowest/bin/python -m pip install -q --disable-pip-version-check uv
	build/lowest/bin/python -m uv pip install -q --python build/lowest/bin/python --resolution lowest-direct \
	    './tools[study,cluster,export,dem,mesh]' \
	    $(foreach p,pytest pytest-timeout pytest-xdist mpmath,$(call locked,$p))
	@touch $@
lowest: build/lowest/made ## make check with the lowest versions of Python packages that tools/pyproject.toml allows
	@$(MAKE) $(PARALLEL) $(BUILD)/tests/bench/bench_engine millsim
	MILLSIM=$(abspath millsim) build/lowest/bin/python -m pytest -q $(PYTESTS) -n $(JOBS) --dist loadfile \
	    -m $(QUICK_TESTS)

# every step is tried, also after one has failed
nightly: ## fuzz, test with measured marks, golden, thorough, coverage, mutants, lowest, validate: seven hours
	@status=0; for step in 'fuzz FUZZ_SECONDS=600' 'test MARKS=1' golden thorough coverage mutants lowest \
	    validate validate-paper validate-study validate-dem validate-tumbling; do \
	    echo "make $$step"; $(MAKE) --no-print-directory $$step || status=$$?; done; exit $$status

-include $(addsuffix .d,$(FUZZERS)) $(BUILD)/tests/fuzz/replay.d $(BUILD)/tests/fuzz/units_once.d
.PHONY: check-python check-js compiled unit js cli lint-python format golden fuzzers replay fuzz valgrind thorough \
        coverage mutants lowest nightly

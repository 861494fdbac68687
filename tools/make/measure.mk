# Validation and speed. CASES="gas dense": only these parts, and no RESULTS.md; KEPT=1: what any version kept will do
PROBES := $(patsubst %.c,$(BUILD)/%,$(wildcard validation/*/*.c))
BENCH := $(patsubst %.c,$(BUILD)/%,$(wildcard tests/bench/bench_*.c))

$(BUILD)/validation/%: $(BUILD)/validation/%.o $(LIB)
	$(Q)$(CC) $(ALL_LDFLAGS) -o $@ $^ $(LDLIBS)

validate: ## verification ladder, 15 minutes: validation/RESULTS.md, figures (CASES="gas dense": these, no RESULTS.md)
	@tools/setup --local build --python check
	@$(MAKE) $(PARALLEL) millsim $(PROBES)
	.venv/bin/python validation/ladder.py $(CASES)

# nearly all of the time goes to LIGGGHTS at steel stiffness
validate-dem: ## millsim against LIGGGHTS, some 80 minutes: validation/dem/RESULTS.md (CASES; KEPT=1: kept runs will do)
	@tools/setup --local build dem --python check dem study
	@$(MAKE) $(PARALLEL) millsim mill
	.venv/bin/python validation/dem/validate.py $(if $(KEPT),--kept) $(CASES)

validate-tumbling: ## drums with lifters beside LIGGGHTS and formulas, an hour: validation/tumbling/RESULTS.md (CASES; KEPT=1)
	@tools/setup --local build dem --python check dem study
	@$(MAKE) $(PARALLEL) millsim mill
	.venv/bin/python validation/tumbling/validate.py $(if $(KEPT),--kept) $(CASES)

# studies on all cores
validate-study: ## the wavy chamber, some 40 minutes: validation/study/RESULTS.md (CASES; KEPT=1)
	@tools/setup --local build --python check study
	@$(MAKE) $(PARALLEL) millsim mill
	.venv/bin/python validation/study/validate.py $(if $(KEPT),--kept) $(CASES)

validate-paper: ## the 2007 paper, statement by statement, some 15 minutes: validation/paper/RESULTS.md (CASES; KEPT=1)
	@tools/setup --local build --python check study
	@$(MAKE) $(PARALLEL) millsim mill
	.venv/bin/python validation/paper/validate.py $(if $(KEPT),--kept) $(CASES)

# JSON=FILE: where to, instead of build/bench.json (build/bench-quick.json with QUICK=1); REPEATS=N
bench: ## measure speed, some minutes: docs/performance.md (QUICK=1: try it; CASES="gas4k": only these)
	@tools/setup --local build --python core
	@$(MAKE) $(PARALLEL) $(BENCH) $(BUILD)/millsim
	.venv/bin/python tests/bench/bench.py --build $(BUILD) $(if $(QUICK),--quick) $(REPEATS:%=--repeats %) \
	    $(JSON:%=--json %) $(CASES)

# PEERS="NAME=PROGRAM ...": programs that the user has built; CASES, QUICK, REPEATS and JSON as for bench
bench-peers: ## millsim and other programs in turn: PEERS="single=PROGRAM cell=..."; docs/performance.md
	@tools/setup --local build --python core
	@$(MAKE) $(PARALLEL) $(BUILD)/tests/bench/bench_engine $(BUILD)/millsim
	.venv/bin/python tests/bench/bench_peers.py --build $(BUILD) $(if $(QUICK),--quick) $(REPEATS:%=--repeats %) \
	    $(JSON:%=--json %) $(CASES:%=--case %) $(PEERS)

# REPEATS as for bench
bench-studio: studio ## speed of the studio in Chromium beside the program
	@tools/setup --local browser --python test
	.venv/bin/python tests/bench/bench_studio.py $(REPEATS:%=--repeats %)

bench-parts: $(filter-out %_engine,$(BENCH)) ## nanoseconds of root finding, calendar, observers
	@set -e; for b in $^; do $$b; done

-include $(addsuffix .d,$(PROBES) $(BENCH))
.PHONY: validate validate-dem validate-tumbling validate-study validate-paper bench bench-peers bench-studio bench-parts

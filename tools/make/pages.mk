# The studio, the documentation, pictures; the checks of their scripts
WASM := build/wasm

# The engine as a WebAssembly module, with what needs neither threads nor HDF5 nor UDUNITS; then the page that holds it.
# Clang 14 makes wrong code of geometry/wall.c with vectors (tests/web/engine.test.mjs finds it).
WASM_FLAGS := --target=wasm32-wasi -msimd128 -O3 -std=c99 -D_POSIX_C_SOURCE=200809L -ffp-contract=off -fno-math-errno \
    -DNDEBUG -D_WASI_EMULATED_SIGNAL
NOT_WASM := src/engine/crew.c src/deck/units.c $(foreach f,frames impactlog observers \
    reliefs replay series sink_file vtkhdf,src/observe/$f.c)
WASM_OBJECTS := $(patsubst %.c,$(WASM)/%.o,$(wildcard src/web/*.c) $(filter-out $(NOT_WASM),$(wildcard \
    $(foreach f,base geometry engine start mesh deck observe,src/$f/*.c))))
$(WASM)/%.o: %.c
	@mkdir -p $(@D)
	$(if $(V),,@echo "  wasm $(notdir $@)";) clang-19 $(WASM_FLAGS) -Wall -Wextra $(if $(WERROR),-Werror) \
	    -Iinclude -Isrc -MMD -MP -c -o $@ $<
$(WASM)/millsim.wasm: $(WASM_OBJECTS)
	$(if $(V),,@echo "  wasm $(notdir $@)";) clang-19 --target=wasm32-wasi -mexec-model=reactor -o $@ $^ -fuse-ld=lld \
	    -Wl,--strip-all,--gc-sections,-z,stack-size=1048576

wasm: ## the engine as a WebAssembly module: build/wasm/millsim.wasm
	@tools/setup --local wasm
	@$(MAKE) $(PARALLEL) $(WASM)/millsim.wasm

# beside the code that opens it, as in an installed package
studio: wasm millsim ## a mill that is simulated in a web page, one file: tools/milltools/studio/studio.html
	@tools/setup --local --python core
	PYTHONPATH=tools .venv/bin/python -m milltools.studio.build $(WASM)/millsim.wasm tools/milltools/studio/studio.html \
	    $(wildcard /usr/share/doc/wasi-libc/copyright /usr/share/doc/libclang-rt-*-dev-wasm32/copyright)
	@echo 'tools/milltools/studio/studio.html'

# a link that leads nowhere fails
docs: studio ## the documentation as a site that opens from disk: build/docs/index.html
	tools/check-links --stage build/docs-source
	cp tools/milltools/studio/studio.html build/docs-source/studio.html
	@tools/setup --local --python docs
	NO_MKDOCS_2_WARNING=1 .venv/bin/python -m mkdocs build --strict --quiet -f docs/mkdocs.yml
	@echo 'build/docs/index.html'

# what the README and the docs show, by the program itself
PICTURES := build/pictures
pictures: ## make those of the README and the docs anew (three minutes)
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
	./millsim -q -f -o $(PICTURES)/ballmill.h5 input/ballmill.ini >/dev/null
	for f in charge liner; do \
	    ./mill plot --figure $$f $(PICTURES)/ballmill.h5 docs/img/tumbling-$$f.png || exit 1; done
	for f in flow speeds axial-rate; do \
	    ./mill plot $(PICTURES)/reference.h5 docs/img/figure-$$f.png --figure $$f || exit 1; done

# the scripts of the pages, by oxlint and TypeScript's checker
TSC := build/js/node_modules/typescript/bin/tsc
lint-js: $(TSC)
	.venv/bin/oxlint -c tools/js/oxlint.json tools/milltools tests
	for part in page worker; do .venv/bin/node $(TSC) -p tools/js/$$part.json || exit 1; done

$(TSC): tools/js/package-lock.json
	@mkdir -p build/js && cp tools/js/package.json tools/js/package-lock.json build/js
	.venv/bin/npm ci --silent --ignore-scripts --no-audit --no-fund --prefix build/js
	@touch $@

-include $(WASM_OBJECTS:.o=.d)
.PHONY: wasm studio docs pictures lint-js

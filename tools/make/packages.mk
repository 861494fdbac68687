# Packages that millsim needs, and those that are made of it

# The only target that calls apt; `make run` and `make test` ask for it, so that they do all on a fresh machine. Others
# say what is missing.
ALL_PARTS := build python test dem slurm render pov browser node wasm lint fuzz golden valgrind wheel
deps: ## install the Debian packages of all targets (PARTS="build test": only of these)
	@tools/setup $(or $(PARTS),$(ALL_PARTS))

uninstall: ## remove what make install installed into PREFIX
	@DESTDIR='$(DESTDIR)' tools/install --remove '$(PREFIX)'

# The program, the Python package and what belongs to them
wheel: studio ## the program and mill as one file for pip: build/wheel (ARCH=arm64: for that machine)
	@tools/setup --local build --python core study dem share
	@$(MAKE) $(PARALLEL) millsim
	@.venv/bin/python tools/wheel $(ARCH:%=--arch %)

# of the commit that is checked out; ARCHES: of the wheels
ARCHES := amd64 arm64
release: ## source archive, wheels, site and check sums of a version, each tried: build/release-VERSION
	@tools/setup --local build --python core study dem share docs
	@tools/release $(ARCHES)

tell-version:
	@echo '$(VERSION)'

.PHONY: deps uninstall wheel release tell-version

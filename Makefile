# millsim: `make` builds ./millsim; `make help` lists the rest.
MODE ?= release
BUILD := build/$(MODE)
CC ?= cc
PKGS := gsl hdf5 udunits inih

CFLAGS_release := -O3 -g
CFLAGS_debug := -O0 -g
CFLAGS_asan := -O1 -g -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all
LDFLAGS_asan := -fsanitize=address,undefined
WARN := -Wall -Wextra -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Wundef -Wvla -Wdouble-promotion $(if $(WERROR),-Werror)
# no contraction, no fast-math: the same deck gives the same bits
CFLAGS += -std=c99 -D_POSIX_C_SOURCE=200809L -ffp-contract=off -fno-math-errno $(WARN) $(CFLAGS_$(MODE)) -Iinclude -Isrc
CFLAGS += $(shell pkg-config --cflags gsl hdf5 inih 2>/dev/null)
LDLIBS := $(shell pkg-config --libs gsl hdf5 inih 2>/dev/null) -ludunits2 -lm
LDFLAGS += $(LDFLAGS_$(MODE))

LIB := $(filter-out $(BUILD)/src/main.o,$(patsubst %.c,$(BUILD)/%.o,$(wildcard src/*.c)))
UNIT := $(patsubst %.c,$(BUILD)/%,$(wildcard tests/unit/test_*.c))

all: millsim

millsim: $(BUILD)/src/main.o $(LIB)
	$(CC) $(LDFLAGS) -o $@ $^ $(LDLIBS)

$(BUILD)/%.o: %.c
	@mkdir -p $(@D)
	$(CC) $(CFLAGS) -MMD -MP -c -o $@ $<

$(BUILD)/tests/unit/%: $(BUILD)/tests/unit/%.o $(LIB)
	$(CC) $(LDFLAGS) -o $@ $^ $(LDLIBS) $(shell pkg-config --libs check)

unit: $(UNIT)
	@set -e; for t in $^; do $$t; done

clean:
	rm -rf build millsim

-include $(shell find build -name '*.d' 2>/dev/null)
.SECONDARY:
.PHONY: all unit clean

# MODE: how the program is built, besides `release` and `debug` of the Makefile
ifeq ($(MODE),clang)
CC := clang-14
endif
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

# MODE=static, the program of a wheel: in it is all but the C library
CFLAGS_static := $(CFLAGS_release)
STRIP ?= strip
STATIC_hdf5 := hdf5 sz aec z
STATIC_udunits2 := udunits2 expat
archives = $(patsubst %,-l:lib%.a,$(or $(STATIC_$(1)),$(1)))
WITHIN := -lhdf5 -ludunits2 -lgsl -lgslcblas
LDLIBS_STATIC = $(foreach l,$(LDLIBS),$(if $(filter $(WITHIN),$(l)),$(call archives,$(l:-l%=%)),$(l))) -ldl
LINK_static = $(CC) $(ALL_LDFLAGS) -o $@.whole $^ $(LDLIBS_STATIC) && $(STRIP) -o $@ $@.whole

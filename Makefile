# One command does all: it makes .venv, compiles the core and goes on from there.
PYTHON ?= python3
BIN := .venv/bin
EXPORTED = src/oncenter/export/c/oncenter_ecu.c $(wildcard src/oncenter/export/fmi/*.c)
C_FILES = $(wildcard core/*.c src/oncenter/simulate/native/*.c)
C_HEADERS = $(wildcard core/*.h src/oncenter/simulate/native/*.h)
BUILDERS = setup.py liboncenter.py
INCLUDES = -Icore
CORE_TESTS = $(wildcard tests/test_core_*.py) $(addprefix tests/test_,wheel_speed_method.py angle.py message.py)
OFFSET_TESTS = $(addprefix tests/test_,estimate.py findings.py budget.py signals_at_fault.py)
# What enters C code of ours runs with sanitizers, all else without: each test once.
SANITIZED = $(CORE_TESTS) $(wildcard tests/test_simulate*.py) $(addprefix tests/test_,estimate.py oracle.py tandem.py)
PYTEST = -m pytest -q -n auto --dist worksteal
WARNINGS = -std=c99 -O2 -ffp-contract=off -Wall -Wextra -Wconversion -Werror

# What Debian parts from python3 and gcc. Without ensurepip, venv fails and leaves a half-made .venv behind.
DEBIAN = python3-venv gcc libc6-dev
HAS_PYTHON = $(PYTHON) -c 'import ensurepip' 2>/dev/null
HAS_C = echo '\#include <stdlib.h>' | $(CC) -fsyntax-only -xc - 2>/dev/null

HAS_FUZZER = echo 'int LLVMFuzzerTestOneInput(const char *d, long n) { return d[n - n]; }' | \
	clang -fsanitize=fuzzer -xc - -o /dev/null 2>/dev/null
HAS_ARM = command -v qemu-system-arm >/dev/null && \
	echo '\#include <math.h>' | arm-none-eabi-gcc -fsyntax-only -xc - 2>/dev/null

# $(call need,test,packages): as root on Debian it installs them; elsewhere it names them and stops.
need = { $(1); } || { [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && echo "installing $(2)" && \
	apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends $(2) \
	>/dev/null </dev/null; } && { $(1); } || { echo "needs $(2): sudo apt-get install $(2)" >&2; exit 1; }

.PHONY: help demo quick test lint types warnings cppcheck sanitize pytest slow coverage fuzz embedded bench accuracy lock clean
.DEFAULT_GOAL := help

help: ## show this
	@sed -nE 's/^([a-z]+):.*## (.*)/make \1|\2/p' $(MAKEFILE_LIST) | while IFS='|' read -r verb does; do \
	  printf '%-14s %s\n' "$$verb" "$$does"; done

demo: .venv/ready ## simulate a drive, find the offset, write demo/report.html
	@$(BIN)/oncenter demo

quick: lint types ## after each change: ruff, mypy, the tests of the core and of the answer
	$(BIN)/python $(PYTEST) -m "not slow" $(CORE_TESTS) $(OFFSET_TESTS)

test: .venv/ready ## all checks, all tests but the slow ones, each bench for a moment
	@$(MAKE) --no-print-directory -j2 -Otarget lint types warnings cppcheck build/sanitize/lib
	@$(MAKE) --no-print-directory sanitize pytest

lint: .venv/ready
	$(BIN)/ruff check .

types: .venv/ready
	$(BIN)/mypy --strict src

warnings: .venv/ready
	@set -e; for file in $(C_FILES) $(EXPORTED); do echo "$(CC) $(WARNINGS) $$file"; \
	  $(CC) $(WARNINGS) $(INCLUDES) -c $$file -o /dev/null; done

cppcheck:
	@$(call need,command -v cppcheck >/dev/null,cppcheck)
	cppcheck -q --std=c99 --enable=warning,style,performance,portability --error-exitcode=1 $(INCLUDES) $(C_FILES) $(EXPORTED)
	$(PYTHON) embedded/misra.py

# A second copy of the package, compiled with the sanitizers, comes first on the path. -fno-wrapv: Python's own
# -fwrapv would hide overflows.
build/sanitize/lib: .venv/ready $(wildcard src/oncenter/*.py src/oncenter/*/*.py src/oncenter/*/*/*.py)
	rm -rf build/sanitize
	CFLAGS="-g -fsanitize=address,undefined -fno-sanitize-recover=all -fno-wrapv" \
	  $(BIN)/python setup.py -q build --build-base build/sanitize --build-lib build/sanitize/lib
	@touch $@

sanitize: build/sanitize/lib ## the tests that enter C, with address and undefined-behaviour sanitizers in it
	LD_PRELOAD="$$($(CC) -print-file-name=libasan.so) $$($(CC) -print-file-name=libstdc++.so.6)" \
	  ASAN_OPTIONS=detect_leaks=0 PYTHONPATH=build/sanitize/lib \
	  $(BIN)/python $(PYTEST) -p no:cacheprovider -m "not slow" $(SANITIZED)

pytest: .venv/ready
	$(BIN)/python $(PYTEST) -m "not slow" $(addprefix --ignore=,$(SANITIZED))

slow: .venv/ready ## the slow tests: poisoned fleets, full disks, hostile and damaged logs, the accuracy bench
	$(BIN)/python -m pytest -q -m slow

# Without inlining, lest a function's branches count for each of its callers.
coverage: .venv/ready ## which branches of the core its tests take
	rm -rf build/coverage
	CFLAGS="--coverage -fno-inline -fno-early-inlining" \
	  $(BIN)/python setup.py -q build --build-base build/coverage --build-lib build/coverage/lib
	PYTHONPATH=build/coverage/lib $(BIN)/python -m pytest -q -p no:cacheprovider $(CORE_TESTS)
	$(BIN)/python embedded/coverage.py build/coverage

fuzz: .venv/ready ## the core by random bytes (FUZZ_S=600 s), then the readers by damaged logs (FUZZ_LOGS=500 a format)
	@$(call need,$(HAS_FUZZER),clang libclang-rt-dev)
	sh embedded/fuzz/run $(or $(FUZZ_S),600)
	$(BIN)/python tests/fuzz_logs.py --mutations $(or $(FUZZ_LOGS),500) --jobs 2

embedded: .venv/ready ## the core on two emulated microcontrollers: the same bits, and what it costs
	@$(call need,$(HAS_ARM),gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm)
	$(BIN)/python embedded/table.py

bench: .venv/ready ## speed, side by side with scipy, numba and python-can
	$(BIN)/python bench/speed.py --readme
	$(BIN)/python bench/speed_page.py --page

accuracy: .venv/ready ## errors, intervals and times of all methods and rivals, real-truck effects: docs/accuracy.md
	$(BIN)/python bench/accuracy.py --page --jobs 2
	$(BIN)/python bench/effects.py --page --jobs 2
	$(BIN)/python bench/two_parts.py --page --jobs 2

lock: .venv/python ## pin today's newest dependencies in requirements.lock and list their licences
	rm -rf build/lock
	$(PYTHON) -m venv build/lock
	build/lock/bin/python -m pip install -q --disable-pip-version-check -e '.[dev]'
	build/lock/bin/python -m pip freeze --all --exclude-editable --exclude pip > build/lock/requirements
	cp build/lock/requirements requirements.lock
	build/lock/bin/python docs/make_licences.py

clean: ## remove what make made, .venv too
	rm -rf .venv build dist demo .pytest_cache .mypy_cache .ruff_cache .hypothesis .benchmarks
	rm -rf src/*.egg-info src/oncenter/liboncenter.* src/oncenter/_declarations.py

.venv/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "needs Python 3.11 or later: make PYTHON=python3.11" >&2; exit 1; }
	@$(call need,$(HAS_PYTHON) && $(HAS_C),$(DEBIAN))
	$(PYTHON) -m venv --clear .venv
	@touch $@

# The build tools first, from the lock as well: an isolated build would not heed it.
.venv/tools: .venv/python requirements.lock
	$(BIN)/python -m pip install -q --disable-pip-version-check -c requirements.lock 'setuptools>=77' cffi
	@touch $@

.venv/ready: .venv/tools pyproject.toml $(BUILDERS) $(C_FILES) $(C_HEADERS)
	$(BIN)/python -m pip install -q --disable-pip-version-check --no-build-isolation -c requirements.lock -e '.[dev]'
	@touch $@

# Each target makes .venv and compiles the core first, if needed.
PYTHON ?= python3
BIN := .venv/bin
# If it is set, each of some thousand processes of the tests compiles all its modules.
unexport PYTHONDONTWRITEBYTECODE
# Without byte code: most modules are never imported, and Python compiles the others at their first import.
PIP = -m pip install --disable-pip-version-check --no-compile --progress-bar off
# Exactly the files whose hashes a lock has, and no others.
LOCKED = $(PIP) --no-deps --require-hashes
# said=$$(PIP …) $(OR_SAY_WHY): quiet, unless it fails. `pip -q` does not say which packages are in conflict.
OR_SAY_WHY = || { printf '%s\n' "$$said" | grep -vE '^ *(Collecting|Downloading|Using cached|Requirement already)' >&2; exit 1; }
EXPORTED = $(addprefix src/oncenter/export/c/,oncenter_ecu.c j1939.c offset_only.c) $(wildcard src/oncenter/export/fmi/*.c)
C_FILES = $(wildcard core/*/*.c src/oncenter/simulate/native/*.c src/oncenter/truck/native/*.c)
C_HEADERS = $(wildcard core/*/*.h src/oncenter/simulate/native/*.h src/oncenter/truck/native/*.h)
BUILDERS = setup.py liboncenter.py
INCLUDES = $(patsubst %/,-I%,$(wildcard core/*/))
CORE_TESTS = $(wildcard tests/test_core_*.py) $(addprefix tests/test_,wheel_speed_method.py angle.py message.py)
# Of what a change usually breaks: the core, the answer and its verdict, the common formats, what the pages say of the code.
QUICK = $(filter-out %/test_angle.py %/test_message.py,$(CORE_TESTS)) $(addprefix tests/test_,budget.py checks.py \
	compare.py correction.py equations.py estimate.py generated.py house.py plausibility.py project_files.py read_clock.py \
	read_formats.py read_j1939.py read_tables.py signals_at_fault.py simulate.py simulate_truck.py vehicle.py \
	vehicle_file.py verdict.py)
PYTEST = -m pytest -q -n auto --dist worksteal
SLOW = ONCENTER_NO_SKIPS=1 $(BIN)/python -m pytest -q -n auto --dist loadgroup -m slow
# The slow tests of a part of the night each; all others are of the part `slow`.
DAMAGED = $(addprefix tests/test_,fleet_poison.py fuzz_logs.py hostile_logs.py mutated_files.py)
BENCHES = tests/test_benches.py
PAGES = tests/test_docs_code.py
ON_OTHERS = $(PYTEST) -p no:cacheprovider -o faulthandler_timeout=120 -o faulthandler_exit_on_timeout=true \
	-m "system and not slow"
MACOS_TESTS = $(addprefix tests/test_,child.py file_name.py live_bus.py live_kept.py whole_file.py)
WARNINGS = -std=c99 -O2 -ffp-contract=off -Wall -Wextra -Wconversion -Werror

# Debian packages: DEBIAN_BASE for every target that makes .venv, DEBIAN_X for `make X` too. If root runs make on Debian,
# it installs them. Otherwise one line names all that are missing for the targets typed, before anything is downloaded.
DEBIAN_BASE = python3 python3-venv gcc libc6-dev
DEBIAN_cppcheck = cppcheck
DEBIAN_test = $(DEBIAN_cppcheck) g++
DEBIAN_browser = chromium poppler-utils
DEBIAN_tests = g++ $(DEBIAN_browser)
DEBIAN_slow = $(DEBIAN_browser)
DEBIAN_benches = chromium g++
DEBIAN_pages = $(DEBIAN_browser)
DEBIAN_load = chromium
DEBIAN_generated = chromium
DEBIAN_sanitize = g++
DEBIAN_fuzz = clang libclang-rt-dev
# Those of all of .ci/run, which begins with it.
DEBIAN_beside = $(DEBIAN_test) $(DEBIAN_browser) $(DEBIAN_embedded)
DEBIAN_embedded = gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm
# They run or load the binaries that zig compiles; ecos needs libtbb12.
DEBIAN_fmu = wine64 qemu-user libc6-arm64-cross libtbb12
DEBIAN_fresh = mmdebstrap
DEBIAN_zip = wine wine64
DEBIAN_wheels = qemu-user wine wine64 musl mmdebstrap
needed = $(sort $(DEBIAN_BASE) $(foreach target,$(MAKECMDGOALS),$(DEBIAN_$(target))))

# has_NAME: the machine has what the package NAME installs, from any source. A build needs headers, not only a compiler.
finds_header = echo '\#include <$(2)>' | $(1) -fsyntax-only -xc -
has_python3 = command -v $(PYTHON)
has_python3-venv = $(PYTHON) -c 'import ensurepip'
has_gcc = command -v $(CC)
has_libc6-dev = $(call finds_header,$(CC),stdlib.h)
has_g++ = command -v g++
has_cppcheck = command -v cppcheck
has_chromium = command -v chromium || command -v chromium-browser || command -v google-chrome
has_poppler-utils = command -v pdftotext
has_clang = command -v clang
has_libclang-rt-dev = echo 'int LLVMFuzzerTestOneInput(const char *d, long n) { return d[n - n]; }' | \
	clang -fsanitize=fuzzer -xc - -o /dev/null
has_gcc-arm-none-eabi = command -v arm-none-eabi-gcc
has_libnewlib-arm-none-eabi = $(call finds_header,arm-none-eabi-gcc,math.h)
has_qemu-system-arm = command -v qemu-system-arm
has_qemu-user = command -v qemu-aarch64
has_wine = command -v wine
has_wine64 = PATH="$$PATH:/usr/lib/wine" command -v wine64
has_libc6-arm64-cross = test -d /usr/aarch64-linux-gnu
has_libtbb12 = ls /usr/lib/*/libtbb.so.12
has_musl = ls /lib/ld-musl-*.so.1
has_mmdebstrap = command -v mmdebstrap
missing = $(foreach package,$(needed),{ $(has_$(package)); } >/dev/null 2>&1 || printf ' $(package)';)

.PHONY: help packages demo quick test tests night lint types elsewhere types-win32 types-darwin beside warnings cppcheck \
	sanitize sanitize-core slow damaged benches pages portable browser coverage faults fuzz embedded fmu wheels zip bench accuracy load generated written \
	docs sides fresh lock audit lowest matrix clean
.DEFAULT_GOAL := help

help: ## list all targets
	@sed -nE 's/^([a-z]+):.*## (.*)/make \1|\2/p' $(MAKEFILE_LIST) | while IFS='|' read -r verb does; do \
	  printf '%-14s %s\n' "$$verb" "$$does"; done

packages:
	@missing=$$($(missing)); \
	if [ -n "$$missing" ] && [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  echo "installing$$missing"; \
	  { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends $$missing; } \
	    >/dev/null </dev/null; \
	  missing=$$($(missing)); \
	fi; \
	[ -z "$$missing" ] || { echo "missing$$missing; on Debian:" \
	  "sudo apt-get update && sudo apt-get install -y --no-install-recommends$$missing" >&2; exit 1; }

demo: .venv/ready ## simulate a drive, estimate the offset, write demo/report.html
	@$(BIN)/oncenter demo

quick: lint types ## after each change, in a minute: ruff, typos, mypy, the tests of what a change usually breaks
	$(BIN)/python $(PYTEST) -m "not slow and not browser" $(QUICK)

test: .venv/dev ## before each commit, in five minutes: all checks and tests that are not slow
	@$(MAKE) --no-print-directory -j2 -Otarget lint types warnings cppcheck
	$(BIN)/python $(PYTEST) -m "not slow and not browser"

# In one run: while a browser draws, other tests compute.
tests: .venv/dev ## all tests that are not slow, and those with a browser
	$(BIN)/python $(PYTEST) -m "not slow"

night: .venv/dev ## everything else, in parts of an hour: make night PART=fuzz; docs/checks.md has their results
	$(BIN)/python .ci/night.py $(PART)

lint: .venv/dev ## ruff, typos, and zizmor for the workflow
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/typos
	$(BIN)/zizmor --offline --quiet --strict-collection .github

types: .venv/dev
	$(BIN)/mypy --strict src

# mypy reports modules and functions that a platform does not have.
elsewhere: types-win32 types-darwin ## the types as for Windows and macOS

types-win32 types-darwin: types-%: .venv/dev
	$(BIN)/mypy --strict --platform $* --cache-dir .mypy_cache/$* src

# Of the other systems' types Windows' alone: macOS differs little from Linux, and the night has both.
# While pip downloads and unpacks, the other core checks and compiles.
beside: .venv/dev cppcheck warnings build/sanitize/lib embedded lint types types-win32 ## what .ci/run has besides tests

warnings: packages
	@set -e; for file in $(C_FILES) $(EXPORTED); do echo "$(CC) $(WARNINGS) $$file"; \
	  $(CC) $(WARNINGS) $(INCLUDES) -c $$file -o /dev/null; done

cppcheck: packages
	cppcheck -q --std=c99 --enable=warning,style,performance,portability --suppress=normalCheckLevelMaxBranches \
	  --error-exitcode=1 $(INCLUDES) $(C_FILES) $(EXPORTED)
	$(PYTHON) embedded/misra.py

# A second copy of the package, compiled with the sanitizers, comes first on the path. -fno-wrapv: Python's own
# -fwrapv would hide overflows.
build/sanitize/lib: .venv/ready $(wildcard src/oncenter/*.py src/oncenter/*/*.py src/oncenter/*/*/*.py)
	rm -rf build/sanitize
	CFLAGS="-g -fsanitize=address,undefined -fno-sanitize-recover=all -fno-wrapv" \
	  $(BIN)/python setup.py -q build --build-base build/sanitize --build-lib build/sanitize/lib
	@touch $@

sanitize-core: SANITIZED = $(CORE_TESTS)
sanitize-core: AT_NIGHT = and not long
sanitize sanitize-core: .venv/dev build/sanitize/lib
	LD_PRELOAD="$$($(CC) -print-file-name=libasan.so) $$($(CC) -print-file-name=libstdc++.so.6)" \
	  ASAN_OPTIONS=detect_leaks=0 PYTHONPATH=build/sanitize/lib \
	  $(BIN)/python $(PYTEST) -p no:cacheprovider -m "not slow and not browser $(AT_NIGHT)" $(SANITIZED)

slow: .venv/dev
	$(SLOW) $(addprefix --ignore=,$(DAMAGED) $(BENCHES) $(PAGES))

damaged: .venv/dev
	$(SLOW) $(DAMAGED)

benches: .venv/dev
	$(SLOW) $(BENCHES)

pages: .venv/dev
	$(SLOW) $(PAGES)

# Only oncenter takes this machine for Windows or macOS. A test that hangs ends the run.
portable: .venv/dev ## tests of files, processes and buses, with Windows and macOS imitated (tests/elsewhere)
	ONCENTER_AS=win32 PYTHONPATH=$(CURDIR)/tests/elsewhere $(BIN)/python $(ON_OTHERS) $$(grep -l mark.system tests/test_*.py)
	ONCENTER_AS=darwin PYTHONPATH=$(CURDIR)/tests/elsewhere $(BIN)/python $(ON_OTHERS) $(MACOS_TESTS)

browser: .venv/dev ## the pages in a browser: live page, report and its PDF, angle, fleet, thesis, docs site
	$(BIN)/python $(PYTEST) -m "browser and not slow" $$(grep -l mark.browser tests/test_*.py)

# Without inlining: an inlined function's branches would count once for each of its callers.
coverage: .venv/dev ## the branches of the core that its tests take
	rm -rf build/coverage
	CFLAGS="--coverage -fno-inline -fno-early-inlining" \
	  $(BIN)/python setup.py -q build --build-base build/coverage --build-lib build/coverage/lib
	PYTHONPATH=build/coverage/lib $(BIN)/python -m pytest -q -p no:cacheprovider $(CORE_TESTS)
	$(BIN)/python embedded/coverage.py build/coverage

faults: .venv/dev ## 40 planted faults: does a check catch each? Within an hour; a stopped round goes on: docs/faults.md
	$(BIN)/python faults/run.py

fuzz: .venv/dev ## random bytes into the core (FUZZ_S=600 s), then damaged logs into the readers (FUZZ_LOGS=500 a format)
	sh embedded/fuzz/run $(or $(FUZZ_S),600)
	$(BIN)/python tests/fuzz_logs.py --mutations $(or $(FUZZ_LOGS),500) --jobs 2

embedded: .venv/ready ## the core on two emulated microcontrollers: the same bits, and its cost
	$(BIN)/python embedded/table.py

fmu: .venv/dev ## the FMU's other platforms in emulators, bit by bit, and two further importers
	@said=$$($(BIN)/python $(PIP) 'ziglang>=0.17' 'libcosimpy>=0.0.6' 'ecospy>=0.7') $(OR_SAY_WHY)
	ONCENTER_NO_SKIPS=1 $(BIN)/python -m pytest -q tests/test_export_fmu_platforms.py tests/test_export_fmu_importers.py

fresh: packages ## the README's commands on bare Debian systems (DEBIAN=bookworm|trixie, AS=root|user: one alone): docs/platforms.md
	$(PYTHON) .ci/fresh.py $(DEBIAN) $(AS)

wheels: .venv/dev build/wheels/ready ## dist/: sdist, a wheel for each platform, checked where it can run, and SBOMs
	rm -rf dist
	build/wheels/bin/python wheels/build.py dist
	build/wheels/bin/python wheels/check.py dist
	$(BIN)/python wheels/sbom.py dist

# WINDOWS_PYTHON: the file that wheels/windows_zip.py names, from python.org. Without it a person adds it.
zip: build/wheels/ready ## dist/: a zip for Windows with all wheels and install.cmd, checked; WINDOWS_PYTHON=FILE adds Python
	build/wheels/bin/python wheels/windows_zip.py dist $(WINDOWS_PYTHON)
	build/wheels/bin/python wheels/windows_check.py dist

build/wheels/ready: wheels/requirements.txt | packages
	$(PYTHON) -m venv --clear build/wheels
	@said=$$(build/wheels/bin/python $(LOCKED) -r wheels/requirements.txt) $(OR_SAY_WHY)
	@touch $@

bench: .venv/dev ## speed of the core, and of logs side by side with python-can
	$(BIN)/python bench/speed.py --readme
	$(BIN)/python bench/speed_page.py --page

accuracy: .venv/dev ## errors and intervals of all methods and rivals: docs/accuracy.md, angle.md, method.md, truck_over_time_figures.md, fleet_figures.md
	$(BIN)/python bench/accuracy.py --page --jobs 2
	$(BIN)/python bench/effects.py --page --jobs 2
	$(BIN)/python bench/two_parts.py --page --jobs 2
	$(BIN)/python bench/compare.py --page --jobs 2
	$(BIN)/python bench/angle.py --page
	$(BIN)/python bench/angle_lag.py --page --jobs 2
	$(BIN)/python bench/gyro_bias.py --page
	rm -rf build/trucks
	$(BIN)/python bench/trucks.py build/trucks --page --jobs 2
	$(BIN)/python bench/drives_that_differ.py --page --jobs 2
	rm -rf build/one_truck
	$(BIN)/python bench/one_truck.py build/one_truck --page --jobs 2
	$(BIN)/python bench/noisy_logs.py build/noisy_logs --page --jobs 2
	rm -rf build/fleet_priors
	$(BIN)/python bench/fleet_priors.py build/fleet_priors --page --jobs 2
	$(BIN)/python bench/fleet_pulls.py --page --jobs 2

load: .venv/dev ## a night of a fleet and ten minutes of a live bus: docs/fleet_figures.md, docs/live.md
	rm -rf build/fleet
	$(BIN)/python bench/fleet.py build/fleet --page
	$(BIN)/python bench/live.py --page --seconds 600
	$(BIN)/python bench/live.py --page --seconds 600 --crowd

# The core's tables first, since the core is compiled with them; then what the program says of itself, draws and prints.
generated: written ## renew all that a script writes: the core's tables, reference, pictures, outputs in the docs
	@$(MAKE) --no-print-directory demo
	$(BIN)/python docs/make_picture.py
	$(BIN)/python docs/make_live.py
	$(BIN)/python docs/make_verdicts.py
	$(BIN)/python docs/make_how_it_works.py
	$(BIN)/python docs/make_many_drives.py
	$(BIN)/python docs/make_play.py
	$(BIN)/python docs/run_code.py --write

# Without .venv/dev at first: with the old tables the core may not compile.
written: .venv/tools ## of these the ones that take seconds and need no browser
	$(BIN)/python docs/make_params.py
	$(BIN)/python docs/make_layout.py
	$(BIN)/python docs/make_structs.py
	$(BIN)/python docs/make_contents.py
	@$(MAKE) --no-print-directory .venv/dev
	$(BIN)/python docs/make_reference.py
	$(BIN)/python docs/make_formats.py
	$(BIN)/python docs/make_fmu_table.py
	$(BIN)/python faults/page.py

# Only for a newer map, or where a country changes its side: MAP is countries-10m.json of the npm package world-atlas.
sides: .venv/tools ## the table of the sides of traffic, from a map: make sides MAP=countries-10m.json
	$(BIN)/python docs/make_traffic_sides.py $(MAP)

docs: .venv/dev ## the docs site, build/site/index.html: opens without a server and without a network
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

# For each Python that pyproject.toml allows and each platform. The licences are those of all their packages.
PIN = build/uv/bin/uv pip compile -q --universal --python-version 3.11 --fork-strategy fewest --generate-hashes \
	--no-annotate --no-emit-index-url --custom-compile-command 'make lock'
lock: packages ## pin the newest packages, with the hashes of their files, and list their licences
	rm -rf build/uv build/lock
	$(PYTHON) -m venv build/uv
	@said=$$(build/uv/bin/python $(PIP) 'uv>=0.13') $(OR_SAY_WHY)
	$(PIN) --upgrade --extra dev pyproject.toml -o requirements.lock
	echo 'setuptools>=77' | $(PIN) --upgrade -c requirements.lock --extra report pyproject.toml - -o requirements.demo.lock
	$(PIN) --upgrade wheels/requirements.in -o wheels/requirements.txt
	sed 's/ ; .*/ \\/' requirements.lock >build/uv/requirements.all
	@said=$$(build/uv/bin/python $(LOCKED) --target build/lock --only-binary :all: -r build/uv/requirements.all) $(OR_SAY_WHY)
	PYTHONPATH=build/lock $(PYTHON) docs/make_licences.py

# An editable install, so the core that it compiles is the same file that .venv uses.
LOWEST_TESTS = $(addprefix tests/test_,cli.py dataframe.py read_tables.py read_blf.py report.py vehicle.py simulate.py \
	budget.py estimate.py core_save.py memory.py live.py fleet_tables.py fleet_trucks.py)
LOWEST_MF4_TESTS = $(addprefix tests/test_,extras.py read_formats.py read_bad_input.py read_runs_no_code.py \
	simulate_logs.py vehicle_dbc.py)
MATRIX = 3.11 3.12 3.13
# A Python of that version: pyenv's, or on the path.
python_of = $$(ls -d ~/.pyenv/versions/$(1).*/bin/python3 2>/dev/null | grep . || command -v python$(1))

audit: build/audit/ready ## known vulnerabilities of the locked packages, where the advisories can be reached
	build/audit/bin/python .ci/audit.py requirements.lock wheels/requirements.txt

build/audit/ready: | packages
	$(PYTHON) -m venv --clear build/audit
	@said=$$(build/audit/bin/python $(PIP) 'pip-audit>=2.10') $(OR_SAY_WHY)
	@touch $@

lowest: packages ## tests with the lowest versions that pyproject.toml allows (requirements.lowest)
	@$(MAKE) --no-print-directory lowest-$$($(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])')

matrix: packages ## tests with the lowest and the newest versions on each installed Python of 3.11, 3.12, 3.13
	@set -e; for version in $(MATRIX); do \
	  test -n "$(call python_of,$$version)" || { echo "Python $$version is not installed: left out"; continue; }; \
	  $(MAKE) --no-print-directory lowest-$$version newest-$$version; done

lowest-%:
	rm -rf build/lowest-$*
	$(call python_of,$*) -m venv build/lowest-$*
	@said=$$(build/lowest-$*/bin/python $(PIP) -c requirements.lowest 'setuptools>=77' cffi) $(OR_SAY_WHY)
	@said=$$(build/lowest-$*/bin/python $(PIP) -c requirements.lowest --no-build-isolation -e '.[can,live,report,thesis]' \
	  blake3 pyarrow hypothesis packaging pytest pytest-xdist scipy) $(OR_SAY_WHY)
	build/lowest-$*/bin/python $(PYTEST) -p no:cacheprovider -m "not slow" $(LOWEST_TESTS)
	grep -v '^numpy' requirements.lowest >build/lowest-$*/mf4
	@said=$$(build/lowest-$*/bin/python $(PIP) -c build/lowest-$*/mf4 asammdf h5py rosbags 'numpy<2.2') $(OR_SAY_WHY)
	build/lowest-$*/bin/python $(PYTEST) -p no:cacheprovider -m "not slow" $(LOWEST_MF4_TESTS)

newest-%:
	rm -rf build/newest-$*
	$(call python_of,$*) -m venv build/newest-$*
	@said=$$(build/newest-$*/bin/python $(PIP) 'setuptools>=77' cffi) $(OR_SAY_WHY)
	@said=$$(build/newest-$*/bin/python $(PIP) --no-build-isolation -e '.[dev]') $(OR_SAY_WHY)
	build/newest-$*/bin/python $(PYTEST) -p no:cacheprovider -m "not slow"

clean: ## remove everything that make wrote, .venv too
	rm -rf .venv build dist demo .pytest_cache .mypy_cache .ruff_cache .hypothesis
	rm -rf src/*.egg-info src/oncenter/liboncenter.* src/oncenter/_declarations.py

.venv/python: | packages
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "needs Python 3.11 or later: make PYTHON=python3.11" >&2; exit 1; }
	@echo "making .venv"
	@$(PYTHON) -m venv --clear .venv
	@touch $@

# With setuptools and cffi, which compile the core: an isolated build would ignore the lock.
.venv/tools: .venv/python requirements.demo.lock
	@echo "installing the packages of an answer and its report: some 30 packages, 340 MB"
	@said=$$($(BIN)/python $(LOCKED) -r requirements.demo.lock) $(OR_SAY_WHY)
	@touch $@

# For the demo: a base install and the report.
.venv/ready: .venv/tools pyproject.toml $(BUILDERS) $(C_FILES) $(C_HEADERS)
	@echo "compiling the core"
	@said=$$($(BIN)/python $(PIP) --no-deps --no-build-isolation -e .) $(OR_SAY_WHY)
	@touch $@

# All extras, and the packages of tests, benches and checks.
.venv/dev: .venv/packages .venv/ready
	@touch $@

.venv/packages: .venv/tools requirements.lock
	@echo "installing all extras and what the tests need: some 130 packages, 1.9 GB"
	@said=$$($(BIN)/python $(LOCKED) -r requirements.lock) $(OR_SAY_WHY)
	@touch $@

# make run · make test · make bench · make lint: each makes .venv and builds the package first.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
CORES ?= all
KERNEL_FILES := $(wildcard kernels/include/pbrdf/*.hpp kernels/src/*.cpp kernels/bindings/*) kernels/topic_digests.py

.DELETE_ON_ERROR:
.PHONY: run capture recalibrate test test-fast test-workflow test-faults test-sanitize test-slurm test-large growth fuzz bench accuracy lint format lock envs dist picture scatmech clean

run: $(VENV)/kernels
	$(BIN)/snakemake --cores $(CORES)

# Calibrations made again: where they come out the same, `make run` has nothing to do after it.
CALIBRATING := calibrate_camera calibrate_polarimeter calibrate_lights calibrate_flat calibrate_radiometry locate_sphere \
	take_calibration take_flat take_sphere
recalibrate: $(VENV)/kernels
	$(BIN)/snakemake --cores $(CORES) calibrations --forcerun $(CALIBRATING)

# Photographs alone: after it, `make run` works on what is new and on nothing else.
capture: $(VENV)/kernels
	$(BIN)/snakemake --cores $(CORES) capture

test: $(VENV)/kernels $(VENV)-oracles/packages
	$(BIN)/pytest --numprocesses 2 --dist loadgroup --no-loadscope-reorder

test-fast: $(VENV)/kernels
	$(BIN)/pytest -m "not workflow and not release"

test-workflow: $(VENV)/kernels
	$(BIN)/pytest -m workflow

# Captures killed at 200 random moments and runs at 100, where `make test` takes 10 of each.
test-faults: $(VENV)/kernels
	PBRDF_KILLS=200 $(BIN)/pytest tests/capture/test_killed.py tests/capture/test_faults.py
	PBRDF_KILLS=100 PBRDF_KILLS_TOLD=docs/kills.md $(BIN)/pytest tests/workflow/test_killed_runs.py tests/workflow/test_faults.py

# The kernels' tests under AddressSanitizer and UndefinedBehaviorSanitizer.
test-sanitize: $(VENV)-sanitize/kernels
	# unoptimised loops round alike in all versions
	sh tools/sanitized.sh $(VENV)-sanitize/bin/python -m pytest tests/kernels \
		--deselect tests/kernels/test_processor.py::test_versions_differ_in_the_last_bits

# A run on a SLURM cluster of one node; it needs Debian's slurm-wlm and munge, and root.
test-slurm: $(VENV)/kernels
	$(BIN)/pytest -m slurm

# One light of the paper's size, end to end; photographs in the folder LARGE are not taken again.
LARGE ?= build/large
test-large: $(VENV)/kernels
	PBRDF_LARGE=$(LARGE) $(BIN)/pytest tests/large

# Time and memory at several sizes: docs/growth.csv and docs/growth.svg.
growth: $(VENV)/kernels
	PYTHONPATH=tests/workflow $(BIN)/python tools/growth.py

# Hostile files for every reader, each for FUZZ_SECONDS; READERS=name for some of them.
FUZZ_SECONDS ?= 20
fuzz: $(VENV)/kernels
	$(BIN)/python tests/hostile/fuzz.py $(FUZZ_SECONDS) $(READERS)

# All of them, or with ONLY=name one.
bench: $(VENV)/kernels
	cd kernels && ../$(BIN)/python -m bench $(ONLY)

# Errors of tabulation by itself, at random directions: nearest light and bracketing lights.
accuracy: $(VENV)/kernels
	$(BIN)/python tools/tabulation_accuracy.py

lint: $(VENV)/kernels
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/clang-format --dry-run --Werror $$(git ls-files 'kernels/*.hpp' 'kernels/*.cpp')
	$(BIN)/snakefmt --check Snakefile workflow/rules
	$(BIN)/snakemake --lint

format: $(VENV)/kernels
	$(BIN)/ruff check --fix-only --quiet
	$(BIN)/ruff format
	$(BIN)/clang-format -i $$(git ls-files 'kernels/*.hpp' 'kernels/*.cpp')
	$(BIN)/snakefmt Snakefile workflow/rules

# The lock file holds every package with its hashes; uv writes it, pip reads it.
lock:
	$(PYTHON) -m venv $(VENV)-lock
	$(VENV)-lock/bin/pip install --quiet uv
	$(VENV)-lock/bin/uv pip compile pyproject.toml --extra dev --extra mitsuba --extra slurm --universal --python-version 3.11 \
		--generate-hashes --no-emit-index-url --no-header --upgrade --quiet -o requirements.lock
	rm -r $(VENV)-lock

envs: $(VENV)/kernels
	$(BIN)/python tools/conda_envs.py

# Wheel and source archive, each built in an environment of its own.
dist: $(VENV)/packages
	$(BIN)/python -m build --outdir dist

# The README's picture, from a finished `make run`.
picture: run
	$(BIN)/python tools/readme_picture.py

$(VENV)/packages: requirements.lock
	@sh tools/require-system.sh $(PYTHON)
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --disable-pip-version-check --require-hashes -r requirements.lock
	@touch $@

# Other people's drivers, against which the emulated instruments are held.
$(VENV)-oracles/packages: tests/oracles/instruments/requirements.txt | $(VENV)/packages
	$(PYTHON) -m venv $(VENV)-oracles
	$(VENV)-oracles/bin/pip install --disable-pip-version-check --no-deps --no-compile -r $< && touch $@ || \
		echo "pip cannot fetch other people's drivers: the tests against them are skipped"

# Builds NIST's library for some minutes; without it the test against it is skipped.
scatmech: $(VENV)-oracles/scatmech

$(VENV)-oracles/scatmech: tests/oracles/scatmech/requirements.txt | $(VENV)-oracles/packages
	$(VENV)-oracles/bin/pip install --disable-pip-version-check --no-deps --no-compile -r $<
	@touch $@

$(VENV)/kernels: $(VENV)/packages pyproject.toml CMakeLists.txt $(KERNEL_FILES)
	$(BIN)/pip install --disable-pip-version-check --no-build-isolation --no-deps --editable .
	@touch $@

# A second build in an environment of its own, which sees the packages of the first.
$(VENV)-sanitize/kernels: $(VENV)/packages pyproject.toml CMakeLists.txt $(KERNEL_FILES)
	$(BIN)/python -m venv --clear --without-pip $(VENV)-sanitize
	$(VENV)-sanitize/bin/python tools/see_packages.py $(BIN)/python
	PATH="$(abspath $(BIN)):$$PATH" $(VENV)-sanitize/bin/python -m pip install --disable-pip-version-check \
		--no-build-isolation --no-deps -C build-dir=build/sanitize -C cmake.define.PBRDF_SANITIZE=ON .
	@touch $@

clean:
	rm -rf $(VENV) $(VENV)-oracles $(VENV)-sanitize build dist .snakemake

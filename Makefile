# `make demo` and `make test` set up everything they need in .venv from the pinned versions of requirements.lock.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

export ROS_AUTOMATIC_DISCOVERY_RANGE ?= LOCALHOST
export MPLBACKEND ?= Agg
export OPENBLAS_NUM_THREADS ?= 1
# Where Python may keep no byte code each process translates two seconds' worth of libraries anew, and tests start hundreds.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test lint types kernels unit colcon floors other other-environment headers bench mutants docs real blind blind-ci lock clean help

help:  ## Show this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*##/ -/'

$(READY): requirements.lock setup.py package.xml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --quiet --disable-pip-version-check --no-input --no-compile \
		--require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --quiet --disable-pip-version-check --no-input --no-deps --no-build-isolation --editable .
	@touch $@

SEED ?= 1

demo: $(READY)  ## A rig with a hidden effect, two sessions, the diagnosis, the answer beside it (2 min; SEED=2 draws another)
	$(BIN)/pneumo demo --seed $(SEED)

test: $(READY)  ## Lint, types and every test
	$(MAKE) --jobs=2 --output-sync=target lint types kernels
	$(MAKE) unit

lint: $(READY)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: $(READY)
	$(BIN)/mypy

# What tests run, compiled once before several processes of theirs would each compile it (a minute on a fresh checkout).
kernels: $(READY)
	PYTHONPATH=test $(BIN)/python -m helpers.kernels

# Two processes share the files of tests; those of the clock have the computer to themselves afterwards.
WORKERS ?= 2
unit: $(READY)
	$(BIN)/python -m pytest -m "not realtime" --numprocesses $(WORKERS) --dist loadscope --no-loadscope-reorder
	$(BIN)/python -m pytest -m realtime

# A second environment with what Ubuntu 24.04 packages, and PyPI's colcon: as near to a sourced Jazzy as wheels come.
FLOORS := .venv-floors
FLOORS_READY := $(FLOORS)/.ready
COLCON := build/colcon
COLCON_ENV := PATH="$(CURDIR)/$(FLOORS)/bin:$$PATH" NUMBA_CACHE_DIR="$(CURDIR)/build/numba-floors"
COLCON_SPACES := --base-paths . --packages-select pneumo_ros --build-base $(COLCON)/build --install-base $(COLCON)/install
# Fast, and what ROS or a library's version can break: messages, codecs, logs, quality of service, kernels, verbs. Not
# Parquet: ROS has no package of it.
FAST ?= msg_tests test/plant test/estimation test/nodes/test_qos_overrides.py test/log/test_cdr.py test/log/test_writing.py \
	test/log/test_rosbag2_schema.py test/log/test_tools.py test/test_launch.py test/test_docs.py test/test_packaging.py

$(FLOORS_READY): floors.txt setup.py package.xml
	$(PYTHON) -m venv $(FLOORS)
	$(FLOORS)/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --constraint floors.txt \
		--editable '.[ros,test]' colcon-common-extensions
	$(FLOORS)/bin/python -m pip uninstall --quiet --yes pneumo_ros
	@touch $@

floors: $(FLOORS_READY)  ## The versions of Ubuntu 24.04 in an environment of their own

colcon: $(FLOORS_READY)  ## colcon build and colcon test of the fast part in that environment, the result counted (2 min)
	rm -rf $(COLCON)
	$(COLCON_ENV) colcon --log-base $(COLCON)/log build $(COLCON_SPACES)
	$(COLCON_ENV) colcon --log-base $(COLCON)/log test $(COLCON_SPACES) --return-code-on-test-failure \
		--event-handlers console_cohesion+ --pytest-args $(FAST) " -m" "not slow" " -k" "not parquet"
	$(COLCON_ENV) colcon test-result --test-result-base $(COLCON)/build
	. $(COLCON)/install/local_setup.sh && cd $(COLCON) && install/pneumo_ros/lib/pneumo_ros/pneumo --version
	@echo "A test that fails must make colcon test fail and be counted:"
	echo "def test_fails(): assert False" > $(COLCON)/test_fails.py
	! $(COLCON_ENV) colcon --log-base $(COLCON)/log test $(COLCON_SPACES) --return-code-on-test-failure \
		--test-result-base $(COLCON)/failed --pytest-args $(COLCON)/test_fails.py
	$(COLCON_ENV) colcon test-result --test-result-base $(COLCON)/failed | grep "1 test, 0 errors, 1 failure"

# An environment of its own for another Python, with the newest libraries it gets.
OTHER ?= python3.13
OTHERS = .venv-$(notdir $(patsubst %/bin/python,%,$(OTHER)))

other-environment:
	test -e $(OTHERS)/.ready || { $(OTHER) -m venv $(OTHERS) && \
		$(OTHERS)/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --editable '.[ros,test]' && \
		touch $(OTHERS)/.ready; }

other: other-environment  ## The fast part on another Python (OTHER=python3.13; 2 min)
	$(OTHERS)/bin/python -m pytest $(FAST) -m "not slow" -k "not parquet"

headers:  ## Add the SPDX line to source files that lack it
	$(PYTHON) .ci/headers.py

SPEED := kernel composed control_step reading replay lockstep

bench: $(READY)  ## Every speed, side by side with its limit
	for name in $(SPEED); do echo "== $$name"; $(BIN)/python bench/$$name.py || exit 1; done

# An environment of its own: what cosmic-ray brings along is no business of the package.
MUTANTS := .venv-mutants
MUTANTS_READY := $(MUTANTS)/.ready
MODULE ?= units

$(MUTANTS_READY): requirements.lock setup.py package.xml
	$(PYTHON) -m venv $(MUTANTS)
	$(MUTANTS)/bin/python -m pip install --quiet --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(MUTANTS)/bin/python -m pip install --quiet --quiet --disable-pip-version-check --no-build-isolation --editable '.[mutants]'
	@touch $@

mutants: $(MUTANTS_READY)  ## Small changes of MODULE (units, frames, safety ...) that no test notices; docs/mutants.md
	$(MUTANTS)/bin/python bench/mutants.py $(MODULE)

BLIND ?= build/blind

blind: $(READY)  ## The full blind check, 280 sealed cases (two hours on 2 cores); goes on where it was interrupted
	$(BIN)/pneumo blind make $(BLIND) --set full --workers $(WORKERS)
	$(BIN)/pneumo blind diagnose $(BLIND) --workers $(WORKERS)
	$(BIN)/pneumo blind score $(BLIND) --output docs/blind-results.md

blind-ci: $(READY)  ## Six blind cases, made and diagnosed anew, that must keep their verdicts (3 min)
	rm -rf $(BLIND)-ci
	$(BIN)/pneumo blind make $(BLIND)-ci --set ci --workers $(WORKERS)
	$(BIN)/pneumo blind diagnose $(BLIND)-ci --workers $(WORKERS)
	$(BIN)/pneumo blind score $(BLIND)-ci --expect test/data/blind-ci.json

REAL ?= ../shared/data/real

real: $(READY)  ## Other people's measurements in the folder REAL, diagnosed three times each
	$(BIN)/python bench/real_rigs.py $(REAL)

docs: $(READY)  ## Write the generated tables of docs/ anew
	$(BIN)/python -m pneumo_ros.cli.reference

lock:  ## Resolve requirements.lock anew for Python 3.10 to 3.13 (needs uv)
	uv pip compile setup.py --universal --python-version 3.10 --extra ros --extra cluster --extra fmu --extra parquet --extra view --extra dev \
		--generate-hashes --no-emit-index-url --no-annotate --no-header --output-file requirements.lock

clean:  ## Remove the virtual environment and what was built
	rm -rf $(VENV) $(FLOORS) $(MUTANTS) build *.egg-info bench/build

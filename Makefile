# `make demo` and `make test` set up everything they need in .venv from the pinned versions of requirements.lock.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

export ROS_AUTOMATIC_DISCOVERY_RANGE ?= LOCALHOST
export MPLBACKEND ?= Agg

.PHONY: demo test lint types unit bench docs blind blind-ci lock clean help

help:  ## Show this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*##/ -/'

$(READY): requirements.lock setup.py package.xml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

demo: $(READY)  ## A 20 s closed-loop session on a class D road: log, summary, picture
	$(BIN)/pneumo run --isolate --road D --duration 20

test: lint types unit  ## Lint, types and every test

lint: $(READY)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: $(READY)
	$(BIN)/mypy

unit: $(READY)
	$(BIN)/python -m pytest

SPEED := kernel composed control_step reading replay lockstep

bench: $(READY)  ## Every speed, side by side with its limit
	for name in $(SPEED); do echo "== $$name"; $(BIN)/python bench/$$name.py || exit 1; done

WORKERS ?= 2
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

docs: $(READY)  ## Write the generated tables of docs/ anew
	$(BIN)/python -m pneumo_ros.cli.reference

lock:  ## Resolve requirements.lock anew for Python 3.10 to 3.13 (needs uv)
	uv pip compile setup.py --universal --python-version 3.10 --extra ros --extra cluster --extra parquet --extra view --extra dev \
		--no-emit-index-url --no-annotate --no-header --output-file requirements.lock

clean:  ## Remove the virtual environment and what was built
	rm -rf $(VENV) build *.egg-info bench/build

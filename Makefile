# `make` lists the targets. Every target that runs something sets up first what it needs.
#
# PYTHON        interpreter that the environment is made with, 3.11 or later
# TORCH_INDEX   package index to take PyTorch from; empty: pip's own (see README, "GPU and CPU builds")
# CAPTURE, PRESET, BENCH_ARGS   of `make bench`
# PYTEST_ARGS   more arguments for the tests

PYTHON ?= python3
TORCH_INDEX ?=
CAPTURE ?= out/sample
PRESET ?= draft
BENCH_ARGS ?=
PYTEST_ARGS ?=

VENV := .venv
BIN := $(VENV)/bin
PACKAGES := $(VENV)/.installed
MODULES := viewer_static/node_modules/.installed

.DEFAULT_GOAL := help
.PHONY: help setup system demo serve test test-slow check format bench clean

help:  ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' Makefile | expand -t 20

setup: $(PACKAGES) $(MODULES) system  ## install everything into .venv and viewer_static/node_modules

$(PACKAGES): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(if $(TORCH_INDEX),$(BIN)/pip install --no-deps --index-url '$(TORCH_INDEX)' --constraint constraints.txt torch)
	$(BIN)/pip install --quiet --constraint constraints.txt --editable '.[dev]'
	@touch $@

$(MODULES): viewer_static/package.json viewer_static/package-lock.json | $(PACKAGES)
	scripts/viewer_modules.sh $(VENV)
	@touch $@

system:
	@scripts/system_packages.sh

demo: $(PACKAGES) $(MODULES)  ## convert the sample capture through the service; results in out/demo
	$(BIN)/polyfield demo

serve: $(PACKAGES) $(MODULES)  ## the service on http://127.0.0.1:8000, its files in data/
	$(BIN)/polyfield serve

test: setup  ## all tests but the slow ones
	$(BIN)/python -m pytest $(PYTEST_ARGS)

test-slow: setup  ## the tests that take minutes
	$(BIN)/python -m pytest -m slow $(PYTEST_ARGS)

check: $(PACKAGES)  ## lint, format and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(PACKAGES)  ## put the sources in form
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

out/sample:
	$(BIN)/polyfield sample $@

bench: $(PACKAGES) $(if $(filter out/sample,$(CAPTURE)),out/sample)  ## measure a conversion of CAPTURE with PRESET
	$(BIN)/python -m benchmarks.convert $(CAPTURE) --preset $(PRESET) $(BENCH_ARGS)

clean:  ## remove what `make setup` and the tools made
	rm -rf $(VENV) viewer_static/node_modules *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: demo test thorough lint clean

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[test,dev]'
	touch $(READY)

demo: $(READY)
	$(BIN)/python sample_telemetry/demo.py

# Two workers share the cores: their linear algebra keeps to one thread each, as the command line's does.
test thorough: export OMP_NUM_THREADS = 1
test thorough: export OPENBLAS_NUM_THREADS = 1
test: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/python tests/warm.py & $(BIN)/mypy && wait
	$(BIN)/python -m pytest -n 2 -m "not thorough"

thorough: $(READY)
	$(BIN)/python -m pytest -n 2

lint: $(READY)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/mypy

clean:
	rm -rf $(VENV) demo .mypy_cache .ruff_cache .pytest_cache

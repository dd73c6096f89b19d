# The verbs of daily work. `make install` first; PYTHON names another interpreter.
PYTHON ?= python3
BIN = .venv/bin

.PHONY: install test format check docs build

install:
	$(PYTHON) -m venv .venv
	$(BIN)/pip install -e ".[dev]"

test:
	$(BIN)/pytest

format:
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

check:
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

docs:
	$(BIN)/sphinx-build -W --keep-going -b html docs docs/_build/html

build:
	$(BIN)/pip wheel --no-deps --wheel-dir dist .

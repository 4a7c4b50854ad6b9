# What a newcomer and CI run. PYTHON picks the interpreter (3.11 or newer) that makes .venv; TESTS narrows `make test`.
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.installed

.PHONY: setup run test test-all lint bench fuzz readme guard
.DEFAULT_GOAL := run

setup: $(STAMP) ; @:

$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "$(PYTHON) is older than 3.11; name another: make setup PYTHON=python3.12" >&2; exit 1; }
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt \
		--config-settings editable_mode=compat -e '.[dev]'
	@touch $(STAMP)

run: setup
	$(BIN)/regrasp run short_obstacle --video

test: setup
	$(BIN)/pytest -n 2 --dist worksteal $(TESTS)

test-all: setup
	$(BIN)/pytest -n 2 --dist worksteal -m "slow or not slow" $(TESTS)

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy conftest.py regrasp tests
	$(BIN)/lint-imports

bench: setup
	$(BIN)/python -m regrasp.app.tasks.cable.bench
	$(BIN)/python -m regrasp.app.studies.robot_bench

fuzz: setup
	$(BIN)/python tests/support/fuzz_readers.py --cases 2000

readme: setup
	$(BIN)/python tests/support/readme_commands.py

guard: setup
	$(BIN)/python tests/guard/run_guard.py check

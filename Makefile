# make report   set up and run all shipped checks; the report is report/index.html
# make test     set up and run lint, types and tests
# make setup    set up alone; the command is then .venv/bin/lightgauge
# make lock     write requirements.lock anew, keeping its versions (delete it first to take the newest)
# PYTHON=...    the Python (3.11 or newer) that the environment is made from

export PYTHON ?= python3
BIN := .venv/bin

.DEFAULT_GOAL := report
.PHONY: report test setup lock

report: setup
	$(BIN)/lightgauge run -o report

test: setup
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/pytest -n auto --maxprocesses 4 --dist worksteal

setup: .venv/.ready

.venv/.ready: requirements.lock pyproject.toml .ci/setup
	@bash .ci/setup
	@touch $@

lock:
	@bash .ci/setup lock

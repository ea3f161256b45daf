# Everything from nothing: `make validate` and `make test` make their own environment first.
.DELETE_ON_ERROR:
VENV := .venv
BIN := $(VENV)/bin
# Fast tests of one file in one process, so that they share its runs; slow ones wherever there is time: one file has
# a large part of their work. One process where a test starts a browser.
SPREAD := -n logical --maxprocesses 8
# The newest Python that runs; a name alone may be a version manager's empty shell.
ifndef PYTHON
PYTHON := $(shell for v in 3.14 3.13 3.12 3.11 3; do python$$v -c pass >/dev/null 2>&1 && echo python$$v && break; done)
endif
# uv installs the same in a fraction of the time; like pip it compiles bytecode, for all the processes to come.
INSTALL := $(if $(shell command -v uv 2>/dev/null),uv pip install --quiet --compile-bytecode --python $(BIN)/python,$(BIN)/python -m pip install --quiet --disable-pip-version-check)

.PHONY: help install validate test test-slow test-browser lint reports docs clean
help:
	@echo "make validate      run the shipped scenes in both models and write the report"
	@echo "make test          the tests (under 10 minutes); test-slow, test-browser: the others"
	@echo "make reports       what reports/ and the README hold about the current code"
	@echo "make docs          the documents as a site, in build/site"
	@echo "make lint          ruff, mypy --strict, import contracts"
	@echo "make clean         remove the environment and what it produced"

install: $(VENV)/.installed

# The stamp comes last: whatever an interrupted set-up left behind is made anew by the next call.
$(VENV)/.installed: pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "sixbar: no python3 found; install Python 3.11 or newer"; exit 2; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "sixbar: $(PYTHON) is older than Python 3.11; name a newer one: make PYTHON=/path/to/python"; exit 2; }
	@rm -f $@ $(VENV)/.developed
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || { rm -rf $(VENV); $(PYTHON) -m venv $(VENV) >/dev/null; } \
	  || { rm -rf $(VENV); echo "sixbar: Python could not make a virtual environment; install python3-venv"; exit 2; }
	$(INSTALL) -c constraints.txt -e .
	@touch $@

# What only tests and linters need.
$(VENV)/.developed: $(VENV)/.installed
	$(INSTALL) -c constraints.txt -e '.[dev]'
	@touch $@

validate: $(VENV)/.installed
	$(BIN)/sixbar validate

test: $(VENV)/.developed
	$(BIN)/python -m pytest $(SPREAD) --dist loadfile

test-slow: $(VENV)/.developed
	$(BIN)/python -m pytest -m slow $(SPREAD) --dist worksteal

test-browser: $(VENV)/.developed
	$(BIN)/python -m pytest -m browser

# Study truth needs its engine.
reports: $(VENV)/.installed
	$(INSTALL) -c constraints.txt -e examples/truth_engine
	$(BIN)/python -c 'from comparison.cli.study import main; main()'

# A warning, such as of a link or an anchor that leads nowhere, fails.
docs: $(VENV)/.installed
	$(INSTALL) -c constraints.txt -e '.[docs]'
	rm -rf build/site
	$(BIN)/python -m sphinx --quiet --fresh-env --fail-on-warning --keep-going -c docs . build/site
	@echo '<meta http-equiv="refresh" content="0; url=docs/index.html">' > build/site/index.html
	@echo build/site/index.html

lint: $(VENV)/.developed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy benchmarks
	$(BIN)/mypy examples/third_engine/pinocchio_press
	$(BIN)/mypy examples/truth_engine/truth_press
	$(BIN)/lint-imports

clean:
	rm -rf $(VENV) build ./*.egg-info reports/out .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis

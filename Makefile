# Two commands on a machine with Python 3.11+ and make:  make demo   and   make test
# Both install the wheel of this checkout into .venv; once that is done they need no network.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SOURCES := $(shell find src -type f -not -name '*.pyc') pyproject.toml README.md LICENSE CITATION.cff references.bib docs/gonio.1
PIP := $(BIN)/python -m pip --disable-pip-version-check -q
# Python compiles a module when it is first imported; compiling all that is installed takes most of a minute. The locks name
# every package, so that nothing is to be resolved.
INSTALL := $(PIP) install --no-compile --no-deps
# What Python has compiled it keeps, whatever the caller's environment says: every process of a test loads the same modules.
unexport PYTHONDONTWRITEBYTECODE
THREADS := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
# JAX compiles in a third of the time; a stack that is fitted by a process of its own is compiled as users have it.
QUICK := XLA_FLAGS="--xla_cpu_use_fusion_emitters=false --xla_cpu_parallel_codegen_split_count=1"

.PHONY: help demo test check format docs links pages screens pictures vendor lock clean

help: ## what can be made
	@sed -n 's/^\([a-z-]*\):.*## /\1: /p' $(firstword $(MAKEFILE_LIST))
	@echo "By hand, hours in all, last results committed with machine and date (benchmarks/Makefile):"
	@echo "  $(BY_HAND)" | fold -s -w 78

demo: $(VENV)/.gonio ## sets everything up and runs the paper's study; then open demo/index.html
	$(BIN)/gonio demo --out demo --force

test: check ## sets everything up and runs every check
	$(THREADS) $(QUICK) $(BIN)/python -m pytest -n auto --maxprocesses 8 --dist loadgroup --durations=10

check: $(VENV)/.test $(VENV)/.gonio ## formatting, lint, types, layers
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo --no-cache

format: $(VENV)/.test ## formats every file
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

docs: $(VENV)/.test $(VENV)/.gonio ## the site, without network: open docs/_build/html/index.html
	rm -rf docs/_build docs/api docs/examples
	$(THREADS) $(BIN)/python -m sphinx -q -W --keep-going -b html docs docs/_build/html

links: $(VENV)/.test $(VENV)/.gonio ## asks every other site that the pages link to; needs the network
	GONIO_DOCS_ONLINE=1 $(THREADS) $(BIN)/python -m sphinx -q -b linkcheck docs docs/_build/links

pages: $(VENV)/.test $(VENV)/.gonio ## the pages that are made of declarations and of measured results
	for page in docs/pages/[a-z]*.py; do $(THREADS) PYTHONPATH=docs/pages:benchmarks $(BIN)/python $$page || exit 1; done
	$(BIN)/ruff format -q docs

screens: $(VENV)/.test $(VENV)/.gonio ## the screens that tests compare with, anew: look at what git shows of them
	GONIO_RENEW_SCREENS=1 $(THREADS) $(BIN)/python -m pytest -q tests/app/test_screens.py

pictures: $(VENV)/.test $(VENV)/.gonio ## the figures that tests compare with, anew: look at each that git shows
	GONIO_RENEW_PICTURES=1 $(THREADS) $(BIN)/python -m pytest -q tests/printed

# Of pinned versions, bundled and made small: what comes out is the same, byte for byte, until a version is changed.
PAGE := src/gonio/viewing/page/vendor
vendor: ## the JavaScript libraries of gonio view anew, in the versions of benchmarks/vendor/package.json (needs npm)
	mkdir -p $(VENV)/vendor && cp benchmarks/vendor/* $(VENV)/vendor
	npm install --prefix $(VENV)/vendor --no-audit --no-fund --silent
	cd $(VENV)/vendor && for name in ogl uplot; do node_modules/.bin/esbuild $$name.js --bundle --minify --format=esm --log-level=warning \
		--outfile=../../$(PAGE)/$$name.js --allow-overwrite || exit 1; done
	cp $(VENV)/vendor/node_modules/uplot/dist/uPlot.min.css $(PAGE)/uplot.css
	cp $(VENV)/vendor/node_modules/uplot/LICENSE $(PAGE)/uplot.LICENSE

clean: ## takes away everything that was made
	rm -rf $(VENV) .venv-* demo dist build docs/_build docs/api docs/examples .coverage .mypy_cache .ruff_cache .pytest_cache .hypothesis

# The locks, hashes and no index address; needs uv.
COMPILE := uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-strip-extras \
	--no-header -q
lock: ## pins every dependency anew (needs uv)
	$(COMPILE) --extra build -o locks/run.lock
	$(COMPILE) --extra build --extra test -c locks/run.lock -o locks/test.lock
	$(COMPILE) --extra build --extra cluster benchmarks/peers.in --override benchmarks/peers-override.in -c locks/test.lock \
		-o locks/bench.lock
	printf 'eradiate-mitsuba\nmaterialx\npygltflib\npyyaml\nraysect\nusd-core\n' | $(subst pyproject.toml,-,$(COMPILE)) --no-annotate -o locks/exports.lock
	printf 'mitsuba\npySCATMECH\nnumpy\npyradiance\npywincalc\ntmm\nwgpu\n' | $(subst pyproject.toml,-,$(COMPILE)) --no-annotate -o locks/crosscheck.lock
	printf 'anywidget\njupyterlab\nplaywright\n' | $(subst pyproject.toml,-,$(COMPILE)) --no-annotate -o locks/jupyter.lock

BY_HAND := answers bench bench-quick bench-peers bench-compare bench-big bench-crash bench-gpu completed coverage \
	crosscheck designs figures fuzz grain interrupt intervals lowest mutation mutation-printers newest nist planted \
	prior renders slopes spectral validated \
	wavelengths
ifndef INSIDE
.PHONY: $(BY_HAND)
$(BY_HAND):
	@$(MAKE) --no-print-directory -f benchmarks/Makefile INSIDE=1 $@
endif

$(VENV)/.venv:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "gonio needs Python 3.11 or later; name one with PYTHON=")'
	$(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/.run: locks/run.lock $(VENV)/.venv
	@echo "installing what gonio needs"
	$(INSTALL) --require-hashes -r locks/run.lock
	touch $@

$(VENV)/.test: locks/test.lock $(VENV)/.run
	@echo "installing what the checks need"
	$(INSTALL) --require-hashes -r locks/test.lock
	touch $@

# The wheel, as a user gets it: built and installed without network or cache.
$(VENV)/.gonio: $(VENV)/.run $(SOURCES)
	$(INSTALL) --no-index --no-build-isolation --force-reinstall .
	touch $@

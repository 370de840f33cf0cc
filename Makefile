# Two commands on a machine with Python 3.11+ and make:  make demo   and   make test
# Both install the wheel of this checkout into .venv; once that is done they need no network.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SOURCES := $(shell find src -type f -not -name '*.pyc') pyproject.toml README.md LICENSE
PIP := $(BIN)/python -m pip --disable-pip-version-check -q
THREADS := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

.PHONY: demo test check bench bench-quick bench-peers bench-compare bench-big bench-crash real-surfaces validated catalogue \
	figures crosscheck mutation nist spectral intervals formats-page fuzz lock clean

demo: $(VENV)/.gonio
	$(BIN)/gonio demo --out demo --force

test: check
	$(THREADS) $(BIN)/python -m pytest -n auto --maxprocesses 8 --dist loadgroup --cov --cov-report=term --cov-fail-under=95

check: $(VENV)/.test $(VENV)/.gonio
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo --no-cache

# What gonio is compared with, in an environment of its own together with gonio: Mitsuba 3, Lumos-Sat, lmfit, and JAX.
BENCH := .venv-bench
bench-peers: $(BENCH)/.gonio

# The figures of benchmarks/results.json and docs/performance.md; where bench-peers was not made, null stands for peers.
COMPARED = $(if $(wildcard $(BENCH)/.peers),$(BENCH),$(VENV))
bench-quick: $(COMPARED)/.gonio
	OPENBLAS_NUM_THREADS=1 $(COMPARED)/bin/python benchmarks/quick.py
	$(COMPARED)/bin/python docs/performance.py

# The same, start-up times, and exact weights against annealing on all real scans, which also writes results.md.
bench: bench-quick
	$(THREADS) $(COMPARED)/bin/python benchmarks/bench.py
	$(COMPARED)/bin/python docs/performance.py

# The whole catalogue fitted to a real scan and validated, within a minute; writes benchmarks/compare_all.json.
bench-compare: $(VENV)/.gonio
	$(BIN)/python benchmarks/compare_all.py

# Every model on the measured scans, judged by what its fit was not shown; writes benchmarks/validated.json.
validated: $(VENV)/.gonio
	$(THREADS) $(BIN)/python benchmarks/validated.py

# docs/real-surfaces.md and its figures from the shared scans and from benchmarks/validated.json.
real-surfaces: $(VENV)/.gonio
	$(THREADS) PYTHONPATH=benchmarks $(BIN)/python docs/real_surfaces.py

# docs/catalogue.md and its figures from the declarations of the models.
catalogue: $(VENV)/.test $(VENV)/.gonio
	$(BIN)/python docs/catalogue.py
	$(BIN)/ruff format -q docs/catalogue.md

# docs/formats.md from the declarations of the formats.
formats-page: $(VENV)/.test $(VENV)/.gonio
	$(BIN)/python docs/formats.py

# Every format against so many damaged and hostile files, an hour or two; writes docs/fuzzing.md and benchmarks/fuzzing.json.
INPUTS := 200000
fuzz: $(VENV)/.test $(VENV)/.gonio
	$(THREADS) $(BIN)/python tests/tools/fuzzing.py --inputs $(INPUTS) --workers 2

# A file of MERL's size read, and fitted by several models; writes benchmarks/big.json.
bench-big: $(VENV)/.gonio
	$(THREADS) $(BIN)/python benchmarks/big.py

# 200 000 scans fitted while workers and the whole run are killed; writes benchmarks/crash.json.
bench-crash: $(VENV)/.test $(VENV)/.gonio
	$(THREADS) $(BIN)/python benchmarks/crash.py

# The figure of the README, from a scan beside the project.
SCAN := ../shared/data/scans/ualoft_anoblack_nite_steel.csv
figures: $(VENV)/.gonio
	$(BIN)/gonio plot $(SCAN) --models torrance-sparrow,cauchy-lorentz,gonio-best --weighting log \
		--out docs/images/readme.png --force

# Breaks every sign, cosine and prefactor of every term in turn: a test must fail each time; writes docs/mutation.md.
mutation: $(VENV)/.test $(VENV)/.gonio
	$(THREADS) $(BIN)/python tests/tools/mutation.py

# NIST's certified regression problems by the local search of every fit; writes docs/solver-quality.md.
nist: $(VENV)/.gonio
	$(THREADS) $(BIN)/python benchmarks/nist.py

# Smooth spectral fits against free ones, and fits of many shape values; writes docs/spectral-fits.md.
spectral: $(VENV)/.gonio
	$(THREADS) $(BIN)/python benchmarks/spectral.py

# How often stated intervals hold the truth, half an hour; writes docs/intervals.md and benchmarks/intervals.json.
intervals: $(VENV)/.gonio
	$(THREADS) $(BIN)/python benchmarks/intervals.py

# Mitsuba 3 and NIST's SCATMECH, which compiles for minutes, against gonio; rewrites tests/reference/peers.
PEERS := .venv-peers
crosscheck: $(PEERS)/.installed $(VENV)/.test $(VENV)/.gonio
	$(PEERS)/bin/python tests/crosscheck/mitsuba_peer.py
	$(PEERS)/bin/python tests/crosscheck/scatmech_peer.py
	$(THREADS) $(BIN)/python tests/crosscheck/rgl_agreement.py samples $(PEERS)/rgl
	$(PEERS)/bin/python tests/crosscheck/rgl_peer.py $(PEERS)/rgl $(PEERS)/rgl.npz
	$(THREADS) $(BIN)/python tests/crosscheck/rgl_agreement.py compare $(PEERS)/rgl $(PEERS)/rgl.npz
	$(PEERS)/bin/python tests/crosscheck/radiance_peer.py
	$(THREADS) $(BIN)/python -m pytest tests/test_peers.py tests/test_radiance_peer.py tests/test_rgl_peer.py

$(PEERS)/.installed: requirements-crosscheck.lock
	$(PYTHON) -m venv $(PEERS)
	$(PEERS)/bin/python -m pip --disable-pip-version-check -q install --require-hashes -r requirements-crosscheck.lock
	touch $@

# Without dependencies, because the lock has them all and benchmarks/peers-override.in says which Lumos-Sat does without.
$(BENCH)/.peers: requirements-bench.lock
	$(PYTHON) -m venv $(BENCH)
	$(BENCH)/bin/python -m pip --disable-pip-version-check -q install --no-deps --require-hashes -r requirements-bench.lock
	touch $@

$(BENCH)/.gonio: $(BENCH)/.peers $(SOURCES)
	$(BENCH)/bin/python -m pip --disable-pip-version-check -q install --no-index --no-deps --no-build-isolation --force-reinstall .
	touch $@

# The locks, hashes and no index address; needs uv.
COMPILE := uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-strip-extras \
	--no-header -q
lock:
	$(COMPILE) --extra build -o requirements.lock
	$(COMPILE) --extra build --extra test -c requirements.lock -o requirements-test.lock
	$(COMPILE) --extra build --extra cluster benchmarks/peers.in --override benchmarks/peers-override.in -c requirements-test.lock \
		-o requirements-bench.lock
	printf 'mitsuba\npySCATMECH\nnumpy\npyradiance\n' | $(subst pyproject.toml,-,$(COMPILE)) --no-annotate -o requirements-crosscheck.lock

clean:
	rm -rf $(VENV) $(PEERS) $(BENCH) demo dist build .coverage .mypy_cache .ruff_cache .pytest_cache .hypothesis

$(VENV)/.venv:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "gonio needs Python 3.11 or later; name one with PYTHON=")'
	$(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/.run: requirements.lock $(VENV)/.venv
	@echo "installing what gonio needs"
	$(PIP) install --require-hashes -r requirements.lock
	touch $@

$(VENV)/.test: requirements-test.lock $(VENV)/.run
	@echo "installing what the checks need"
	$(PIP) install --require-hashes -r requirements-test.lock
	touch $@

# The wheel, as a user gets it: built and installed without network or cache.
$(VENV)/.gonio: $(VENV)/.run $(SOURCES)
	$(PIP) install --no-index --no-deps --no-build-isolation --force-reinstall .
	touch $@

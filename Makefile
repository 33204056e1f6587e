# Every verb sets up what it needs by itself: .venv with versions of requirements-dev.lock, the extension from crates/.
# `make` alone lists the verbs.

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
MAKEFLAGS += --no-builtin-rules --no-print-directory
.DEFAULT_GOAL := help

VENV := .venv
BIN := $(VENV)/bin
PYTHON ?= $(shell command -v python3.11 || command -v python3)
CASE_SEED := $(if $(SEED),--seed $(SEED))
CASE_KIND := $(if $(KIND),--kind $(KIND))
LOCKED := $(if $(CI),--locked)
RUST_SOURCES := $(shell find crates -name '*.rs' -path '*/src/*' 2>/dev/null) \
                $(shell find crates -name Cargo.toml 2>/dev/null) Cargo.toml $(wildcard Cargo.lock)
# Two checks are made at once: cargo takes its own processors, not make's.
CARGO := env -u MAKEFLAGS -u MFLAGS cargo
# One by one, since cargo fmt does not see modules that a macro declares.
RUSTFMT := find crates -name '*.rs' -print0 | xargs -0 rustfmt --edition 2021
PYTHON_SOURCES := .ci docs/conf.py docs/_site python tests trial demo benchmarks fingerprints reproduction cases conftest.py
# Processes that pytest takes; a file of tests stays in one, so that what its tests share is computed once.
WORKERS ?= $(shell nproc 2>/dev/null || echo 2)
PYTEST := $(BIN)/python -m pytest -q -n $(WORKERS) --dist loadfile

# A blinded trial: where it is, which cases, and where its page goes.
FOLDER ?= prove_out
JOBS ?= 2
PAGE ?= $(FOLDER)/proof
PROVE_SEED := $(or $(SEED),7)
PROVE_COMMAND := make prove SEED=$(PROVE_SEED)$(if $(CASES), CASES=$(CASES)) JOBS=$(JOBS) FOLDER=$(FOLDER)

# Errors and warnings of pip are shown; that there is a newer pip, or that root installs into .venv, is none.
PIP_INSTALL := $(BIN)/python -m pip --disable-pip-version-check install --quiet --root-user-action=ignore
# maturin calls pip too.
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_ROOT_USER_ACTION := ignore

# The binding crate must see the same interpreter from cargo and from maturin, or it is rebuilt each time.
export PYO3_PYTHON := $(CURDIR)/$(BIN)/python
# Sums over eight sensitivities at once take the vectors of processors since 2013 where this one has them; same results bit for bit.
ifeq ($(shell grep -m 1 '^flags' /proc/cpuinfo 2>/dev/null | tr ' ' '\n' | grep -cxE 'avx2|bmi2|f16c|fma|movbe|abm'),6)
export RUSTFLAGS ?= -C target-cpu=x86-64-v3
endif
export MPLBACKEND := Agg
# Compiled modules are kept, whatever the shell says: tests of the command line start Python anew.
export PYTHONDONTWRITEBYTECODE :=
export OPENBLAS_NUM_THREADS ?= 1

.PHONY: FORCE help setup build demo campaign prove test test-all checks lint lint-rust lint-python test-rust test-python \
        test-python-all wheel wheel-test snapshots hostile logs fuzz deny format bench convergence recruitment \
        docs effects reference reproduce example golden lock clean

help:  ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

$(VENV)/.created:
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed; this is " + sys.version.split()[0] + " (choose one: make PYTHON=path/to/python)")'
	@echo "making $(VENV) with $(PYTHON)"
	@"$(PYTHON)" -m venv $(VENV)
	@touch $@

$(VENV)/.tools: requirements-dev.lock $(VENV)/.created
	@$(PIP_INSTALL) --constraint requirements-dev.lock maturin
	@touch $@

# What the package does not need, but its tests and checks do.
$(VENV)/.installed: requirements-dev.lock | $(VENV)/.built
	@echo "installing what requirements-dev.lock pins into $(VENV): some minutes the first time"
	@$(PIP_INSTALL) --requirement requirements-dev.lock
	@touch $@

# The peers of the benchmarks are large, and nothing else needs them.
$(VENV)/.bench: requirements-bench.lock $(VENV)/.installed
	@echo "installing what requirements-bench.lock pins into $(VENV)"
	@$(PIP_INSTALL) --requirement requirements-bench.lock --constraint requirements-dev.lock
	@touch $@

# So are the tools that make the site.
$(VENV)/.docs: requirements-docs.lock $(VENV)/.installed
	@echo "installing what requirements-docs.lock pins into $(VENV)"
	@$(PIP_INSTALL) --requirement requirements-docs.lock --constraint requirements-dev.lock
	@touch $@

# Other flags are another library.
$(VENV)/.flags: $(VENV)/.created FORCE
	@printf '%s\n' '$(RUSTFLAGS)' | cmp -s - $@ || printf '%s\n' '$(RUSTFLAGS)' > $@

$(VENV)/.built: $(VENV)/.tools $(VENV)/.flags pyproject.toml $(RUST_SOURCES)
	@echo "compiling the Rust core: some minutes the first time"
	@env -u MAKEFLAGS -u MFLAGS PIP_QUIET=1 PIP_CONSTRAINT=requirements-dev.lock PATH="$(CURDIR)/$(BIN):$$PATH" VIRTUAL_ENV="$(CURDIR)/$(VENV)" \
	    $(BIN)/maturin develop --release --quiet $(LOCKED)
	@touch $@

setup: $(VENV)/.built  ## the package and what it needs in .venv, its Rust core compiled

build: $(VENV)/.built $(VENV)/.installed  ## the same with what tests and checks need

demo: setup  ## conceal an effect, diagnose it, open the key (KIND=leak_muscle SEED=7 to choose)
	@$(BIN)/python demo/run.py $(CASE_KIND) $(CASE_SEED)

campaign: setup  ## conceal an effect, record one poor log, let a campaign find it (KIND=leak_muscle SEED=7 to choose)
	@$(BIN)/python demo/campaign.py $(CASE_KIND) $(CASE_SEED)

# Each stage goes on where it was stopped. Exit code 3: some case could not be diagnosed, which the page says.
prove: build  ## blinded trial from cases to prove_out/proof/trial.md, hours (SEED=7 CASES=12 JOBS=2 FOLDER=prove_out to choose)
	$(BIN)/python -m trial write $(FOLDER) --seed $(PROVE_SEED) $(if $(CASES),--cases $(CASES)) --jobs $(JOBS)
	$(BIN)/python -m trial prove $(FOLDER) --jobs $(JOBS) || test $$? -eq 3
	@mkdir -p $(PAGE)
	$(BIN)/python -m benchmarks.baselines $(FOLDER) --jobs $(JOBS) --markdown $(PAGE)/peers.md || test $$? -eq 3
	$(BIN)/python -m trial score --keys $(FOLDER)/keys --results $(FOLDER)/results --markdown $(PAGE)/trial.md --json $(PAGE)/scores.json --command "$(PROVE_COMMAND)"

# The last step of the extension's build takes one processor for a minute: the rest is compiled meanwhile. What each check
# has to say is printed when it ends.
checks: build lint-rust test-rust lint-python

test:  ## everything that CI checks: the long trials are left to test-all
	@$(MAKE) --jobs=2 --output-sync=target checks
	@$(MAKE) test-python

test-all: export CARGO_PROFILE_TEST_DEBUG_ASSERTIONS = true
test-all: export CARGO_PROFILE_TEST_OVERFLOW_CHECKS = true
test-all: export PROPTEST_CASES = 256
test-all:  ## the same with the long trials, the core's tests with checks of overflow
	@$(MAKE) --jobs=2 --output-sync=target checks
	@$(MAKE) test-python-all

wheel: $(VENV)/.tools  ## dist/: a wheel that needs neither Rust nor a compiler, and the sources
	@$(PIP_INSTALL) ziglang==0.17.1
	@rm -rf dist
	@env -u MAKEFLAGS -u MFLAGS -u RUSTFLAGS -u PYO3_PYTHON PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python .ci/wheel.py dist
	@ls dist

wheel-test: wheel  ## install the wheel where nothing can be compiled, and diagnose the example
	$(BIN)/python tests/wheel.py dist

lint: lint-rust lint-python  ## formatting, clippy, ruff, mypy, the stub against the compiled module

lint-rust: $(VENV)/.created
	$(RUSTFMT) --check
	$(CARGO) clippy --quiet --workspace --all-targets $(LOCKED) -- -D warnings

lint-python: build
	$(BIN)/ruff check --quiet $(PYTHON_SOURCES)
	$(BIN)/ruff format --quiet --check $(PYTHON_SOURCES)
	$(BIN)/mypy --no-error-summary python/pamrs trial reproduction
	$(BIN)/python -m mypy.stubtest pamrs._core

test-rust: export PROPTEST_CASES ?= 64
test-rust:  ## the core's tests: its units and its laws
	$(CARGO) test --quiet -p pam-core $(LOCKED) --lib

test-python: build  ## pytest without what is marked slow (WORKERS=2 to choose)
	$(PYTEST) -m "not slow"

test-python-all: build
	$(PYTEST)

snapshots: build  ## write the files of the work done anew, where it has changed on purpose
	PAMRS_SNAPSHOTS=write $(BIN)/python -m pytest -q tests/work
	PAMRS_SNAPSHOTS=write $(CARGO) test --quiet -p pam-core $(LOCKED) --lib laws::work::

hostile: build  ## the table of hostile inputs that were tried, and what each came to
	$(BIN)/python -m tests.hostile

logs: build  ## the table of 60 small logs (dialects, clocks, units, names), each right or told
	$(BIN)/python -m tests.recordings

# Seconds of it are in `make test`.
EXAMPLES ?= 20000
fuzz: export PROPTEST_CASES = $(EXAMPLES)
fuzz: build  ## rigs, commands, states and bytes of logs changed at random (EXAMPLES=100000 for hours)
	PAMRS_FUZZ=$(EXAMPLES) $(BIN)/python -m pytest -q tests/hostile/test_fuzz.py
	$(CARGO) test --quiet --release -p pam-core $(LOCKED) --lib laws::fuzz::

deny:  ## licences, sources and duplicates of the crates (needs cargo-deny)
	@command -v cargo-deny > /dev/null || { echo "cargo-deny is not installed; it is with: cargo install --locked cargo-deny"; exit 1; }
	$(CARGO) deny --locked check bans licenses sources

format:  ## rewrite the sources in the house's layout
	$(RUSTFMT)
	$(BIN)/ruff check --quiet --fix $(PYTHON_SOURCES)
	$(BIN)/ruff format $(PYTHON_SOURCES)

bench: build $(VENV)/.bench  ## this package beside Numba, JAX and SciPy, to docs/benchmarks.md
	$(CARGO) bench --quiet --package pam-core $(LOCKED)
	$(BIN)/python -m benchmarks.report --command "make bench"

convergence: build  ## order, stability and error of every packaged rig
	$(BIN)/python -m benchmarks.convergence docs

recruitment: build  ## recruitment in real time against fixed recruitment, and bundles of small muscles
	$(BIN)/python -m benchmarks.recruitment docs

# A tutorial runs again where its text or the package has changed. Warnings, lost links included, are errors.
docs: build $(VENV)/.docs  ## the site, its tutorials run, to out/site/index.html
	@rm -rf out/site out/docs-pages docs/reference/api
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet -b html -d out/docs-pages docs out/site
	@echo "written: out/site/index.html"

reference: build  ## the tables of the documents: commands, keys, channels, units, settings, files, checks
	$(BIN)/python docs/_site/made_reference.py

effects: build  ## a page of every effect of the catalogue, its fingerprint drawn by the simulator
	$(BIN)/python -m fingerprints docs/effects

reproduce: build  ## the dissertation beside pamrs, to docs/reproduction; finished chapters are kept (CHAPTER=ch3 for one)
	$(BIN)/python -m reproduction docs/reproduction $(if $(CHAPTER),--only $(CHAPTER))

example: build  ## the files that `pamrs example` copies, but for its notebook
	$(BIN)/python -m demo.example python/pamrs/cli/example_files

golden: build  ## the published golden values against this build
	$(BIN)/python -m pytest -q tests/golden

# With the oldest Python that is supported: what is pinned for a newer one may not install there. The lists change together, or not at all.
lock:  ## pin the newest versions that pyproject.toml allows
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11) and "make lock takes Python 3.11; this is " + sys.version.split()[0] + " (choose one: make lock PYTHON=path/to/python3.11)")'
	rm -rf $(VENV)/lock && "$(PYTHON)" -m venv $(VENV)/lock
	$(VENV)/lock/bin/python -c 'import tomllib; p = tomllib.load(open("pyproject.toml", "rb"))["project"]; o = p["optional-dependencies"]; b, d = o.pop("bench"), o.pop("docs"); w = lambda name, some: open("$(VENV)/lock/" + name, "w").write("".join(r + "\n" for r in some if not r.startswith("pamrs"))); w("wanted.txt", p["dependencies"] + sum(o.values(), [])); w("bench.txt", b); w("docs.txt", d)'
	$(VENV)/lock/bin/python -m pip install --quiet --requirement $(VENV)/lock/wanted.txt
	{ head -1 requirements-dev.lock; $(VENV)/lock/bin/python -m pip freeze; } > $(VENV)/lock/dev.lock
	$(VENV)/lock/bin/python -m pip install --quiet --requirement $(VENV)/lock/docs.txt --constraint $(VENV)/lock/dev.lock
	{ head -1 requirements-docs.lock; $(VENV)/lock/bin/python -m pip freeze | grep -vxFf $(VENV)/lock/dev.lock; } > $(VENV)/lock/docs.lock
	$(VENV)/lock/bin/python -m pip uninstall --quiet --yes --requirement $(VENV)/lock/docs.lock
	$(VENV)/lock/bin/python -m pip install --quiet --requirement $(VENV)/lock/bench.txt --constraint $(VENV)/lock/dev.lock
	{ head -1 requirements-bench.lock; $(VENV)/lock/bin/python -m pip freeze | grep -vxFf $(VENV)/lock/dev.lock; } > $(VENV)/lock/bench.lock
	mv $(VENV)/lock/dev.lock requirements-dev.lock && mv $(VENV)/lock/docs.lock requirements-docs.lock && mv $(VENV)/lock/bench.lock requirements-bench.lock
	rm -rf $(VENV)/lock

clean:  ## remove everything that was built
	rm -rf $(VENV) target dist out docs/reference/api .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find python trial tests benchmarks demo fingerprints reproduction -name __pycache__ -type d -prune -exec rm -rf {} + 2>/dev/null || true
	rm -f python/pamrs/_core*.so

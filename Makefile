# The short way to everything; CMake presets do the work.
.DEFAULT_GOAL := help
.PHONY: help setup demo test cuda bench bench-instructions bench-peers bench-realtime bench-ablation bench-growth bench-loops bench-loop-seeds oracles check-map format tidy docs clean

COVSPLAT_DATA ?= ../shared/data
THREADS ?= 2
# Of bench-peers: the simulated worlds; of it and of bench-ablation: a regular expression for what to
# run.
WORLDS ?= courtyard college street
ONLY ?=

help:  ## List the targets
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## (.*)/\1\t\2/' | \
	  awk -F '\t' '{printf "  make %-14s %s\n", $$1, $$2}'

setup:  ## Install the Debian packages that are missing
	@tools/setup.sh

# CUDA=1 builds the CUDA backend as well, with the compiler that PyPI ships.
CUDA ?=
CUDA_FLAGS = $(if $(CUDA),$$(tools/setup_cuda.sh))

build-%:
	@$(if $(CUDA),tools/setup.sh --with-python)
	@cmake --preset $* $(CUDA_FLAGS) >/dev/null
	@cmake --build --preset $*

demo: setup  ## Simulate a recording, run the SLAM on it, write demo_out/report.html
	@cmake --preset release >/dev/null
	@cmake --build --preset release --target covsplat
	build/release/apps/covsplat demo -o demo_out --overwrite

test: setup build-dev  ## Build with warnings as errors and run every test
	ctest --preset dev

cuda: CUDA = 1
cuda: setup  ## Build with the CUDA backend into build/cuda
	@tools/setup.sh --with-python
	@cmake --preset release -B build/cuda $(CUDA_FLAGS) >/dev/null
	cmake --build build/cuda

bench: setup build-release .venv/peers  ## Time the kernels, beside the roofline: docs/benchmarks.md
	COVSPLAT_DATA=$(COVSPLAT_DATA) PYTHONPATH=bench/peers .venv/bin/python bench/kernels/run.py \
	  --build build/release/bench --out bench_out/kernels --update docs/benchmarks.md

bench-instructions: setup build-release  ## Fail if a hot kernel takes more instructions than recorded
	@tools/setup.sh --with-dev
	tools/count_instructions.py build/release/bench --check bench/instructions.json

# The peers need packages of PyPI; they live in .venv and nowhere else.
.venv/peers: bench/peers/requirements.txt
	@tools/setup.sh --with-python
	python3 -m venv .venv
	.venv/bin/pip install --quiet --disable-pip-version-check -r $<
	@touch $@

SENSOR_courtyard = --sensor os1-64 --motion walking
SENSOR_college = --sensor os1-64 --motion walking
SENSOR_multilevel = --sensor os1-64 --motion walking
SENSOR_tunnel = --sensor os1-64 --motion walking
SENSOR_street = --sensor hdl-64e --motion vehicle
SENSOR_city = --sensor os1-64 --motion vehicle

simulate-%: build-release
	build/release/apps/covsplat simulate $* $(SENSOR_$*) -o bench_out/$* --overwrite

bench-peers: setup build-release .venv/peers $(addprefix simulate-,$(WORLDS))  ## Compare with the peers: docs/benchmarks.md
	.venv/bin/python bench/peers/run.py --covsplat build/release/apps/covsplat \
	  $(WORLDS:%=--recording bench_out/%) --no-map street --data $(COVSPLAT_DATA) \
	  --azimuth-time kitti_raw_0005=0.1033 --threads $(THREADS) --out bench_out \
	  $(if $(ONLY),--only '$(ONLY)',--update docs/benchmarks.md)

bench-realtime: setup build-release .venv/peers simulate-courtyard simulate-college  ## Latency, dropped scans, tracking beside peers: docs/benchmarks.md
	PYTHONPATH=bench/peers .venv/bin/python bench/realtime/run.py --covsplat build/release/apps/covsplat \
	  --recording bench_out/courtyard --recording bench_out/college --data $(COVSPLAT_DATA) \
	  --azimuth-time kitti_raw_0005=0.1033 --threads $(THREADS) --out bench_out/realtime \
	  $(if $(ONLY),--only '$(ONLY)',--update docs/benchmarks.md)

# Runs with the same program and settings are kept: interrupted, it goes on where it was.
bench-ablation: setup build-release .venv/peers  ## Run the paper's ablations (hours): docs/benchmarks.md
	PYTHONPATH=bench/peers .venv/bin/python bench/ablation/run.py --covsplat build/release/apps/covsplat --out bench_out/ablation \
	  $(if $(ONLY),--only '$(ONLY)',--update docs/benchmarks.md)

# The truth is what the simulator writes last.
bench-growth: setup build-release .venv/peers simulate-city  ## A drive of 10 km, which takes 15 GB: docs/benchmarks.md
	PYTHONPATH=bench/peers .venv/bin/python bench/growth/run.py --covsplat build/release/apps/covsplat \
	  --recording bench_out/city --out bench_out/growth --update docs/benchmarks.md

LOOP_WORLDS = street college multilevel tunnel
bench-loops: setup build-release .venv/peers $(addprefix simulate-,$(LOOP_WORLDS))  ## What closing loops gains: docs/benchmarks.md
	PYTHONPATH=bench/peers .venv/bin/python bench/loops/run.py --covsplat build/release/apps/covsplat \
	  $(LOOP_WORLDS:%=--recording bench_out/%) --no-map tunnel --data $(COVSPLAT_DATA) --threads $(THREADS) \
	  --out bench_out/loops $(if $(ONLY),--only '$(ONLY)',--update docs/benchmarks.md)

bench-loop-seeds: setup build-release .venv/peers  ## Loops in 20 worlds of a kind: docs/benchmarks.md
	PYTHONPATH=bench/peers .venv/bin/python bench/loops/seeds.py --covsplat build/release/apps/covsplat \
	  --out bench_out/loop_seeds --update docs/benchmarks.md

.venv/oracles: tools/oracles/requirements.txt
	@tools/setup.sh --with-python
	python3 -m venv .venv/oracles
	.venv/oracles/bin/pip install --quiet --disable-pip-version-check -r $<
	@touch $@

oracles: setup build-release .venv/oracles  ## Check the metrics against evo and Open3D
	.venv/oracles/bin/python tools/oracles/make_references.py --check build/release/apps/covsplat

tools/node_modules: tools/package-lock.json
	npm --prefix tools ci --no-audit --no-fund
	@touch $@

check-map: build-release tools/node_modules  ## Check that MAP=map.ply, and SPZ of it, open in Spark (needs node 20)
	@test -n "$(MAP)" || { echo "say which: make check-map MAP=folder/map.ply"; exit 2; }
	@folder=$$(mktemp -d) && trap 'rm -r "$$folder"' EXIT && \
	  build/release/apps/covsplat export "$(MAP)" -o "$$folder/map.spz" --quiet && \
	  node tools/check_map.mjs "$(MAP)" "$$folder/map.spz"

format:  ## Format the sources
	@tools/setup.sh --with-dev
	tools/format.sh

tidy: build-dev  ## Run clang-tidy
	@tools/setup.sh --with-dev
	tools/tidy.sh

docs: setup build-release  ## Write the generated pages of docs/
	build/release/apps/covsplat config describe > docs/configuration.md

clean:  ## Remove the build folders; results of runs stay
	rm -rf build

# The short way to everything; CMake presets do the work.
.DEFAULT_GOAL := help
.PHONY: help setup demo test bench format tidy docs clean

help:  ## List the targets
	@grep -E '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## (.*)/\1\t\2/' | \
	  awk -F '\t' '{printf "  make %-8s %s\n", $$1, $$2}'

setup:  ## Install the Debian packages that are missing
	@tools/setup.sh

build-%:
	@cmake --preset $* >/dev/null
	@cmake --build --preset $*

demo: setup build-release  ## Simulate a recording, run the SLAM on it, write demo_out/report.html
	build/release/apps/covsplat demo -o demo_out --overwrite

test: setup build-dev  ## Build with warnings as errors and run every test
	ctest --preset dev

bench: setup build-release  ## Run the benchmarks
	@for b in build/release/bench/*_bench; do \
	  if [ -x "$$b" ]; then echo "$$b" && "$$b" || exit 1; fi; \
	done

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

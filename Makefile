# Two commands do everything on a fresh machine: `make demo` and `make test`.

.PHONY: help setup build demo test bench peers
.DEFAULT_GOAL := help

TOILE := target/release/toile

help: ## Say what there is
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

setup: ## Install what is missing: a C compiler and Rust
	@bash scripts/setup.sh

build: setup ## Build the program
	bash scripts/cargo.sh build --release --locked --package toile-studio

demo: build ## Take the shipped recording to an avatar and say where to look
	$(TOILE) demo

test: demo ## The demo, then all tests, with the outside checkers that can be had here
	@bash scripts/outside.sh
	bash scripts/cargo.sh test --release --locked --workspace
	bash scripts/cargo.sh test --release --locked -p toile-driver-kinect2 --test endurance -- --ignored
	@bash tests/wire/wire.sh

bench: setup ## Benchmarks
	bash scripts/cargo.sh bench --locked --workspace --benches

peers: build ## Fusion beside Open3D and small_gicp (from PyPI) on the same frames; FRAMES=folder for other frames
	python3 tests/peers/fusion.py $(FRAMES)

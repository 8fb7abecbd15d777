# Two commands do everything on a fresh machine: `make demo` and `make test`.

.PHONY: help setup console build install demo test docs fuzz bench peers batch-trial
.DEFAULT_GOAL := help

TOILE := target/release/toile
PREFIX ?= $(HOME)/.local

help: ## List the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 13

setup: ## Install a C compiler and Rust where they are missing
	@bash scripts/setup.sh

build: setup console ## Build the program
	bash scripts/cargo.sh build --release --locked --package toile-studio

console: ## Build the page that `toile serve` shows (with Node, which is installed where it is missing)
	@bash scripts/console.sh

install: build ## Install the program as PREFIX/bin/toile (PREFIX is ~/.local where it is not given)
	install -D $(TOILE) $(PREFIX)/bin/toile
	@bash scripts/on_path.sh $(PREFIX)/bin

demo: build ## Process the shipped recording to an avatar and say where to look
	$(TOILE) demo

test: demo ## The demo, then all tests, with the outside checkers that can be installed here
	@bash scripts/outside.sh
	@bash scripts/console.sh test
	@bash scripts/console.sh e2e
	bash scripts/cargo.sh test --release --locked --workspace
	bash scripts/cargo.sh test --release --locked -p toile-driver-kinect2 --test endurance -- --ignored
	@bash tests/readme.sh
	@bash tests/batch/batch.sh s3
	@bash tests/wire/wire.sh

docs: setup ## Build the book (target/book) and the API reference (target/doc)
	bash scripts/mdbook.sh build docs
	RUSTDOCFLAGS="-D warnings" bash scripts/cargo.sh doc --release --locked --workspace --no-deps

bench: setup ## Run the benchmarks
	bash scripts/cargo.sh bench --locked --workspace --benches

peers: build ## Compare fusion with Open3D and small_gicp (from PyPI) on the same frames; FRAMES=folder for other frames
	python3 tests/peers/fusion.py $(FRAMES)

fuzz: setup ## Fuzz all parsers of outside data for 10 minutes in all; SECONDS=n for another time
	bash fuzz/run.sh $(SECONDS)

batch-trial: build ## A batch on a Ray cluster (from PyPI) whose worker, driver and node are killed; no part of `make test`
	@bash tests/batch/batch.sh ray

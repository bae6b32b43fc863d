# The release profile builds everything: the software device and the scalar references need it, and no second
# profile is then compiled. `ARGS` go to the program or to `cargo test`.
#
# Requirements are Rust (its version is in Cargo.toml), a linker (`cc`) and a Vulkan device; tests need a browser, too. The
# targets install all but Rust where they are missing and no question is needed; see scripts/.

CARGO ?= cargo
ARGS ?=
export CARGO
# Mesa's device selection looks for a Wayland display, and warns where there is none.
ifndef XDG_RUNTIME_DIR
export NODEVICE_SELECT = 1
endif
# By default glibc has eight arenas a core. Each keeps freed memory that its next large buffers do not fit.
ifndef MALLOC_ARENA_MAX
export MALLOC_ARENA_MAX := $(shell nproc 2>/dev/null || echo 4)
endif

.DEFAULT_GOAL := help
.PHONY: help build announce demo lab cluster cluster-test test fmt-check lint unit bench doc audit vulkan browser toolchain lint-toolchain clean bench-scaling

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)
	@echo '  ARGS="…" goes to the program, as in: make demo ARGS="--scene model.glb"'

demo: build ## a cluster on this machine beside direct drawing; pictures and report in out/demo
	$(CARGO) run --release --locked --package myriorama -- demo $(ARGS)

test: ## format, lints and all tests, with the time of each phase and the slowest tests
	@scripts/test.sh

lab: build ## the measuring program, target/release/myriorama-lab
	$(CARGO) build --release --locked --package myriorama --package lab

cluster: build ## a coordinator and four nodes in containers; leaves them running
	deploy/cluster.sh

cluster-test: build ## the same, kills nodes while it serves a client, and stops the cluster
	deploy/cluster.sh --test

bench: lab ## speed and accuracy against the bars; report in out/bench
	$(CARGO) run --release --locked --package lab -- bench $(ARGS)

bench-scaling: lab ## scaling to eleven nodes, simulated to 1,000 (root; an hour and a half, ARGS=--quick ten minutes)
	$(CARGO) run --release --locked --package lab -- bench scaling $(ARGS)

doc: toolchain ## the crates' documentation, in target/doc
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --release --locked --workspace --no-deps

audit: toolchain ## licences, advisories, bans and sources of all dependencies
	@$(CARGO) deny --version >/dev/null 2>&1 || { echo 'cargo-deny is missing: cargo install --locked cargo-deny' >&2; exit 1; }
	$(CARGO) deny --locked check

clean: ## remove all build output and reports
	$(CARGO) clean
	rm -rf out

build: toolchain vulkan announce
	$(CARGO) build --release --locked --package myriorama

announce:
	@scripts/announce-build.sh

fmt-check: lint-toolchain
	$(CARGO) fmt --all --check

lint: lint-toolchain
	$(CARGO) clippy --release --locked --workspace --all-targets -- -D warnings

unit: toolchain vulkan browser
	$(CARGO) test --release --locked --workspace $(ARGS)

vulkan:
	@scripts/ensure-vulkan.sh

browser:
	@scripts/ensure-browser.sh

toolchain:
	@scripts/ensure-toolchain.sh

lint-toolchain:
	@scripts/ensure-toolchain.sh lint

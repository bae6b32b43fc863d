#!/usr/bin/env bash
# Runs format, lints and all tests, and prints the time of each phase and the ten slowest tests.
#
# Test programs are compiled before the first one runs. The times of tests come from an option of Rust's test harness that
# is not stable; it changes nothing else.
set -euo pipefail
cd "$(dirname "$0")/.."

make="${MAKE:-make}"
log="$(mktemp)"
trap 'rm -f "$log"' EXIT
phases=()

# Runs a command and remembers its time under a name.
phase() {
    local name="$1" start="$SECONDS" status=0
    shift
    "$@" || status=$?
    phases+=("$(printf '%-8s %5d s' "$name" "$((SECONDS - start))")")
    return "$status"
}

run_tests() {
    "$make" --no-print-directory unit RUN="$PWD/scripts/timed-test.sh" 2>&1 | tee "$log"
}

summary() {
    echo
    echo "== time of each phase =="
    printf '%s\n' "${phases[@]}"
    if [ -s "$log" ]; then
        echo "== the ten slowest tests =="
        sed -nE 's/^test (.*) \.\.\. [a-zA-Z]+ <([0-9.]+)s>.*$/\2 s  \1/p' "$log" | sort -rn | head -n 10
    fi
}
trap 'summary; rm -f "$log"' EXIT

phase format "$make" --no-print-directory fmt-check
phase lints "$make" --no-print-directory lint
phase compile "$make" --no-print-directory unit ARGS=--no-run
phase run run_tests

#!/usr/bin/env bash
# Runs format, lints and all tests, and prints the time of each phase and the ten slowest tests.
#
# All test programs are compiled before the first one runs. Tests of clusters and browsers wait most of the time, and have
# deadlines: their programs run one after the other, while three of the others run beside them at the lowest priority. The
# times of tests come from an option of Rust's test harness that is not stable; it changes nothing else.
set -euo pipefail
cd "$(dirname "$0")/.."

make="${MAKE:-make}"
cargo="${CARGO:-cargo}"
LOGS="$(mktemp -d)"
export LOGS
phases=()

# Runs a command and remembers its time under a name.
phase() {
    local name="$1" start="$SECONDS" status=0
    shift
    "$@" || status=$?
    phases+=("$(printf '%-8s %5d s' "$name" "$((SECONDS - start))")")
    return "$status"
}

# Lists the folder of the package and the path of each test program, the largest program first: it takes longest.
programs() {
    "$cargo" test --release --locked --workspace --no-run --message-format=json 2> /dev/null |
        sed -nE '/"test":true\},"features"/s|.*"manifest_path":"([^"]*)/Cargo.toml".*"executable":"([^"]+)".*|\1\t\2|p' |
        while IFS=$'\t' read -r folder program; do
            printf '%s\t%s\t%s\n' "$(stat -c %s "$program")" "$folder" "$program"
        done |
        sort -rn | cut -f 2-
}

run_tests() {
    local list waiting_programs='/tests\t.*/suite-|/browser' status=0
    list="$(programs)"
    nice -n 19 "$make" --no-print-directory unit ARGS="--doc --quiet" &
    local documentation_pid="$!"
    grep -P "$waiting_programs" <<< "$list" | xargs -d '\n' -n 1 scripts/test-program.sh &
    local waiting_pid="$!"
    grep -vP "$waiting_programs" <<< "$list" | nice -n 19 xargs -d '\n' -n 1 -P 3 scripts/test-program.sh || status=$?
    wait "$waiting_pid" || status=$?
    wait "$documentation_pid" || status=$?
    return "$status"
}

summary() {
    echo
    echo "== time of each phase =="
    printf '%s\n' "${phases[@]}"
    echo "== the ten slowest tests =="
    find "$LOGS" -type f -exec sed -nE 's/^test (.*) \.\.\. [a-zA-Z]+ <([0-9.]+)s>.*$/\2 s  \1/p' {} + |
        sort -rn | sed -n 1,10p
    rm -rf "$LOGS"
}
trap summary EXIT

phase format "$make" --no-print-directory fmt-check
phase lints "$make" --no-print-directory lint
phase compile "$make" --no-print-directory unit ARGS=--no-run
phase run run_tests

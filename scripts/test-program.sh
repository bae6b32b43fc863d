#!/usr/bin/env bash
# Runs a test program in the folder of its package, as `cargo test` does. The argument is the folder, a tab, and the path of
# the program. Shows the result of each test and, if one fails, all else that was printed. The whole goes to a file in $LOGS.
set -euo pipefail

IFS=$'\t' read -r folder program <<< "$1"
log="$LOGS/${program##*/}"
cd "$folder"
if ! RUSTC_BOOTSTRAP=1 "$program" -Z unstable-options --report-time 2>&1 | tee "$log" | grep --line-buffered '^test '; then
    echo "== $program =="
    grep -v '^test ' "$log"
    exit 1
fi

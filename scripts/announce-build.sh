#!/usr/bin/env bash
# Says once, before the first build, what is going on and how long it takes.
set -euo pipefail
cd "$(dirname "$0")/.."

if [ ! -e "${CARGO_TARGET_DIR:-target}/release/myriorama" ]; then
    cat <<'TEXT'
The first build compiles Myriorama and the libraries that it uses, with optimisation, since the software device and the
codecs need it. It takes four to five minutes on two cores and less than two on eight. Later builds take seconds.
TEXT
fi

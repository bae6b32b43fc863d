#!/usr/bin/env bash
# Makes sure that Cargo can link and, with `lint` as argument, that rustfmt and clippy are there. The script installs
# missing parts where no question is needed. These are a linker on Debian and Ubuntu, as root or with passwordless
# sudo, and components by rustup. Elsewhere it names the packages to install and ends with status 1.
set -euo pipefail

cargo="${CARGO:-cargo}"

if ! command -v "$cargo" >/dev/null; then
    echo "Rust is missing: see https://rustup.rs" >&2
    exit 1
fi

if ! command -v cc >/dev/null; then
    as_root=()
    if [ "$(id -u)" -ne 0 ]; then as_root=(sudo -n); fi
    if command -v apt-get >/dev/null && ${as_root[@]+"${as_root[@]}"} true 2>/dev/null; then
        echo "No linker (cc) here: installing gcc." >&2
        export DEBIAN_FRONTEND=noninteractive
        ${as_root[@]+"${as_root[@]}"} apt-get update -qq >&2
        ${as_root[@]+"${as_root[@]}"} apt-get install -y -qq --no-install-recommends gcc libc6-dev >&2
    else
        echo "A linker (cc) is missing. Debian, Ubuntu: sudo apt-get install gcc libc6-dev. Fedora: sudo dnf install gcc. macOS: xcode-select --install." >&2
        exit 1
    fi
fi

if [ "${1:-}" = lint ]; then
    for component in rustfmt:fmt clippy:clippy; do
        if ! "$cargo" "${component#*:}" --version >/dev/null 2>&1; then
            if ! command -v rustup >/dev/null; then
                echo "${component%:*} is missing; install it beside Rust, for instance by the package of that name." >&2
                exit 1
            fi
            rustup component add "${component%:*}" >&2
        fi
    done
fi

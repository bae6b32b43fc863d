#!/usr/bin/env bash
# Prints the name of the base image for deploy/Dockerfile. It is Debian's, pulled. Where no image registry can be
# reached, debootstrap makes one under our own name from Debian's packages, with software Vulkan inside.
set -euo pipefail

debian=debian:bookworm-slim
own=myriorama-base:bookworm-slim

if docker image inspect "$debian" >/dev/null 2>&1 || timeout 60 docker pull --quiet "$debian" >/dev/null 2>&1; then
    echo "$debian"
    exit 0
fi
if docker image inspect "$own" >/dev/null 2>&1; then
    echo "$own"
    exit 0
fi
echo "no image registry answers: making $own from Debian's packages" >&2
run=()
if [ "$(id -u)" -ne 0 ]; then run=(sudo -n); fi
if ! command -v debootstrap >/dev/null; then
    { "${run[@]}" apt-get update -qq \
        && "${run[@]}" apt-get install -y -qq debootstrap debian-archive-keyring; } >/dev/null
fi
root="$(mktemp -d)"
trap '"${run[@]}" rm -rf "$root" "$root.log"' EXIT
"${run[@]}" debootstrap --variant=minbase --force-check-gpg \
    --keyring=/usr/share/keyrings/debian-archive-keyring.gpg \
    --include=ca-certificates,libvulkan1,mesa-vulkan-drivers,libxext6,libegl1 \
    bookworm "$root" "${DEBIAN_MIRROR:-http://deb.debian.org/debian}" >"$root.log" 2>&1 || {
    tail -20 "$root.log" >&2
    exit 1
}
"${run[@]}" rm -rf "$root/var/cache/apt/archives" "$root/var/lib/apt/lists" "$root/usr/share/doc" "$root/usr/share/man"
"${run[@]}" tar -C "$root" -c . | docker import - "$own" >/dev/null
echo "$own"

#!/usr/bin/env bash
# Makes sure that the base image that deploy/Dockerfile names is there: pulled, or, where no image registry can be
# reached, made from Debian's packages by debootstrap, with software Vulkan inside.
set -euo pipefail

base="${1:-debian:bookworm-slim}"
suite="${base#debian:}"
suite="${suite%-slim}"

if docker image inspect "$base" >/dev/null 2>&1; then
    exit 0
fi
if timeout 60 docker pull --quiet "$base" 2>/dev/null; then
    exit 0
fi
echo "no image registry answers: making $base from Debian's packages" >&2
if ! command -v debootstrap >/dev/null; then
    run=()
    if [ "$(id -u)" -ne 0 ]; then run=(sudo -n); fi
    "${run[@]}" apt-get update -qq && "${run[@]}" apt-get install -y -qq debootstrap >/dev/null
fi
root="$(mktemp -d)"
trap 'rm -rf "$root"' EXIT
debootstrap --variant=minbase \
    --include=ca-certificates,libvulkan1,mesa-vulkan-drivers,libxext6,libegl1 \
    "$suite" "$root" "${DEBIAN_MIRROR:-http://deb.debian.org/debian}" >"$root.log" 2>&1 || {
    tail -20 "$root.log" >&2
    exit 1
}
rm -rf "$root/var/cache/apt/archives" "$root/var/lib/apt/lists" "$root/usr/share/doc" "$root/usr/share/man"
tar -C "$root" -c . | docker import - "$base" >/dev/null
rm -f "$root.log"

#!/usr/bin/env bash
# Makes sure that this machine has the browser of the tests: `chromium`.
#
# Where it is missing, the script installs it on Debian, as root or with passwordless sudo. Elsewhere it names the
# package to install and ends with status 1.
set -euo pipefail

has_browser() {
    command -v chromium >/dev/null
}

if has_browser; then
    exit 0
fi

# Ubuntu's package of this name is empty: it leads to another installer.
is_debian() {
    command -v apt-get >/dev/null && grep -qs '^ID=debian$' /etc/os-release
}

as_root=()
if is_debian; then
    if [ "$(id -u)" -ne 0 ] && command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
        as_root=(sudo -n)
    fi
    if [ "$(id -u)" -eq 0 ] || [ "${#as_root[@]}" -gt 0 ]; then
        echo "No browser here: installing Debian's chromium." >&2
        export DEBIAN_FRONTEND=noninteractive
        ${as_root[@]+"${as_root[@]}"} apt-get update -qq >&2
        ${as_root[@]+"${as_root[@]}"} apt-get install -y -qq --no-install-recommends chromium >&2
        if has_browser; then
            exit 0
        fi
        echo "The package is installed, but chromium is not on the PATH." >&2
        exit 1
    fi
fi

cat >&2 <<'TEXT'
The tests need chromium on the PATH:
  Debian           sudo apt-get install chromium
  Fedora           sudo dnf install chromium
  Arch             sudo pacman -S chromium
  openSUSE         sudo zypper install chromium
  Alpine           sudo apk add chromium
TEXT
exit 1

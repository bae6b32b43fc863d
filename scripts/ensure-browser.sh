#!/usr/bin/env bash
# Makes sure that this machine has the browser of the tests: `chromium`, and its driver `chromedriver`.
#
# Where one is missing, the script installs both on Debian, as root or with passwordless sudo. Elsewhere it names the
# packages to install and ends with status 1.
set -euo pipefail

has_browser() {
    command -v chromium >/dev/null && command -v chromedriver >/dev/null
}

if has_browser; then
    exit 0
fi

# Ubuntu's packages of these names are empty: they lead to another installer.
is_debian() {
    command -v apt-get >/dev/null && grep -qs '^ID=debian$' /etc/os-release
}

as_root=()
if is_debian; then
    if [ "$(id -u)" -ne 0 ] && command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
        as_root=(sudo -n)
    fi
    if [ "$(id -u)" -eq 0 ] || [ "${#as_root[@]}" -gt 0 ]; then
        echo "No browser with a driver here: installing Debian's chromium." >&2
        export DEBIAN_FRONTEND=noninteractive
        ${as_root[@]+"${as_root[@]}"} apt-get update -qq >&2
        ${as_root[@]+"${as_root[@]}"} apt-get install -y -qq --no-install-recommends chromium chromium-driver >&2
        if has_browser; then
            exit 0
        fi
        echo "The packages are installed, but chromium and chromedriver are not on the PATH." >&2
        exit 1
    fi
fi

cat >&2 <<'TEXT'
The tests need chromium and chromedriver on the PATH:
  Debian           sudo apt-get install chromium chromium-driver
  Fedora           sudo dnf install chromium chromedriver
  Arch             sudo pacman -S chromium
  openSUSE         sudo zypper install chromium chromedriver
  Alpine           sudo apk add chromium chromium-chromedriver
TEXT
exit 1

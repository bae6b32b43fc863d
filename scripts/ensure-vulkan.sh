#!/usr/bin/env bash
# Makes sure that this machine has a Vulkan device, a software device where there is no other.
#
# The script looks for the loader (libvulkan.so.1) and for a driver's manifest. Where one is missing, it installs
# Mesa's software device on Debian and Ubuntu, as root or with passwordless sudo. Elsewhere it names the packages
# to install and ends with status 1. macOS and Windows have devices of their own.
set -euo pipefail

case "$(uname -s)" in
    Linux) ;;
    *) exit 0 ;;
esac

has_driver() {
    # Drivers that are named replace those in the folders.
    local named="${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}}" folder file
    if [ -n "$named" ]; then
        local IFS=:
        for file in $named; do
            if [ -e "$file" ]; then return 0; fi
        done
        return 1
    fi
    local folders=(
        "${XDG_CONFIG_HOME:-${HOME:-/nonexistent}/.config}/vulkan/icd.d"
        /etc/xdg/vulkan/icd.d
        /etc/vulkan/icd.d
        /usr/local/etc/vulkan/icd.d
        "${XDG_DATA_HOME:-${HOME:-/nonexistent}/.local/share}/vulkan/icd.d"
        /usr/local/share/vulkan/icd.d
        /usr/share/vulkan/icd.d
        /run/opengl-driver/share/vulkan/icd.d
    )
    for folder in "${folders[@]}"; do
        for file in "$folder"/*.json; do
            if [ -e "$file" ]; then return 0; fi
        done
    done
    return 1
}

has_loader() {
    local folder folders=(/lib /lib64 /usr/lib /usr/lib64 /usr/local/lib /lib/*-linux-gnu* /usr/lib/*-linux-gnu* /run/opengl-driver/lib)
    if [ -n "${LD_LIBRARY_PATH:-}" ]; then
        local IFS=:
        # shellcheck disable=SC2206
        folders+=($LD_LIBRARY_PATH)
    fi
    for folder in "${folders[@]}"; do
        if [ -e "$folder/libvulkan.so.1" ]; then return 0; fi
    done
    return 1
}

if has_driver && has_loader; then
    exit 0
fi

if [ -n "${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}}" ] && ! has_driver; then
    echo "VK_DRIVER_FILES or VK_ICD_FILENAMES names no file that exists: unset it, or correct it." >&2
    exit 1
fi

as_root=()
if command -v apt-get >/dev/null; then
    if [ "$(id -u)" -ne 0 ] && command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
        as_root=(sudo -n)
    fi
    if [ "$(id -u)" -eq 0 ] || [ "${#as_root[@]}" -gt 0 ]; then
        echo "No Vulkan device here: installing Mesa's software one." >&2
        export DEBIAN_FRONTEND=noninteractive
        ${as_root[@]+"${as_root[@]}"} apt-get update -qq >&2
        ${as_root[@]+"${as_root[@]}"} apt-get install -y -qq --no-install-recommends mesa-vulkan-drivers libvulkan1 >&2
        if has_driver && has_loader; then
            exit 0
        fi
        echo "The packages are installed, but no Vulkan driver is where it should be." >&2
        exit 1
    fi
fi

cat >&2 <<'TEXT'
No Vulkan device here. Install the Vulkan loader and a driver; Mesa's software driver runs everything:
  Debian, Ubuntu   sudo apt-get install mesa-vulkan-drivers libvulkan1
  Fedora           sudo dnf install mesa-vulkan-drivers vulkan-loader
  Arch             sudo pacman -S vulkan-swrast vulkan-icd-loader
  openSUSE         sudo zypper install libvulkan_lvp libvulkan1
  Alpine           sudo apk add mesa-vulkan-swrast vulkan-loader
TEXT
exit 1

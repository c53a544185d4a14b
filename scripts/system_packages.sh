#!/bin/sh
# Installs the system packages that tests (and nothing else) need: OpenGL without a screen, and a browser.
# Without root or apt it says what is missing and goes on: setting up, the demo and the service work without them.
set -eu
PATH=$PATH:/usr/sbin:/sbin  # ldconfig

has_library() { ldconfig -p 2>/dev/null | grep -q "$1"; }

has_browser() {
    for name in chromium chromium-browser google-chrome google-chrome-stable; do
        command -v "$name" >/dev/null 2>&1 && return 0
    done
    return 1
}

missing=""
has_library libEGL.so.1 || missing="$missing libegl1"
has_library libGL.so.1 || missing="$missing libgl1"
has_browser || missing="$missing chromium"
[ -n "$missing" ] || exit 0

if ! command -v apt-get >/dev/null 2>&1 || [ "$(id -u)" != 0 ]; then
    echo "Not installed:$missing. Tests of shaders and pages need them; everything else works without." >&2
    echo "As root, on Debian: apt-get install --no-install-recommends$missing" >&2
    exit 0
fi

export DEBIAN_FRONTEND=noninteractive
apt-get update -q
# shellcheck disable=SC2086  # a list of names
apt-get install -q --yes --no-install-recommends $missing

#!/usr/bin/env bash
# Listens to a library of Debian's that uses Bullet's dynamics: the Bullet plugin of Ignition Physics,
# driven by debian_host.cpp. Installs what it needs (Debian 12, as root); not part of the tests.
# Usage: tests/plugin/listen/debian_host.sh CAROM [FILE.wav]
set -euo pipefail
carom=$(realpath "$1")
output=$(realpath "${2:-ignition.wav}")
cd "$(dirname "$0")"

apt-get install -y --no-install-recommends libignition-physics5-bullet-plugin5 \
  libignition-physics-core-dev libignition-physics-sdf-dev >/dev/null

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
g++ -std=c++17 -O1 debian_host.cpp -o "$folder/host" \
  $(pkg-config --cflags --libs ignition-physics5 ignition-physics5-sdf ignition-plugin1-loader)
library=/usr/lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH)/ign-physics-5/engine-plugins
"$carom" listen --json -o "$output" -- \
  "$folder/host" "$(echo "$library"/libignition-physics5-bullet-plugin.so.5)"

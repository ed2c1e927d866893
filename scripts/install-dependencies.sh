#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs with apt what this machine lacks to build SDMT, and prints what that is.
#
#   scripts/install-dependencies.sh [build|test|develop]
#
# build: what the libraries and the binary need (default). test: and the tests, and the Python module.
# develop: and what CONTRIBUTING.md uses beside them (benchmarks, formatting, coverage, ...).
# Needs root or sudo, but neither when nothing is missing. Debian 12 and Ubuntu 24.04 have it all.
set -euo pipefail

packages=(
  g++ cmake ninja-build pkg-config
  libhwy-dev               # SIMD, chosen at run time
  nlohmann-json3-dev       # model metadata, reports, configuration
  libcli11-dev libfmt-dev  # command line and text of the binary
  libopencv-dev            # images and video of the binary and of training
  libturbojpeg0-dev        # JPEGs, without the libraries behind OpenCV's codecs
  libavformat-dev libavcodec-dev libswscale-dev  # live streams
  libcpp-httplib-dev       # the page of sdmt track --serve; it builds without
  libmosquitto-dev         # the messages of sdmt track --mqtt; it builds without
)
python=(python3-dev python3-numpy pybind11-dev)  # the Python module and its tests
case "${1:-build}" in
  build) ;;
  test) packages+=(libgtest-dev libgmock-dev python3 "${python[@]}" libopenmpi-dev openmpi-bin mosquitto mosquitto-clients openssl) ;;
  develop)
    packages+=(libgtest-dev libgmock-dev python3 "${python[@]}" libopenmpi-dev openmpi-bin mosquitto mosquitto-clients openssl libbenchmark-dev clang clang-format clang-tidy libomp-dev
      gcovr valgrind git chromium qemu-user g++-aarch64-linux-gnu
      gir1.2-gst-rtsp-server-1.0 python3-gi gstreamer1.0-plugins-{base,good,bad,ugly}) ;;
  *) echo "usage: $0 [build|test|develop]" >&2; exit 2 ;;
esac

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$status" = installed ] || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
  echo "dependencies: all ${#packages[@]} packages are installed"
  exit 0
fi

echo "dependencies: installing ${missing[*]}"
as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "$0: run it as root, or install sudo" >&2; exit 1; }
  as_root=(sudo)
fi
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
  apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null

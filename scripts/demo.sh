#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# From a bare Debian 12 or Ubuntu 24.04 to tracked pedestrians: installs what is missing, builds, and
# leaves demo/tracks.txt, demo/tracks.mp4 and a summary.
#
#   scripts/demo.sh                real people: 795 frames of PETS 2009 (vtest.avi, which Debian ships
#                                  in its package opencv-doc; it is downloaded but not installed),
#                                  found by OpenCV's people detector
#   scripts/demo.sh --synthetic    a scene made by `sdmt synth scene`; downloads no video
set -euo pipefail
cd "$(dirname "$0")/.."

synthetic=false
case "${1:-}" in
  "") ;;
  --synthetic) synthetic=true ;;
  *) sed -n '3,10s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
esac

# Prints the path of vtest.avi, out of a cache or of Debian's package.
fetch_video() {
  local installed=/usr/share/doc/opencv-doc/examples/data/vtest.avi
  local cache="${XDG_CACHE_HOME:-$HOME/.cache}/sdmt"
  if [ -f "$installed" ]; then echo "$installed"; return; fi
  if [ ! -f "$cache/vtest.avi" ]; then
    echo "fetching vtest.avi out of the package opencv-doc (96 MB)" >&2
    mkdir -p "$cache"
    local work
    work=$(mktemp -d)
    # Root's apt would drop its rights, and could then not write here.
    (cd "$work" && apt-get download -qq -o APT::Sandbox::User=root opencv-doc >&2)
    dpkg-deb --fsys-tarfile "$work"/opencv-doc_*.deb |
      tar -xO "./usr/share/doc/opencv-doc/examples/data/vtest.avi" > "$work/vtest.avi"
    mv "$work/vtest.avi" "$cache/vtest.avi"
    rm -r "$work"
  fi
  echo "$cache/vtest.avi"
}

scripts/install-dependencies.sh build
if [ ! -f build/CMakeCache.txt ]; then cmake --preset release -DSDMT_BUILD_TESTS=OFF; fi
cmake --build build --target sdmt --parallel "$(nproc)"

mkdir -p demo
if $synthetic; then
  rm -rf demo/scene
  build/sdmt synth scene --output demo/scene --frames 300 --seed 1
  input=demo/scene
else
  input=$(fetch_video)
fi
echo
build/sdmt track "$input" --output demo/tracks.txt --render demo/tracks.mp4 --stats
if $synthetic; then
  mkdir -p demo/results
  cp demo/tracks.txt demo/results/scene.txt
  echo
  build/sdmt evaluate --gt demo/scene --results demo/results --benchmark MOT16
fi
echo
ls -l demo/tracks.txt demo/tracks.mp4
cat <<'OWN'

Your own video (a file, a folder of images, camera:0 or an rtsp:// URL):

    build/sdmt track VIDEO --output tracks.txt --render tracks.mp4
    build/sdmt track --help

To have sdmt on the PATH: cmake --install build (as root; into /usr/local).
OWN

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The Debian packages, in build-package/: sdmt, sdmt-models, libsdmt0, libsdmt-dev, python3-sdmt.
#
#   scripts/packages.sh            builds them (needs scripts/install-dependencies.sh test, dpkg-dev)
#   scripts/packages.sh --try DIR  and tries them in a bare Debian 12 below DIR, made by debootstrap
#                                  (needs root): installs, tracks with both, removes, looks for rests
set -euo pipefail
cd "$(dirname "$0")/.."

cmake --preset package
cmake --build build-package --parallel "${SDMT_JOBS:-$(nproc)}"
(cd build-package && rm -f ./*.deb && cpack -G DEB >/dev/null)
ls -l build-package/*.deb
[ "${1:-}" = --try ] || exit 0

root=$(mkdir -p "$2" && cd "$2" && pwd)/debian
mirror=${SDMT_MIRROR:-http://deb.debian.org/debian}
[ -d "$root/usr" ] || debootstrap --variant=minbase bookworm "$root" "$mirror"
if [ -f /etc/apt/apt.conf ] || [ -d /etc/apt/apt.conf.d ]; then
  cp -r /etc/apt/apt.conf.d/. "$root/etc/apt/apt.conf.d/"
fi
inside() { chroot "$root" env DEBIAN_FRONTEND=noninteractive LC_ALL=C "$@"; }
mount -t proc proc "$root/proc"
trap 'umount "$root/proc"' EXIT
rm -rf "$root/scene"  # of an earlier try
build-package/sdmt synth scene --output "$root/scene" --frames 60 --width 320 --height 180
mkdir -p "$root/packages" && cp build-package/*.deb "$root/packages/"
inside apt-get update -qq
# What the packages need comes first, so that the lists before and after differ by them alone.
inside sh -c 'apt-get install -y -qq --no-install-recommends /packages/*.deb >/dev/null
  apt-get purge -y -qq sdmt sdmt-models libsdmt0 libsdmt-dev python3-sdmt >/dev/null'
inside sh -c 'find /usr /etc /var/lib -xdev ! -path "/var/lib/dpkg/*" ! -path "/var/lib/apt/*" | sort' \
  >"$root/before"
inside sh -c 'dpkg -i /packages/*.deb >/dev/null'
inside sdmt --version
inside sdmt track /scene --output /command.txt
inside python3 - <<'MODULE'
import sdmt
boxes = sdmt.read_detections("/scene/det/det.txt")
tracker = sdmt.Tracker(scores=boxes.has_scores)
frames = [f for t in range(1, boxes.last_frame + 1) for f in tracker.update(*boxes.frame(t))]
sdmt.write_results("/module.txt", frames + tracker.finish())
sdmt.Embedder("sdmt-lite")
MODULE
inside sdmt track /scene --no-appearance --output /motion.txt
cmp "$root/module.txt" "$root/motion.txt"
echo "python3-sdmt and sdmt track: the same bytes"
inside sh -c 'apt-get purge -y -qq sdmt sdmt-models libsdmt0 libsdmt-dev python3-sdmt >/dev/null'
inside sh -c 'find /usr /etc /var/lib -xdev ! -path "/var/lib/dpkg/*" ! -path "/var/lib/apt/*" | sort' \
  >"$root/after"
diff "$root/before" "$root/after" && echo "removed: nothing is left"

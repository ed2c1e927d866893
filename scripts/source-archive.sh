#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The source as build-package/sdmt-VERSION.tar.gz: what is committed, the same bytes whenever and
# wherever it is made. Prints its SHA-256.
#
#   scripts/source-archive.sh [COMMIT]       default: HEAD
set -euo pipefail
cd "$(dirname "$0")/.."

version=$(sed -n 's/^project(sdmt VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
mkdir -p build-package
archive=build-package/sdmt-$version.tar.gz
git -c core.autocrlf=false -c tar.umask=0022 archive --format=tar --prefix="sdmt-$version/" \
  "${1:-HEAD}" | gzip -9n >"$archive"
sha256sum "$archive"

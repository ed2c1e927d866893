#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# clang-format over every source file, and clang-tidy over the sources.
#
#   scripts/check-style.sh                 formatting only
#   scripts/check-style.sh --tidy          and clang-tidy over all sources (needs build/)
#   scripts/check-style.sh --tidy FILE...  and clang-tidy over these
set -euo pipefail
cd "$(dirname "$0")/.."

git ls-files '*.h' '*.cpp' | xargs clang-format --dry-run --Werror
echo "clang-format: clean"
[ "${1:-}" = --tidy ] || exit 0
shift
files=("$@")
if [ ${#files[@]} -eq 0 ]; then mapfile -t files < <(git ls-files 'src/*.cpp' 'tools/*.cpp'); fi
printf '%s\n' "${files[@]}" | xargs -P "$(nproc)" -n 1 clang-tidy -p build --quiet
echo "clang-tidy: clean"

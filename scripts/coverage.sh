#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Line coverage of src/ and tools/ by all tests: prints a table, leaves build-coverage/coverage.html.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install-dependencies.sh test
command -v gcovr >/dev/null || { echo "$0: needs gcovr (scripts/install-dependencies.sh develop)" >&2; exit 1; }
cmake --preset coverage
cmake --build build-coverage --parallel "$(nproc)"
find build-coverage -name '*.gcda' -delete
ctest --test-dir build-coverage --output-on-failure --parallel "$(nproc)"
gcovr --root . --object-directory build-coverage --filter 'src/' --filter 'tools/' \
  --exclude-throw-branches --gcov-ignore-parse-errors \
  --html-details build-coverage/coverage.html --print-summary

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What is too slow for every change.
#
#   scripts/nightly.sh [PART...]       default: all parts
#
# sanitize  all tests under AddressSanitizer and UndefinedBehaviorSanitizer; the benchmarks build
# threads   the multi-threaded tests of nn, track and the C interface under ThreadSanitizer
# fuzz      the readers of ground truth, results and models, and the C interface, FUZZ_SECONDS (600) each
# faults    file calls and allocations of all commands fail once; hostile files; kill -9; full disks
# docs      every code block of the pages that python.docs does not run
# mpi       trainings of 8 and 16 processes, 30 kills, helgrind over two
# soak      200,000 frames without growth of memory or time; a million of a camera with zones, broker and page;
#           sixteen cameras for ten minutes
# live      cameras that are lost 50 times in a row, 30 kills, a full disk for a minute, how late a slow network is
# practice  an embedder trained on made-up people alone tells strangers apart
# people    with the network PETS09-S2L1 has fewer ID switches and a higher IDF1 than by motion alone
# browser   the HTML reports and the page of --serve in headless Chromium, screenshots in build/screenshots
# arm       nn and track for 64-bit ARM, their tests under qemu
set -euo pipefail
cd "$(dirname "$0")/.."
jobs=$(nproc)

sanitize() {
  cmake --preset dev -DSDMT_BUILD_BENCH=ON
  cmake --build build-dev --parallel "$jobs"
  ctest --preset dev --parallel "$jobs"
}

threads() {
  cmake --preset tsan
  cmake --build build-tsan --parallel "$jobs" --target test_nn test_track test_c
  ctest --preset tsan -R '^(nn|track|c)\.' --parallel "$jobs"
}

fuzz() {
  cmake --preset fuzz
  cmake --build build-fuzz --parallel "$jobs" --target fuzz_ground_truth fuzz_results \
    fuzz_safetensors fuzz_snapshot fuzz_c
  for reader in ground_truth results safetensors snapshot c; do
    mkdir -p build-fuzz/found-$reader
    build-fuzz/fuzz_$reader -max_total_time="${FUZZ_SECONDS:-600}" -max_len=262144 \
      build-fuzz/found-$reader tests/fuzz/corpus/$reader
  done
}

faults() {
  cmake --preset release -DSDMT_BUILD_TESTS=ON
  cmake --build build --parallel "$jobs" --target sdmt fault_injector
  python3 tests/faults/hostile.py --sdmt build/sdmt
  python3 tests/faults/kills.py --sdmt build/sdmt
  # In a name space of its own anybody may mount.
  unshare --mount --map-root-user python3 tests/faults/disks.py --sdmt build/sdmt
  python3 tests/faults/faults.py --sdmt build/sdmt \
    --injector build/tests/faults/libfault_injector.so --most 60
}

docs() {
  cmake --preset release
  cmake --build build --parallel "$jobs" --target sdmt
  local includes=()
  for module in io mot image nn reid track c; do includes+=("src/$module/include"); done
  python3 -B tests/docs/blocks_test.py build/sdmt . c++ "${includes[@]/#/$PWD/}"
}

browser() {
  cmake --preset release
  cmake --build build --parallel "$jobs" --target sdmt
  local work=build/screenshots
  rm -rf $work
  mkdir -p $work/results
  build/sdmt synth scene --output $work/scene --frames 200 --walkers 10
  build/sdmt track $work/scene --appearance histogram --output $work/results/scene.txt
  build/sdmt evaluate --gt $work/scene --results $work/results --report $work/evaluation.html
  build/sdmt ablate --sequences $work/scene --report $work/ablation.html \
    --variants "lambda=0.5" SORT "tuned, colour histogram" "tuned, no appearance"
  build/sdmt synth reid --output $work/reid --identities 30
  build/sdmt validate-roc --data $work/reid --model models/sdmt-vgg16.safetensors --baselines \
    --report $work/roc.html
  for page in evaluation ablation roc; do
    for width in 390 1280; do
      chromium --headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking \
        --disable-component-update --disable-sync --user-data-dir=$work/profile \
        --window-size=$width,2400 --screenshot=$work/$page-$width.png \
        "file://$PWD/$work/$page.html"
      test -s $work/$page-$width.png
    done
  done
  python3 -B tests/live/page.py --sdmt build/sdmt --folder $work
}

mpi() {
  cmake --preset release -DSDMT_BUILD_TESTS=ON
  cmake --build build --parallel "$jobs" --target sdmt
  python3 tests/mpi/shared_training.py --sdmt build/sdmt --mpirun mpirun \
    bytes ranks faults launch races kills
}

soak() {
  cmake --preset release
  cmake --build build --parallel "$jobs" --target test_track sdmt
  SDMT_SOAK_FRAMES=200000 build/test_track --gtest_filter='Soak*'
  python3 -B tests/live/soak.py --sdmt build/sdmt
  python3 -B tests/live/many_cameras.py --sdmt build/sdmt
}

live() {
  local sequence=../shared/data/mot15/PETS09-S2L1 model=models/sdmt-vgg16.safetensors
  cmake --preset release
  cmake --build build --parallel "$jobs" --target sdmt
  export SDMT_BINARY=build/sdmt SDMT_SCHEMAS=docs SDMT_LOSSES=50 SDMT_KILLS=30
  for file in rtsp stream outputs; do python3 -B tests/live/${file}_test.py; done
  unshare --mount --map-root-user python3 -B tests/live/full_disk.py --sdmt build/sdmt
  [ -d $sequence/img1 ] || { echo "skipped: $sequence is not here"; return; }
  python3 -B tests/live/lag.py --sdmt build/sdmt --sequence $sequence --model $model
  python3 -B bench/cameras.py --sdmt build/sdmt --sequence $sequence --model $model --rounds 1
}

practice() {
  cmake --preset release
  cmake --build build --parallel "$jobs" --target sdmt
  local work=build/practice
  rm -rf $work && mkdir $work
  build/sdmt synth reid --output $work/people
  build/sdmt train-embedder --data $work/people --config train-quick --iterations 1000 \
    --output $work/model.safetensors
  build/sdmt validate-roc --model $work/model.safetensors --data $work/people --baselines |
    tee $work/roc.txt
  awk '$1 == "person-only" { auc = $2 } END { exit !(auc > 0.95) }' $work/roc.txt
}

people() {
  local sequence=../shared/data/mot15/PETS09-S2L1 work=build/people run
  [ -d $sequence/img1 ] || { echo "skipped: $sequence is not here"; return; }
  cmake --preset release
  cmake --build build --parallel "$jobs" --target sdmt
  for run in network none; do
    mkdir -p $work/$run
    build/sdmt track $sequence --detections $sequence/det/det-frcnn.txt --config detector-frcnn \
      --appearance $run --output $work/$run/PETS09-S2L1.txt
    build/sdmt evaluate --gt $sequence --results $work/$run --benchmark MOT15 --json $work/$run.json
  done
  python3 - $work/network.json $work/none.json <<'COMPARE'
import json, sys
network, none = (json.load(open(path))["combined"] for path in sys.argv[1:])
assert network["IDF1"] > none["IDF1"] and network["IDSW"] < none["IDSW"], (network, none)
COMPARE
}

# Cross-compiles nn and track with their tests against Debian's arm64 packages, unpacked and not
# installed, and runs the tests under qemu. The lists of arm64 are kept apart from the machine's.
arm() {
  local root=build-arm/sysroot apt=build-arm/apt
  mkdir -p $root build-arm/packages $apt/lists/partial $apt/archives/partial
  local options=(-qq -o Dir::State::lists="$PWD/$apt/lists" -o Dir::Cache="$PWD/$apt"
    -o Dir::State::status=/dev/null -o APT::Architecture=arm64 -o APT::Architectures::=arm64)
  apt-get "${options[@]}" update
  (cd build-arm/packages && apt-get "${options[@]}" download libhwy1 libhwy-dev libgtest-dev \
    libgmock-dev googletest libgomp1)
  for package in build-arm/packages/*.deb; do dpkg-deb -x "$package" $root; done
  cp -r /usr/include/nlohmann $root/usr/include/
  cmake -S . -B build-arm -G Ninja --toolchain cmake/aarch64-linux-gnu.cmake \
    -DSDMT_SYSROOT="$PWD/$root" -DCMAKE_BUILD_TYPE=Release \
    -DSDMT_BUILD_TOOLS=OFF -DSDMT_BUILD_TRAIN=OFF -DSDMT_BUILD_TESTS=ON
  cmake --build build-arm --parallel "$jobs"
  ctest --test-dir build-arm --output-on-failure -R '^(nn|track|eval)\.'
}

parts=("$@")
[ ${#parts[@]} -gt 0 ] || parts=(sanitize threads fuzz faults docs mpi soak live practice people browser arm)
for part in "${parts[@]}"; do
  declare -F "$part" >/dev/null || { sed -n '3,19s/^# \{0,1\}//p' "$0" >&2; exit 2; }
done
scripts/install-dependencies.sh develop
for part in "${parts[@]}"; do
  echo "== $part"
  "$part"
done

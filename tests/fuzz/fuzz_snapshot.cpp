// SPDX-License-Identifier: Apache-2.0
// Any bytes behind a good head either are refused with std::invalid_argument or make a tracker that
// tracks.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <vector>

#include "sdmt/track/tracker.h"

namespace {

constexpr std::size_t kHead = 16, kWord = 8;

// Head and options of a new tracker, then the fuzzer's bytes, with the right checksum.
std::vector<std::byte> snapshot_with(std::span<const std::byte> content) {
  static const std::vector<std::byte> fresh = sdmt::track::Tracker().save();
  static constexpr std::size_t state_bytes = 209;  // of a new tracker, behind options and tau_a
  std::vector<std::byte> bytes(fresh.begin(),
                               fresh.end() - static_cast<std::ptrdiff_t>(state_bytes));
  bytes.insert(bytes.end(), content.begin(), content.end());
  std::uint64_t sum = 0xcbf29ce484222325;
  for (std::size_t i = kHead; i < bytes.size(); i += kWord) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, std::min(kWord, bytes.size() - i));
    sum = (sum ^ word) * 0x100000001b3;
  }
  std::memcpy(bytes.data() + kHead - kWord, &sum, kWord);
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sdmt;
  track::Tracker tracker;
  try {
    tracker.restore(snapshot_with(std::as_bytes(std::span(data, size))));
  } catch (const std::invalid_argument&) {
    return 0;
  }
  const mot::Detection person{{100, 100, 40, 90}, 0.9};
  for (int frame = 0; frame < 40; ++frame) tracker.update(std::span(&person, 1));
  tracker.finish();
  return 0;
}

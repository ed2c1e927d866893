// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace sdmt::track {

static_assert(std::endian::native == std::endian::little, "snapshots are little endian");

/// Writes values one after the other. It and StateReader take the same calls, so that what is said
/// once about a struct is both its writing and its reading.
class StateWriter {
 public:
  static constexpr bool kReads = false;

  template <typename Number>
  requires std::is_arithmetic_v<Number>
  void value(const Number& number) {
    const auto* first = reinterpret_cast<const std::byte*>(&number);
    bytes_.insert(bytes_.end(), first, first + sizeof number);
  }
  void check(bool, const char*) const {}

  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

/// Reads what StateWriter wrote. The bytes may be anybody's: every number is finite, a bool 0 or 1,
/// and nothing is made that is larger than the bytes that are left could fill.
class StateReader {
 public:
  static constexpr bool kReads = true;

  explicit StateReader(std::span<const std::byte> bytes) : left_(bytes) {}

  template <typename Number>
  requires std::is_arithmetic_v<Number>
  void value(Number& number) {
    check(left_.size() >= sizeof number, "ends too early");
    if constexpr (std::is_same_v<Number, bool>) {
      check(left_[0] <= std::byte{1}, "holds a switch that is neither on nor off");
    }
    std::memcpy(&number, left_.data(), sizeof number);
    left_ = left_.subspan(sizeof number);
    if constexpr (std::is_floating_point_v<Number>) {
      check(std::isfinite(number), "holds a number that is not finite");
    }
  }
  /// Throws std::invalid_argument `snapshot: WRONG` unless `holds`.
  void check(bool holds, const char* wrong) const {
    if (!holds) throw std::invalid_argument(std::string("snapshot: ") + wrong);
  }
  std::size_t left() const { return left_.size(); }

 private:
  std::span<const std::byte> left_;
};

/// A list, each entry of at least one byte, by `each(entry)`; a reader makes entries by `make()`.
template <typename Archive, typename List, typename Make, typename Each>
void archive_list(Archive& archive, List& list, Make make, Each each) {
  auto size = static_cast<std::uint64_t>(list.size());
  archive.value(size);
  if constexpr (Archive::kReads) {
    archive.check(size <= archive.left(), "holds a list that is longer than itself");
    list.clear();
    for (std::uint64_t i = 0; i < size; ++i) {
      list.push_back(make());
      each(list.back());
    }
  } else {
    for (auto& entry : list) each(entry);
  }
}

template <typename Archive, typename List>
void archive_numbers(Archive& archive, List& list) {
  archive_list(
      archive, list, [] { return typename List::value_type{}; },
      [&](auto& number) { archive.value(number); });
}

}  // namespace sdmt::track

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/benchmark.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <stdexcept>
#include <string>

#include "sdmt/io/checked_value.h"

namespace sdmt::eval {

namespace {

constexpr std::array<std::string_view, 4> kBenchmarkNames{"MOT15", "MOT16", "MOT17", "MOT20"};
constexpr std::array<std::string_view, 2> kCompatNames{"trackeval", "devkit"};
constexpr std::array<std::string_view, kNumCategories> kCategoryNames{
    "pedestrian", "person on vehicle",     "car",           "bicycle",
    "motorbike",  "non-motorised vehicle", "static person", "distractor",
    "occluder",   "occluder on ground",    "occluder full", "reflection",
    "crowd"};

}  // namespace

Benchmark parse_benchmark(std::string_view name) {
  std::string upper(name);
  std::transform(upper.begin(), upper.end(), upper.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  const auto found = std::find(kBenchmarkNames.begin(), kBenchmarkNames.end(), upper);
  if (found == kBenchmarkNames.end()) {
    throw std::invalid_argument("benchmark is " + io::quoted(name) +
                                "', expected MOT15, MOT16, MOT17 or MOT20");
  }
  return static_cast<Benchmark>(found - kBenchmarkNames.begin());
}

std::string_view to_string(Benchmark benchmark) {
  return kBenchmarkNames.at(static_cast<std::size_t>(benchmark));
}

Compat parse_compat(std::string_view name) {
  const auto found = std::find(kCompatNames.begin(), kCompatNames.end(), name);
  if (found == kCompatNames.end()) {
    throw std::invalid_argument("compat is " + io::quoted(name) + ", expected trackeval or devkit");
  }
  return static_cast<Compat>(found - kCompatNames.begin());
}

std::string_view to_string(Compat compat) {
  return kCompatNames.at(static_cast<std::size_t>(compat));
}

std::string_view category_name(int category) {
  return kCategoryNames.at(static_cast<std::size_t>(category) - 1);
}

bool is_distractor(int category, Benchmark benchmark) {
  constexpr int kPersonOnVehicle = 2, kNonMotorised = 6, kStaticPerson = 7, kDistractor = 8,
                kReflection = 12;
  switch (category) {
    case kPersonOnVehicle:
    case kStaticPerson:
    case kDistractor:
    case kReflection:
      return benchmark != Benchmark::mot15;
    case kNonMotorised:
      return benchmark == Benchmark::mot20;
    default:
      return false;
  }
}

}  // namespace sdmt::eval

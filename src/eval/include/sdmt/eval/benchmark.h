// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace sdmt::eval {

/// Which MOTChallenge rules say what ground truth counts and which result boxes are not held
/// against a tracker; see prepare_sequence().
enum class Benchmark { mot15, mot16, mot17, mot20 };

/// "MOT15", "MOT16", "MOT17" or "MOT20", upper or lower case. Throws std::invalid_argument.
Benchmark parse_benchmark(std::string_view name);
std::string_view to_string(Benchmark benchmark);

/// Whose counting rules to follow where the two reference evaluators differ.
enum class Compat {
  trackeval,  ///< TrackEval, the official evaluator of MOTChallenge since 2021
  devkit,     ///< the MATLAB devkit that scored papers up to 2020
};

/// "trackeval" or "devkit". Throws std::invalid_argument.
Compat parse_compat(std::string_view name);
std::string_view to_string(Compat compat);

/// Classes of a MOT16 (17, 20) ground-truth row.
inline constexpr int kPedestrian = 1;
inline constexpr int kNumCategories = 13;
/// "pedestrian", "person on vehicle", ...; category in 1..13.
std::string_view category_name(int category);

/// Classes whose boxes are too much like a pedestrian to punish a tracker for following them.
bool is_distractor(int category, Benchmark benchmark);

}  // namespace sdmt::eval

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sdmt/tuning/tuning_result.h"

namespace sdmt::tuning {

/// The result as the text of a JSON file:
///   {"sequences": 7, "settings": 9, "draws": 4,
///    "base": {"mota": 0.66, "idf1": 0.72, "pooled_mota": ..., "pooled_idf1": ...,
///             "gain_mota": ..., "gain_mota_error": ..., "gain_idf1": ..., "gain_idf1_error": ...},
///    "in_sample": {...}, "held_out": {...}, "bytetrack": {...},
///    "chosen": {OPTION: VALUE, ...},
///    "options": [{"option", "base", "chosen", "worth_in_sample", "worth_held_out"}, ...],
///    "by_sequence": [{"sequence", "detections", "chosen_without_it": {OPTION: VALUE, ...},
///                     "held_out": {"mota", "idf1"}, "base": {...}, "bytetrack": {...}}, ...]}
/// Values of options are texts, scores fractions. Bytes that are not UTF-8 become U+FFFD.
std::string tuning_json(const TuningResult& result);

/// Options as the text of a JSON file for --config, and for Python's Tracker(config=...): what
/// differs from the tuned preset.
std::string preset_json(const track::TrackerOptions& options);

}  // namespace sdmt::tuning

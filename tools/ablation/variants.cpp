// SPDX-License-Identifier: Apache-2.0
#include "ablation/ablation.h"

namespace sdmt::tools {

std::vector<AblationVariant> ablation_variants(
    const std::optional<track::ScoreCalibration>& calibration, bool amodal) {
  using track::TrackerOptions;
  const auto paper = [](auto change) {
    TrackerOptions options = TrackerOptions::paper();
    change(options);
    return options;
  };
  TrackerOptions tuned = TrackerOptions::tuned();
  tuned.input.calibration = calibration;
  TrackerOptions online = TrackerOptions::online();
  online.input.calibration = calibration;
  if (amodal) {
    tuned.output.amodal = online.output.amodal = track::OutputOptions::kInputSize;
  }
  constexpr auto kNetwork = VariantAppearance::network;
  constexpr auto kHistogram = VariantAppearance::histogram;
  constexpr auto kNone = VariantAppearance::none;

  std::vector<AblationVariant> rows{
      {"lambda=0.5",
       "λ = 0.5",
       kNetwork,
       paper([](auto& o) { o.assignment.lambda = 0.5; }),
       {},
       PaperRow{0.346, 6014, 65863, 317, 29.8}},
      {"lambda=0",
       "λ = 0",
       kNetwork,
       paper([](auto& o) { o.assignment.lambda = 0; }),
       {},
       PaperRow{0.343, 6541, 65651, 295, 29.6}},
      {"lambda=1",
       "λ = 1",
       kNetwork,
       paper([](auto& o) { o.assignment.lambda = 1; }),
       {},
       PaperRow{0.339, 6512, 66040, 373, 28.7}},
      {"with boosting",
       "boosting",
       kNetwork,
       paper([](auto& o) { o.boosting.enabled = true; }),
       {},
       PaperRow{0.342, 6743, 65533, 334, 25.9}},
      {"without association",
       "no assoc.",
       kNetwork,
       paper([](auto& o) { o.association.enabled = false; }),
       {},
       PaperRow{0.324, 3968, 69965, 686, 31.6}},
      {"without appearance",
       "no app.",
       kNone,
       paper([](auto&) {}),
       {},
       PaperRow{0.329, 4069, 69468, 587, 96.8}},
      {"SORT", "SORT", kNone, {}, track::SortOptions{}, {}},
      {"ByteTrack", "ByteTrack", kNone, tuned, {}, {}, ByteTrackRow{calibration, false}},
      {"ByteTrack, smoothed and filled",
       "ByteTrack, sm.",
       kNone,
       tuned,
       {},
       {},
       ByteTrackRow{calibration, true}},
      {"tuned", "tuned", kNetwork, tuned, {}, {}},
      {"tuned, colour histogram", "tuned, hist.", kHistogram, tuned, {}, {}},
      {"tuned, no appearance", "tuned, motion", kNone, tuned, {}, {}},
      {"online, no appearance", "online, motion", kNone, online, {}, {}},
  };
  return rows;
}

}  // namespace sdmt::tools

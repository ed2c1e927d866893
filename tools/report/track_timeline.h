// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "evaluation/evaluation.h"

namespace sdmt::tools {

struct TimelineOptions {
  int width = 936;      ///< pixels
  int max_people = 60;  ///< those with most boxes are shown; >= 1
  int max_false = 12;   ///< likewise for result tracks that match nobody
};

/// A row for each person of the ground truth: grey while they are there, in the colour of the
/// result id where they are matched, a red tick at each counted identity switch. Below, result
/// tracks that match nobody (EventOptions' default says which). An SVG document.
std::string track_timeline_svg(const SequenceEvaluation& sequence,
                               const TimelineOptions& options = {});

}  // namespace sdmt::tools

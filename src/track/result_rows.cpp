// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/result_rows.h"

namespace sdmt::track {

void append_results(const FinishedFrame& frame, std::vector<mot::ResultRow>& rows) {
  for (const TrackedBox& box : frame.boxes) {
    rows.push_back({frame.frame, box.id, box.box, box.score});
  }
}

}  // namespace sdmt::track

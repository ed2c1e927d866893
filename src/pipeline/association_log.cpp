// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/association_log.h"

#include <fmt/core.h>

namespace sdmt::pipeline {

AssociationLog::AssociationLog(const std::string& path, track::Tracker& tracker) : file_(path) {
  file_.write("frame,older,newer,gap,affinity,verdict\n");
  tracker.on_association([this](const track::AssociationDecision& decision) {
    file_.write(fmt::format("{},{},{},{},{:.4f},{}\n", decision.frame, decision.older,
                            decision.newer, decision.gap, decision.affinity,
                            track::to_string(decision.verdict)));
  });
}

}  // namespace sdmt::pipeline

// SPDX-License-Identifier: Apache-2.0
#include "synth/drawing_run.h"

#include "cli/console.h"
#include "cli/progress.h"
#include "cli/stop_signal.h"

namespace sdmt::tools {

void run_drawing(int total, const std::string& unit, const std::string& summary,
                 const std::function<bool(const DrawingProgress&)>& draw) {
  const StopSignal stop;
  bool whole = false;
  {
    Progress progress("drawing", total, unit);
    whole = draw([&](int done) {
      progress.update(done);
      return !stop.requested();
    });
  }
  note("{}\n", whole ? summary : "stopped, nothing written");
}

}  // namespace sdmt::tools

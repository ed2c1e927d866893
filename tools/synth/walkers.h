// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/nn/random.h"
#include "synth/ground_camera.h"
#include "synth/person_drawing.h"

namespace sdmt::tools {

struct Walker {
  int id = 0;
  PersonLook look;
  double height = 1.75;  ///< metres
  GroundPoint at;
  GroundPoint goal;
  double speed = 1.3;  ///< metres per second
  double phase = 0;    ///< of the walking cycle, 0..1
  double facing = 0;   ///< as PersonPose
  double rest = 0;     ///< seconds it still stands still
  bool will_rest = false;
};

/// People who cross a place from side to side or from near to far; for each who has left another
/// one comes.
class Walkers {
 public:
  /// `count` people at a time, the first ones spread over their ways.
  /// `uniform`: all look like the first one, but for their heights.
  Walkers(const GroundCamera& camera, int count, bool uniform, nn::Random random);

  const std::vector<Walker>& all() const { return walkers_; }
  /// Moves everybody on.
  void step(double seconds);

 private:
  Walker enter();
  bool has_left(const Walker& walker) const;

  GroundCamera camera_;
  bool uniform_;
  nn::Random random_;
  std::vector<Walker> walkers_;
  int last_id_ = 0;
};

}  // namespace sdmt::tools

// SPDX-License-Identifier: Apache-2.0
#include "synth/walkers.h"

#include <cmath>
#include <numbers>

namespace sdmt::tools {

namespace {

constexpr double kNearest = 9.5;  // metres ahead of the camera
constexpr double kFarthest = 27;
constexpr double kStride = 1.5;  // metres a full cycle of both legs
constexpr double kMargin = 1.0;  // metres beyond the image's edge

}  // namespace

Walkers::Walkers(const GroundCamera& camera, int count, bool uniform, nn::Random random)
    : camera_(camera), uniform_(uniform), random_(random) {
  for (int i = 0; i < count; ++i) {
    Walker walker = enter();
    const double way = random_.uniform(0.05, 0.85);
    walker.at = {walker.at.x + way * (walker.goal.x - walker.at.x),
                 walker.at.z + way * (walker.goal.z - walker.at.z)};
    walkers_.push_back(walker);
  }
  step(0);  // so that everybody faces their way
}

Walker Walkers::enter() {
  Walker walker;
  walker.id = ++last_id_;
  walker.look = random_look(random_);
  if (uniform_ && !walkers_.empty()) walker.look = walkers_.front().look;
  walker.height = random_.uniform(1.6, 1.88);
  walker.speed = random_.uniform(0.95, 1.6);
  walker.phase = random_.uniform();
  walker.will_rest = random_.uniform() < 0.12;
  const double from = random_.uniform(kNearest, kFarthest);
  const double to = random_.uniform(kNearest, kFarthest);
  const double side = random_.uniform() < 0.5 ? -1 : 1;
  walker.at = {side * (camera_.half_width_at(from) + kMargin), from};
  walker.goal = {-side * (camera_.half_width_at(to) + 2 * kMargin), to};
  return walker;
}

bool Walkers::has_left(const Walker& walker) const {
  const double side = walker.goal.x > 0 ? 1 : -1;
  return side * walker.at.x > camera_.half_width_at(walker.at.z) + kMargin;
}

void Walkers::step(double seconds) {
  for (Walker& walker : walkers_) {
    if (has_left(walker)) walker = enter();
    if (walker.rest > 0) {
      walker.rest -= seconds;
      continue;
    }
    if (walker.will_rest && std::abs(walker.at.x) < 3) {
      walker.will_rest = false;
      walker.rest = random_.uniform(1, 4);
    }
    const double dx = walker.goal.x - walker.at.x;
    const double dz = walker.goal.z - walker.at.z;
    const double length = std::hypot(dx, dz);
    const double way = walker.speed * seconds;
    walker.at = {walker.at.x + way * dx / length, walker.at.z + way * dz / length};
    walker.facing = std::atan2(dx, -dz) * 180 / std::numbers::pi;
    walker.phase = std::fmod(walker.phase + way / kStride, 1.0);
  }
}

}  // namespace sdmt::tools

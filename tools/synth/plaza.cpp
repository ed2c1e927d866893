// SPDX-License-Identifier: Apache-2.0
#include "synth/plaza.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "sdmt/nn/random.h"

namespace sdmt::tools {

namespace {

constexpr double kHousesAt = 34;  // metres from the camera

// A number in [0, 1) that belongs to a cell of a grid.
double cell_noise(std::uint64_t seed, int a, int b) {
  const auto stream = (static_cast<std::uint64_t>(static_cast<std::uint32_t>(a)) << 32) |
                      static_cast<std::uint32_t>(b);
  return nn::Random(seed, stream).uniform();
}

// The same, smoothed between the cells.
double smooth_noise(std::uint64_t seed, double x, double y) {
  const int ix = static_cast<int>(std::floor(x));
  const int iy = static_cast<int>(std::floor(y));
  const auto ease = [](double t) { return t * t * (3 - 2 * t); };
  const double tx = ease(x - ix);
  const double ty = ease(y - iy);
  const auto row = [&](int cell_y) {
    return (1 - tx) * cell_noise(seed, ix, cell_y) + tx * cell_noise(seed, ix + 1, cell_y);
  };
  return (1 - ty) * row(iy) + ty * row(iy + 1);
}

double smooth_step(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

cv::Scalar shade(const cv::Scalar& colour, double light) {
  return {colour[0] * light, colour[1] * light, colour[2] * light};
}

// Paving: stones of 0.8 x 0.8 m in two tones, with joints that vanish in the distance.
cv::Vec3d paving(std::uint64_t seed, const GroundPoint& at) {
  constexpr double kStone = 0.8;
  const double row = at.z / kStone;
  const int iz = static_cast<int>(std::floor(row));
  const double column = at.x / kStone + (iz % 2 == 0 ? 0.0 : 0.5);
  const int ix = static_cast<int>(std::floor(column));
  double tone = 0.86 + 0.12 * cell_noise(seed, ix, iz);
  tone *= 0.93 + 0.14 * smooth_noise(seed + 1, at.x * 0.35, at.z * 0.35);
  const double edge = std::min({row - iz, 1 - (row - iz), column - ix, 1 - (column - ix)}) * kStone;
  const double joint = 0.02 + 0.0022 * at.z;
  tone *= 1 - 0.28 * (1 - smooth_step(joint * 0.5, joint, edge)) / (1 + at.z / 14);
  const bool dark_band = std::abs(std::remainder(at.x, 8.0)) < 0.8;
  return cv::Vec3d(168, 178, 186) * (tone * (dark_band ? 0.82 : 1.0));
}

}  // namespace

Plaza::Plaza(const GroundCamera& camera, std::uint64_t seed)
    : camera_(camera), background_(camera.image(), CV_8UC3) {
  nn::Random random(seed, 1);
  const auto place = [&](Occluder::Kind kind, double x, double z) {
    occluders_.push_back({kind, {x + random.uniform(-0.6, 0.6), z + random.uniform(-0.6, 0.6)}});
  };
  place(Occluder::Kind::advertising_column, 2.6, 13.0);
  place(Occluder::Kind::tree, -6.2, 18.5);
  place(Occluder::Kind::tree, 8.4, 22.0);
  place(Occluder::Kind::lamp_post, -2.4, 11.0);
  place(Occluder::Kind::lamp_post, 4.8, 17.5);
  paint_sky_and_houses(seed + 2);
  paint_ground(seed + 3);
}

double Plaza::light_at(const GroundPoint& point) const {
  const double border = 21.5 + 0.25 * point.x + 0.8 * std::sin(point.x * 0.9);
  return 1 - 0.34 * smooth_step(border - 0.4, border + 0.4, point.z);
}

void Plaza::paint_sky_and_houses(std::uint64_t seed) {
  const int rows = background_.rows;
  for (int y = 0; y < rows; ++y) {
    const double t = static_cast<double>(y) / rows;
    background_.row(y).setTo(cv::Scalar(236 - 30 * t, 214 + 10 * t, 190 + 40 * t));
  }
  nn::Random random(seed);
  const std::array<cv::Scalar, 5> fronts{cv::Scalar(122, 150, 178), cv::Scalar(150, 158, 164),
                                         cv::Scalar(104, 128, 168), cv::Scalar(140, 168, 180),
                                         cv::Scalar(132, 134, 146)};
  const double reach = camera_.half_width_at(kHousesAt) + 2;
  std::size_t number = 0;
  for (double left = -reach; left < reach; ++number) {
    const double width = random.uniform(7, 11);
    const double height = random.uniform(9, 14);
    const cv::Scalar front = shade(fronts[number % fronts.size()], random.uniform(0.62, 0.78));
    const auto corner = [&](double x, double h) {
      const cv::Point2d p = camera_.project({x, kHousesAt}, h);
      return cv::Point(static_cast<int>(std::lround(p.x)), static_cast<int>(std::lround(p.y)));
    };
    cv::rectangle(background_, corner(left, height), corner(left + width, 0), front, cv::FILLED);
    for (double h = 0.9; h + 1.7 < height; h += 3.1) {
      const bool ground_floor = h < 1;
      const double step = ground_floor ? 3.4 : 2.1;
      for (double x = left + 0.7; x + 1.1 < left + width; x += step) {
        const cv::Scalar glass = shade({96, 84, 70}, random.uniform(0.55, 1.25));
        const double wide = ground_floor ? 2.4 : 1.1;
        if (x + wide > left + width) break;
        cv::rectangle(background_, corner(x - 0.1, h + 1.8), corner(x + wide + 0.1, h - 0.1),
                      shade(front, 1.25), cv::FILLED);
        cv::rectangle(background_, corner(x, h + 1.7), corner(x + wide, h), glass, cv::FILLED);
      }
    }
    cv::rectangle(background_, corner(left, height), corner(left + width, height - 0.4),
                  shade(front, 0.75), cv::FILLED);
    left += width;
  }
}

void Plaza::paint_ground(std::uint64_t seed) {
  constexpr int kSamples = 3;  // along each side of a pixel
  const double first = camera_.project({0, kHousesAt}).y;
  for (int y = std::max(0, static_cast<int>(first)); y < background_.rows; ++y) {
    for (int x = 0; x < background_.cols; ++x) {
      cv::Vec3d sum(0, 0, 0);
      for (int sample = 0; sample < kSamples * kSamples; ++sample) {
        const cv::Point2d at(x + (sample % kSamples + 0.5) / kSamples,
                             y + (static_cast<double>(sample / kSamples) + 0.5) / kSamples);
        const GroundPoint ground = camera_.ground_at(at);
        sum += paving(seed, ground) * light_at(ground);
      }
      sum *= 1.0 / (kSamples * kSamples);
      background_.at<cv::Vec3b>(y, x) =
          cv::Vec3b(cv::saturate_cast<uchar>(sum[0]), cv::saturate_cast<uchar>(sum[1]),
                    cv::saturate_cast<uchar>(sum[2]));
    }
  }
}

cv::Rect2d Plaza::hidden_box(const Occluder& occluder) const {
  switch (occluder.kind) {
    case Occluder::Kind::lamp_post:
      return camera_.upright_box(occluder.foot, 4.5, 0.03);
    case Occluder::Kind::tree:
      return camera_.upright_box(occluder.foot, 2.6, 0.12);
    case Occluder::Kind::advertising_column:
      return camera_.upright_box(occluder.foot, 3.0, 0.45);
  }
  return {};
}

void Plaza::draw(const Occluder& occluder, cv::Mat& image) const {
  const double light = light_at(occluder.foot);
  const cv::Rect2d body = hidden_box(occluder);
  const double metre = camera_.upright_box(occluder.foot, 1, 1).height;
  const cv::Point2d foot(body.x + body.width / 2, body.y + body.height);
  const auto fill = [&](const cv::Rect2d& box, const cv::Scalar& colour) {
    // A round body: bright on the left, dark on the right.
    const int from = static_cast<int>(std::lround(box.x));
    const int to = std::max(from + 1, static_cast<int>(std::lround(box.x + box.width)));
    for (int x = from; x < to; ++x) {
      const double side = (x + 0.5 - from) / (to - from);
      cv::line(image, {x, static_cast<int>(std::lround(box.y))},
               {x, static_cast<int>(std::lround(box.y + box.height))},
               shade(colour, light * (1.15 - 0.6 * side)));
    }
  };
  switch (occluder.kind) {
    case Occluder::Kind::lamp_post: {
      fill(body, {78, 80, 74});
      const cv::Rect2d lamp(foot.x - 0.22 * metre, body.y - 0.3 * metre, 0.44 * metre, 0.4 * metre);
      fill(lamp, {206, 226, 232});
      break;
    }
    case Occluder::Kind::tree: {
      fill(body, {54, 74, 98});
      nn::Random random(
          7, static_cast<std::uint64_t>(std::llabs(std::llround(occluder.foot.x * 1000))));
      for (int leaf = 0; leaf < 420; ++leaf) {
        const double angle = random.uniform(0, 6.2832);
        const double reach = std::sqrt(random.uniform()) * 1.7 * metre;
        const cv::Point2d at(foot.x + reach * std::cos(angle),
                             body.y - 0.8 * metre + 0.75 * reach * std::sin(angle));
        const double bright = 0.75 - 0.25 * std::sin(angle) + random.uniform(-0.15, 0.15);
        cv::circle(image, at, static_cast<int>(0.2 * metre), shade({62, 128, 88}, light * bright),
                   cv::FILLED, cv::LINE_AA);
      }
      break;
    }
    case Occluder::Kind::advertising_column: {
      fill(body, {150, 152, 140});
      const cv::Rect2d poster(body.x, body.y + 0.5 * metre, body.width, 1.7 * metre);
      fill(poster, {70, 110, 205});
      const cv::Rect2d stripe(body.x, body.y + 1.1 * metre, body.width, 0.35 * metre);
      fill(stripe, {214, 226, 230});
      fill({body.x - 0.08 * metre, body.y - 0.18 * metre, body.width + 0.16 * metre, 0.3 * metre},
           {84, 92, 70});
      break;
    }
  }
}

}  // namespace sdmt::tools

// SPDX-License-Identifier: Apache-2.0
#include "synth/person_drawing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace sdmt::tools {

namespace {

// The person is painted once on a sheet of this size and then scaled into its box.
constexpr int kHeight = 256;
constexpr int kWidth = 160;
constexpr double kMiddle = kWidth / 2.0;
constexpr double kShoulder = 48;
constexpr double kHip = 128;
constexpr double kSole = 254;

cv::Vec3b hsv(double hue, double saturation, double value) {
  cv::Mat3b pixel(1, 1);
  pixel(0, 0) = cv::Vec3b(cv::saturate_cast<uchar>(hue), cv::saturate_cast<uchar>(saturation),
                          cv::saturate_cast<uchar>(value));
  cv::cvtColor(pixel, pixel, cv::COLOR_HSV2BGR);
  return pixel(0, 0);
}

// Clothes of the street: half of them black, grey, white or navy, the rest of any hue.
cv::Vec3b cloth_color(nn::Random& random) {
  const double kind = random.uniform();
  if (kind < 0.38)
    return hsv(random.uniform(0, 180), random.uniform(0, 30), random.uniform(25, 240));
  if (kind < 0.52)
    return hsv(random.uniform(104, 122), random.uniform(60, 170), random.uniform(40, 130));
  return hsv(random.uniform(0, 180), random.uniform(70, 220), random.uniform(60, 230));
}

Cloth random_cloth(nn::Random& random, double plain_share) {
  Cloth cloth;
  cloth.color = cloth_color(random);
  cloth.second_color = cloth_color(random);
  cloth.period = random.uniform(9, 26);
  if (random.uniform() >= plain_share) {
    constexpr std::array kPatterns = {Cloth::Pattern::horizontal_stripes,
                                      Cloth::Pattern::vertical_stripes, Cloth::Pattern::checks,
                                      Cloth::Pattern::dots, Cloth::Pattern::two_tone};
    cloth.pattern = kPatterns[random.below(kPatterns.size())];
  }
  return cloth;
}

// x from the middle of the piece, y from its top.
cv::Vec3b cloth_at(const Cloth& cloth, double x, double y) {
  const auto odd = [&](double v) {
    return (static_cast<long>(std::floor(v / cloth.period * 2)) & 1) != 0;
  };
  const auto from_centre = [&](double v) {
    return v - cloth.period * std::round(v / cloth.period);
  };
  bool second = false;
  switch (cloth.pattern) {
    case Cloth::Pattern::plain:
      break;
    case Cloth::Pattern::horizontal_stripes:
      second = odd(y);
      break;
    case Cloth::Pattern::vertical_stripes:
      second = odd(x);
      break;
    case Cloth::Pattern::checks:
      second = odd(x) != odd(y);
      break;
    case Cloth::Pattern::dots:
      second = std::hypot(from_centre(x), from_centre(y)) < 0.3 * cloth.period;
      break;
    case Cloth::Pattern::two_tone:
      second = y > 44;
      break;
  }
  return second ? cloth.second_color : cloth.color;
}

// The sheet: colours and how much of each pixel is covered.
class Sheet {
 public:
  Sheet() : color_(kHeight, kWidth, cv::Vec3b(0, 0, 0)), alpha_(kHeight, kWidth, uchar{0}) {}

  const cv::Mat3b& color() const { return color_; }
  const cv::Mat1b& alpha() const { return alpha_; }

  // A convex piece of cloth; its pattern hangs from (middle, top).
  void cloth(const std::vector<cv::Point2d>& outline, const Cloth& cloth, double middle, double top,
             double shade) {
    paint(
        outline, [&](int x, int y) { return cloth_at(cloth, x - middle, y - top); }, shade);
  }

  void plain(const std::vector<cv::Point2d>& outline, cv::Vec3b color, double shade = 1.0) {
    paint(
        outline, [&](int, int) { return color; }, shade);
  }

  void ellipse(cv::Point2d centre, double rx, double ry, cv::Vec3b color, double shade = 1.0) {
    std::vector<cv::Point2d> outline;
    for (int i = 0; i < 32; ++i) {
      const double angle = 2 * std::numbers::pi * i / 32;
      outline.emplace_back(centre.x + rx * std::cos(angle), centre.y + ry * std::sin(angle));
    }
    plain(outline, color, shade);
  }

 private:
  template <typename ColorAt>
  void paint(const std::vector<cv::Point2d>& outline, ColorAt color_at, double shade) {
    constexpr int kShift = 4;  // OpenCV draws polygons in 1/16 of a pixel
    std::vector<cv::Point> fixed;
    for (const auto& p : outline) {
      fixed.emplace_back(cvRound(p.x * (1 << kShift)), cvRound(p.y * (1 << kShift)));
    }
    cv::Mat1b mask(kHeight, kWidth, uchar{0});
    cv::fillConvexPoly(mask, fixed, cv::Scalar(255), cv::LINE_AA, kShift);
    const auto [left, right] = std::minmax_element(
        outline.begin(), outline.end(), [](const auto& a, const auto& b) { return a.x < b.x; });
    const double middle = 0.5 * (left->x + right->x);
    const double half = std::max(1.0, 0.5 * (right->x - left->x));
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (mask(y, x) == 0) continue;
        // Round bodies are darker towards their sides.
        const double round = 1.0 - 0.28 * std::pow((x - middle) / half, 2);
        const double a = mask(y, x) / 255.0;
        const cv::Vec3b paint = color_at(x, y);
        for (int c = 0; c < 3; ++c) {
          color_(y, x)[c] =
              cv::saturate_cast<uchar>((1 - a) * color_(y, x)[c] + a * paint[c] * shade * round);
        }
        alpha_(y, x) = std::max(alpha_(y, x), mask(y, x));
      }
    }
  }

  cv::Mat3b color_;
  cv::Mat1b alpha_;
};

// A bar of changing width from a to b.
std::vector<cv::Point2d> limb(cv::Point2d a, cv::Point2d b, double width_a, double width_b) {
  const cv::Point2d along = b - a;
  const double length = std::max(1e-6, std::hypot(along.x, along.y));
  const cv::Point2d across(-along.y / length, along.x / length);
  return {a + across * (width_a / 2), b + across * (width_b / 2), b - across * (width_b / 2),
          a - across * (width_a / 2)};
}

cv::Point2d between(cv::Point2d a, cv::Point2d b, double part) { return a + (b - a) * part; }

// Draws the limbs of one side (+1 or -1), whose swing runs half a cycle after the other's.
class Figure {
 public:
  Figure(Sheet& sheet, const PersonLook& look, const PersonPose& pose)
      : sheet_(sheet),
        look_(look),
        angle_(pose.facing * std::numbers::pi / 180),
        swing_(std::sin(2 * std::numbers::pi * pose.phase)),
        head_x_(kMiddle + pose.lean * kHeight),
        // Seen from the side a body is narrower.
        half_width_(look.build * (15 + 9 * std::abs(std::cos(angle_)))) {}

  void draw() {
    const bool away = std::cos(angle_) < -0.3;
    const bool side = std::abs(std::sin(angle_)) > 0.5;
    const double far = std::sin(angle_) >= 0 ? -1 : 1;
    if (look_.bag == PersonLook::Bag::backpack && !away && side) backpack();
    arm(far, 0.72);
    leg(far, 0.78);
    leg(-far, 0.95);
    if (look_.legs == PersonLook::Legs::skirt) skirt();
    torso();
    if (look_.bag == PersonLook::Bag::backpack && away) backpack();
    head(away);
    arm(-far, 1.0);
    if (look_.bag == PersonLook::Bag::shoulder) shoulder_bag();
  }

 private:
  double sin_facing() const { return std::sin(angle_); }

  void leg(double side, double shade) {
    const double swing = side * swing_;
    const cv::Point2d hip(kMiddle + side * half_width_ * 0.48 * std::abs(std::cos(angle_)),
                          kHip - 6);
    const double lift = swing > 0 ? 7 * swing * (1 - 0.4 * std::abs(sin_facing())) : 0;
    const cv::Point2d foot(hip.x + 34 * swing * sin_facing(), kSole - 6 - lift);
    cv::Point2d knee = between(hip, foot, 0.5);
    knee.x += 5 * sin_facing() * std::abs(swing);
    const double thick = 21 * look_.build;
    const bool bare = look_.legs != PersonLook::Legs::trousers;
    const auto thigh = limb(hip, knee, thick, thick * 0.85);
    const auto shin = limb(knee, foot, thick * 0.85, thick * 0.62);
    if (bare) {
      sheet_.plain(shin, look_.skin, shade);
      sheet_.plain(thigh, look_.skin, shade);
      if (look_.legs == PersonLook::Legs::shorts) {
        sheet_.cloth(limb(hip, knee, thick * 1.1, thick), look_.bottom, hip.x, kHip, shade);
      }
    } else {
      sheet_.cloth(shin, look_.bottom, foot.x, kHip, shade);
      sheet_.cloth(thigh, look_.bottom, hip.x, kHip, shade);
    }
    sheet_.ellipse({foot.x + 5 * sin_facing(), foot.y + 1}, 8 + 4 * std::abs(sin_facing()), 5.5,
                   look_.shoes, shade);
  }

  void skirt() {
    const double w = half_width_;
    sheet_.cloth({{kMiddle - w * 0.85, kHip - 12},
                  {kMiddle + w * 0.85, kHip - 12},
                  {kMiddle + w * 1.25, kHip + 44},
                  {kMiddle - w * 1.25, kHip + 44}},
                 look_.bottom, kMiddle, kHip - 12, 1.0);
  }

  void torso() {
    const double w = half_width_;
    const double turn = 5 * sin_facing();  // the pattern turns with the body
    sheet_.cloth({{kMiddle - w * 0.55, kShoulder - 6},
                  {kMiddle + w * 0.55, kShoulder - 6},
                  {kMiddle + w, kShoulder + 4},
                  {kMiddle + w * 0.88, kHip},
                  {kMiddle - w * 0.88, kHip},
                  {kMiddle - w, kShoulder + 4}},
                 look_.top, kMiddle + turn, kShoulder, 1.0);
    if (look_.open_jacket && std::cos(angle_) > 0.2) {
      const double x = kMiddle + 0.6 * w * sin_facing();
      sheet_.plain({{x - 5, kShoulder - 5}, {x + 5, kShoulder - 5}, {x + 8, kHip}, {x - 8, kHip}},
                   look_.inner);
    }
  }

  void arm(double side, double shade) {
    const double swing = -side * swing_;
    const double out = half_width_ * std::max(0.35, std::abs(std::cos(angle_)));
    const cv::Point2d shoulder(kMiddle + side * out * 0.95, kShoulder + 6);
    const cv::Point2d hand(shoulder.x + 26 * swing * sin_facing() + side * 3,
                           kHip + 2 - 5 * std::abs(swing));
    const cv::Point2d elbow = between(shoulder, hand, 0.5);
    const double thick = 11 * look_.build;
    if (look_.sleeves == PersonLook::Sleeves::shorts) {
      sheet_.plain(limb(elbow, hand, thick * 0.8, thick * 0.6), look_.skin, shade);
    } else {
      sheet_.cloth(limb(elbow, hand, thick * 0.95, thick * 0.8), look_.top, hand.x, kShoulder,
                   shade * 0.93);
    }
    sheet_.cloth(limb(shoulder, elbow, thick * 1.1, thick), look_.top, shoulder.x, kShoulder,
                 shade * 0.93);
    sheet_.ellipse(hand, 4, 5, look_.skin, shade);
  }

  void head(bool away) {
    const cv::Point2d centre(head_x_, 22);
    sheet_.plain(limb({head_x_, 34}, {kMiddle, kShoulder}, 11, 14), look_.skin, 0.85);
    if (look_.head == PersonLook::Head::long_hair) {
      sheet_.ellipse({centre.x - 4 * sin_facing(), 30}, 16, 26, look_.hair, 0.9);
    }
    sheet_.ellipse({centre.x, centre.y - 3}, 15, 18, look_.hair);
    if (!away) {
      const double turned = 6 * sin_facing();
      sheet_.ellipse({centre.x + turned, centre.y + 4}, 13 - std::abs(turned) * 0.5, 15,
                     look_.skin);
    }
    if (look_.head == PersonLook::Head::hat) {
      sheet_.ellipse({centre.x, 12}, 16, 10, look_.bag_color);
      sheet_.ellipse({centre.x + 8 * sin_facing(), 17}, 18, 3.5, look_.bag_color, 0.8);
    }
  }

  void backpack() {
    const double x = kMiddle - half_width_ * 1.05 * sin_facing();
    sheet_.ellipse({x, kShoulder + 36}, std::max(12.0, half_width_ * 0.8), 32, look_.bag_color);
    sheet_.ellipse({x, kShoulder + 50}, std::max(7.0, half_width_ * 0.5), 12, look_.bag_color,
                   0.75);
  }

  void shoulder_bag() {
    const double x = kMiddle + half_width_ * 0.95 * (std::cos(angle_) >= 0 ? 1 : -1);
    sheet_.plain(limb({2 * kMiddle - x, kShoulder}, {x, kHip - 8}, 3.5, 3.5), look_.bag_color, 0.7);
    sheet_.plain(
        {{x - 13, kHip - 12}, {x + 13, kHip - 12}, {x + 14, kHip + 16}, {x - 14, kHip + 16}},
        look_.bag_color);
  }

  Sheet& sheet_;
  const PersonLook& look_;
  double angle_;
  double swing_;
  double head_x_;
  double half_width_;
};

}  // namespace

PersonLook random_look(nn::Random& random) {
  PersonLook look;
  look.top = random_cloth(random, 0.45);
  look.bottom = random_cloth(random, 0.85);
  const double tan = random.uniform();
  look.skin = hsv(random.uniform(6, 14), 60 + 90 * tan, 235 - 140 * tan);
  look.hair = random.uniform() < 0.75
                  ? hsv(random.uniform(5, 18), random.uniform(40, 150), random.uniform(15, 90))
                  : hsv(random.uniform(8, 22), random.uniform(20, 140), random.uniform(90, 220));
  look.shoes = cloth_color(random);
  look.bag_color = cloth_color(random);
  look.inner = cloth_color(random);
  const double legs = random.uniform();
  look.legs = legs < 0.7    ? PersonLook::Legs::trousers
              : legs < 0.86 ? PersonLook::Legs::shorts
                            : PersonLook::Legs::skirt;
  look.sleeves = random.uniform() < 0.6 ? PersonLook::Sleeves::longs : PersonLook::Sleeves::shorts;
  const double head = random.uniform();
  look.head = head < 0.5   ? PersonLook::Head::short_hair
              : head < 0.8 ? PersonLook::Head::long_hair
                           : PersonLook::Head::hat;
  const double bag = random.uniform();
  look.bag = bag < 0.5    ? PersonLook::Bag::none
             : bag < 0.75 ? PersonLook::Bag::backpack
                          : PersonLook::Bag::shoulder;
  look.open_jacket = random.uniform() < 0.3;
  look.build = random.uniform(0.85, 1.25);
  return look;
}

void draw_person(cv::Mat& image, const PersonLook& look, const PersonPose& pose,
                 const cv::Rect2d& box, double light) {
  Sheet sheet;
  Figure(sheet, look, pose).draw();

  // The sheet keeps its proportions: its height fills the box, its middle is the box's.
  const double scale = box.height / kHeight;
  const cv::Rect target(cvRound(box.x + 0.5 * box.width - 0.5 * kWidth * scale), cvRound(box.y),
                        std::max(1, cvRound(kWidth * scale)), std::max(1, cvRound(box.height)));
  const cv::Rect visible = target & cv::Rect(0, 0, image.cols, image.rows);
  if (visible.empty()) return;
  cv::Mat color;
  cv::Mat alpha;
  const int method = scale < 1 ? cv::INTER_AREA : cv::INTER_LINEAR;
  // Colours weighted by coverage, so that the empty sheet does not darken the outline.
  cv::Mat weighted;
  cv::Mat alpha3;
  cv::cvtColor(sheet.alpha(), alpha3, cv::COLOR_GRAY2BGR);
  cv::multiply(sheet.color(), alpha3, weighted, light / 255.0, CV_32F);
  cv::resize(weighted, color, target.size(), 0, 0, method);
  cv::resize(sheet.alpha(), alpha, target.size(), 0, 0, method);
  for (int y = visible.y; y < visible.br().y; ++y) {
    for (int x = visible.x; x < visible.br().x; ++x) {
      const double a = alpha.at<uchar>(y - target.y, x - target.x) / 255.0;
      const auto& over = color.at<cv::Vec3f>(y - target.y, x - target.x);
      auto& pixel = image.at<cv::Vec3b>(y, x);
      for (int c = 0; c < 3; ++c) {
        pixel[c] = cv::saturate_cast<uchar>((1 - a) * pixel[c] + over[c]);
      }
    }
  }
}

}  // namespace sdmt::tools

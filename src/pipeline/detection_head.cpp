// SPDX-License-Identifier: Apache-2.0
#include "detection_head.h"

#include <algorithm>
#include <cmath>

namespace sdmt::pipeline {

namespace {

constexpr std::array<int, 3> kStrides{8, 16, 32};
constexpr std::array<int, 4> kStridesTo64{8, 16, 32, 64};
constexpr int kDistances = 8;  // NanoDet: 0 to 7 cells, for each of four sides
constexpr int kAnchors = 3;
constexpr int kMostFinalBoxes = 1000;

int cells(int width, int height, int stride) {
  return ((width + stride - 1) / stride) * ((height + stride - 1) / stride);
}

int cells(int width, int height, std::span<const int> strides) {
  int sum = 0;
  for (const int stride : strides) sum += cells(width, height, stride);
  return sum;
}

bool is_matrix(const HeadOutput& output) {
  return output.shape.size() == 3 && output.shape[0] == 1;
}

std::span<const float> values(const HeadOutput& output) {
  std::size_t count = 1;
  for (const int size : output.shape) count *= static_cast<std::size_t>(size);
  return {output.values, count};
}

// The best of the wanted classes; `step` lies between the scores of two classes.
double best_score(const float* scores, int classes, std::size_t step,
                  std::span<const std::uint8_t> wanted) {
  float best = 0;
  const auto count = std::min<std::size_t>(classes, wanted.size());
  for (std::size_t c = 0; c < count; ++c) {
    if (wanted[c] != 0) best = std::max(best, scores[c * step]);
  }
  return best;
}

mot::Cxcywh from_corners(double left, double top, double right, double bottom) {
  return {(left + right) / 2, (top + bottom) / 2, right - left, bottom - top};
}

// Calls visit(cell, x, y) for the cells of one stride, row by row, with their left upper corners.
template <typename Visit>
void for_each_cell(int width, int height, int stride, Visit&& visit) {
  const int columns = (width + stride - 1) / stride;
  const int count = cells(width, height, stride);
  for (int i = 0; i < count; ++i) visit(i, i % columns * stride, i / columns * stride);
}

// The mean of a softmax over 0..7.
double distance(const float* logits) {
  const float greatest = *std::max_element(logits, logits + kDistances);
  double sum = 0, mean = 0;
  for (int i = 0; i < kDistances; ++i) {
    const double share = std::exp(static_cast<double>(logits[i] - greatest));
    sum += share;
    mean += i * share;
  }
  return mean / sum;
}

mot::Cxcywh from_distances(const float* logits, double x, double y, int stride) {
  return from_corners(x - stride * distance(logits), y - stride * distance(logits + kDistances),
                      x + stride * distance(logits + 2 * kDistances),
                      y + stride * distance(logits + 3 * kDistances));
}

// NanoDet's outputs for cells of one stride: scores and distances, which go below 0.
struct NanoDetPair {
  const HeadOutput* scores = nullptr;
  const HeadOutput* distances = nullptr;
};

std::optional<NanoDetPair> nanodet_pair(std::span<const HeadOutput> outputs, int count,
                                        int classes) {
  NanoDetPair pair;
  for (const HeadOutput& output : outputs) {
    if (!is_matrix(output) || output.shape[1] != count) continue;
    const auto all = values(output);
    const bool negative = std::any_of(all.begin(), all.end(), [](float v) { return v < 0; });
    const bool is_distances = output.shape[2] == 4 * kDistances && negative;
    (is_distances ? pair.distances : pair.scores) = &output;
  }
  const bool whole = pair.scores != nullptr && pair.distances != nullptr &&
                     (classes == 0 || pair.scores->shape[2] == classes);
  return whole ? std::optional(pair) : std::nullopt;
}

}  // namespace

DetectionHead::DetectionHead(Kind kind, int classes) : kind_(kind), classes_(classes) {
  constexpr float kWhite = 255;
  switch (kind) {
    case Kind::yolox:
    case Kind::yolox_boxes:
      break;
    case Kind::nanodet:
    case Kind::nanodet_plus:
      pixels_ = {false, {103.53F, 116.28F, 123.675F}, {1 / 57.375F, 1 / 57.12F, 1 / 58.395F}};
      break;
    case Kind::ssd: {
      constexpr float kHalf = kWhite / 2;
      pixels_ = {false, {kHalf, kHalf, kHalf}, {1 / kHalf, 1 / kHalf, 1 / kHalf}};
      break;
    }
    default:
      pixels_ = {true, {}, {1 / kWhite, 1 / kWhite, 1 / kWhite}};
  }
}

std::string_view DetectionHead::name() const {
  switch (kind_) {
    case Kind::region:
      return "Darknet region";
    case Kind::yolox:
    case Kind::yolox_boxes:
      return "YOLOX";
    case Kind::yolov5:
      return "YOLOv5";
    case Kind::yolov8:
      return "YOLOv8";
    case Kind::yolov10:
      return "YOLOv10";
    case Kind::nanodet:
      return "NanoDet";
    case Kind::nanodet_plus:
      return "NanoDet-Plus";
    case Kind::ssd:
      return "SSD";
  }
  return {};
}

std::optional<DetectionHead> DetectionHead::recognise(std::span<const HeadOutput> outputs,
                                                      int width, int height) {
  constexpr int kBoxAndObject = 5, kBox = 4;
  if (outputs.empty()) return std::nullopt;
  const auto& shape = outputs[0].shape;
  if (std::all_of(outputs.begin(), outputs.end(), [&](const HeadOutput& output) {
        return output.region && output.shape.size() == 2 && output.shape[1] == shape[1] &&
               output.shape[1] > kBoxAndObject;
      })) {
    return DetectionHead(Kind::region, shape[1] - kBoxAndObject);
  }
  if (outputs.size() == 2 * kStrides.size()) {
    int classes = 0;
    for (const int stride : kStrides) {
      const auto pair = nanodet_pair(outputs, cells(width, height, stride), classes);
      if (!pair) return std::nullopt;
      classes = pair->scores->shape[2];
    }
    return DetectionHead(Kind::nanodet, classes);
  }
  if (outputs.size() != 1) return std::nullopt;
  if (shape.size() == 4 && shape[0] == 1 && shape[1] == 1 && shape[3] == 7) {
    return DetectionHead(Kind::ssd, 0);
  }
  if (!is_matrix(outputs[0])) return std::nullopt;
  const int rows = shape[1], columns = shape[2];
  const int count = cells(width, height, kStrides);
  if (rows == count && columns > kBoxAndObject) {
    // The centres of boxes reach across the picture, offsets within a cell do not.
    float farthest = 0;
    const float* centre = outputs[0].values;
    for (int i = 0; i < rows; ++i, centre += columns) farthest = std::max(farthest, *centre);
    const bool boxes = farthest > width / 2.0;
    return DetectionHead(boxes ? Kind::yolox_boxes : Kind::yolox, columns - kBoxAndObject);
  }
  if (rows == kAnchors * count && columns > kBoxAndObject) {
    return DetectionHead(Kind::yolov5, columns - kBoxAndObject);
  }
  if (columns == count && rows > kBox) return DetectionHead(Kind::yolov8, rows - kBox);
  if (rows == cells(width, height, kStridesTo64) && columns > 4 * kDistances) {
    return DetectionHead(Kind::nanodet_plus, columns - 4 * kDistances);
  }
  if (columns == 6 && rows <= kMostFinalBoxes) return DetectionHead(Kind::yolov10, 0);
  return std::nullopt;
}

bool DetectionHead::decode(std::span<const HeadOutput> outputs, int width, int height,
                           std::span<const std::uint8_t> wanted, double min_score,
                           std::vector<Candidate>& out) const {
  const auto add = [&](const mot::Cxcywh& box, double score) {
    if (score < min_score || !(box.width > 0) || !(box.height > 0)) return;
    if (std::isfinite(box.cx + box.cy + box.width + box.height)) out.push_back({box, score});
  };
  const auto has_class = [&](float category) {
    return category >= 0 && category < static_cast<float>(wanted.size()) &&
           wanted[static_cast<int>(category)] != 0;
  };
  if (outputs.empty()) return false;
  const double picture_width = width, picture_height = height;
  const HeadOutput& first = outputs[0];
  const float* row = first.values;
  switch (kind_) {
    case Kind::region: {
      for (const HeadOutput& output : outputs) {
        if (output.shape.size() != 2 || output.shape[1] != 5 + classes_) return false;
        row = output.values;
        for (int i = 0; i < output.shape[0]; ++i, row += output.shape[1]) {
          // OpenCV has multiplied the classes with the objectness.
          add({row[0] * picture_width, row[1] * picture_height, row[2] * picture_width,
               row[3] * picture_height},
              best_score(row + 5, classes_, 1, wanted));
        }
      }
      return true;
    }
    case Kind::yolox:
    case Kind::yolox_boxes: {
      if (first.shape != std::vector{1, cells(width, height, kStrides), 5 + classes_}) return false;
      for (const int stride : kStrides) {
        for_each_cell(width, height, stride, [&](int, int x, int y) {
          const double score = row[4] * best_score(row + 5, classes_, 1, wanted);
          if (kind_ == Kind::yolox_boxes) {
            add({row[0], row[1], row[2], row[3]}, score);
          } else if (score >= min_score) {
            const double scale = stride;
            add({x + scale * row[0], y + scale * row[1], scale * std::exp(row[2]),
                 scale * std::exp(row[3])},
                score);
          }
          row += 5 + classes_;
        });
      }
      return true;
    }
    case Kind::yolov5: {
      const int count = kAnchors * cells(width, height, kStrides);
      if (first.shape != std::vector{1, count, 5 + classes_}) return false;
      for (int i = 0; i < count; ++i, row += 5 + classes_) {
        add({row[0], row[1], row[2], row[3]}, row[4] * best_score(row + 5, classes_, 1, wanted));
      }
      return true;
    }
    case Kind::yolov8: {
      const int count = cells(width, height, kStrides);
      if (first.shape != std::vector{1, 4 + classes_, count}) return false;
      const auto step = static_cast<std::size_t>(count);
      for (int i = 0; i < count; ++i, ++row) {
        add({row[0], row[step], row[2 * step], row[3 * step]},
            best_score(row + 4 * step, classes_, step, wanted));
      }
      return true;
    }
    case Kind::yolov10: {
      if (!is_matrix(first) || first.shape[2] != 6) return false;
      for (int i = 0; i < first.shape[1]; ++i, row += 6) {
        if (has_class(row[5])) add(from_corners(row[0], row[1], row[2], row[3]), row[4]);
      }
      return true;
    }
    case Kind::nanodet: {
      for (const int stride : kStrides) {
        const auto pair = nanodet_pair(outputs, cells(width, height, stride), classes_);
        if (!pair) return false;
        for_each_cell(width, height, stride, [&](int i, int x, int y) {
          const float* scores = pair->scores->values + static_cast<std::size_t>(i) * classes_;
          const double score = best_score(scores, classes_, 1, wanted);
          if (score < min_score) return;
          const float* sides =
              pair->distances->values + static_cast<std::size_t>(i) * 4 * kDistances;
          add(from_distances(sides, x + stride / 2.0, y + stride / 2.0, stride), score);
        });
      }
      return true;
    }
    case Kind::nanodet_plus: {
      const int count = cells(width, height, kStridesTo64);
      if (first.shape != std::vector{1, count, classes_ + 4 * kDistances}) return false;
      for (const int stride : kStridesTo64) {
        for_each_cell(width, height, stride, [&](int, int x, int y) {
          const double score = best_score(row, classes_, 1, wanted);
          if (score >= min_score) add(from_distances(row + classes_, x, y, stride), score);
          row += classes_ + 4 * kDistances;
        });
      }
      return true;
    }
    case Kind::ssd: {
      if (first.shape.size() != 4 || first.shape[3] != 7) return false;
      for (int i = 0; i < first.shape[2]; ++i, row += 7) {
        if (!has_class(row[1])) continue;
        add(from_corners(row[3] * picture_width, row[4] * picture_height, row[5] * picture_width,
                         row[6] * picture_height),
            row[2]);
      }
      return true;
    }
  }
  return false;
}

}  // namespace sdmt::pipeline

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/embedder.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "sdmt/io/checked_value.h"
#include "sdmt/io/first_error.h"
#include "sdmt/nn/sequential.h"

namespace sdmt::reid {

namespace {

/// The cells that shifted windows cover together.
struct WindowGrid {
  WindowGrid(const image::PixelRect& window, std::span<const image::GridShift> shifts) {
    const auto [min_column, max_column] =
        std::minmax_element(shifts.begin(), shifts.end(),
                            [](const auto& a, const auto& b) { return a.columns < b.columns; });
    const auto [min_row, max_row] = std::minmax_element(
        shifts.begin(), shifts.end(), [](const auto& a, const auto& b) { return a.rows < b.rows; });
    left = min_column->columns;
    top = min_row->rows;
    columns = image::GridShift::kColumns + max_column->columns - left;
    rows = image::GridShift::kRows + max_row->rows - top;
    const double cell_width = window.width / image::GridShift::kColumns;
    const double cell_height = window.height / image::GridShift::kRows;
    region = {window.left + left * cell_width, window.top + top * cell_height, columns * cell_width,
              rows * cell_height};
  }

  int left;  // of the first cell, from the window's
  int top;
  int columns;
  int rows;
  image::PixelRect region;
};

// Input pixels to a position of the trunk's map when a window of its input makes the same as that
// window of its map: every convolution keeps its positions, and the map has the windows' size.
// Otherwise 0.
int cell_of(const NetworkDescription& network) {
  int cell = 1;
  const int trunk = network.first_of_head();
  for (int i = 0; i < trunk; ++i) {
    const LayerDescription& layer = network.layers[i];
    if (layer.type == LayerType::conv2d) {
      if (layer.kernel_size != 2 * layer.padding + 1) return 0;
      cell *= layer.stride;
    } else if (layer.type == LayerType::max_pool2d) {
      cell *= 2;
    }
  }
  const bool fits = network.height == cell * image::GridShift::kRows &&
                    network.width == cell * image::GridShift::kColumns;
  return fits ? cell : 0;
}

// Half a pixel is lost in rounding to whole ones anyway.
void require_inside(const image::ImageView& image, const image::PixelRect& region) {
  constexpr double kSlack = 0.5;
  if (region.left >= -kSlack && region.top >= -kSlack &&
      region.left + region.width <= image.width + kSlack &&
      region.top + region.height <= image.height + kSlack) {
    return;
  }
  throw std::invalid_argument("describe_shifted: the windows leave the image, whose size is " +
                              std::to_string(image.width) + " x " + std::to_string(image.height));
}

// Finite weights can still make values that are not, or nothing but zeros.
void require_unit_rows(const nn::Tensor& rows, const std::string& source) {
  constexpr double kSlack = 1e-3;
  const std::size_t size = rows.shape().image_size();
  for (int i = 0; i < rows.shape().n; ++i) {
    double square = 0;
    for (const float value : std::span(rows.image(i), size)) square += double{value} * value;
    if (std::abs(square - 1) <= kSlack) continue;
    throw std::runtime_error(source + ": the network makes an embedding of length " +
                             io::number_text(std::sqrt(square)) +
                             ", expected 1: its weights or its preprocessing are damaged");
  }
}

std::shared_ptr<const Model> released(Model model) {
  model.network.release_for_inference();
  return std::make_shared<const Model>(std::move(model));
}

}  // namespace

void EmbedderOptions::validate() const {
  if (max_batch < 1 || max_batch > 4096) {
    throw std::invalid_argument("max_batch is " + std::to_string(max_batch) +
                                ", expected 1 to 4096");
  }
}

Embedder::Embedder(Model model, const EmbedderOptions& options)
    : Embedder(released(std::move(model)), options) {}

Embedder::Embedder(std::shared_ptr<const Model> model, const EmbedderOptions& options)
    : options_(options), model_(std::move(model)) {
  options_.validate();
  if (model_ == nullptr) throw std::invalid_argument("Embedder: the model is null");
  const image::Preprocessing& preprocessing = model_->metadata.preprocessing;
  preprocessing.validate();
  const nn::Shape input = model_->network.input_shape(1);
  if (preprocessing.height != input.h || preprocessing.width != input.w) {
    throw std::invalid_argument(
        "preprocessing makes patches of " + std::to_string(preprocessing.height) + " x " +
        std::to_string(preprocessing.width) + ", the network takes " + input.str());
  }
  cell_ = cell_of(model_->network.description());
}

std::optional<double> Embedder::tau_a() const {
  if (!model_->metadata.tau_a) return std::nullopt;
  return model_->metadata.tau_a->value;
}

void Embedder::describe(std::span<const image::Crop> crops, image::DescriptorRows& out) {
  out.reset(crops.size(), dimension());
  visible_.clear();
  for (std::size_t i = 0; i < crops.size(); ++i) {
    const image::ImageView& image = crops[i].image;
    if (image.empty() || !image::visible_region(image.width, image.height, crops[i].rect)) continue;
    out.valid[i] = 1;
    visible_.push_back(i);
  }

  // Pieces of nearly equal size: 41 crops as 21 + 20, not as 40 + 1.
  const std::size_t total = visible_.size();
  const auto most = static_cast<std::size_t>(options_.max_batch);
  const std::size_t pieces = (total + most - 1) / most;
  for (std::size_t piece = 0; piece < pieces; ++piece) {
    const std::size_t first = total * piece / pieces;
    const int count = static_cast<int>(total * (piece + 1) / pieces - first);
    patches_.resize(model_->network.input_shape(count));
    io::FirstError error;
#pragma omp parallel for schedule(dynamic)
    for (int i = 0; i < count; ++i) {
      error.guard([&] {
        const image::Crop& crop = crops[visible_[first + i]];
        image::extract_patch(crop.image, crop.rect, model_->metadata.preprocessing,
                             patches_.image(i));
      });
    }
    error.rethrow();
    const nn::Tensor& rows = model_->network.infer(patches_, workspace_);
    require_unit_rows(rows, model_->source);
    for (int i = 0; i < count; ++i) {
      const std::size_t crop = visible_[first + i];
      std::copy_n(rows.image(i), out.dimension, out.row(crop).begin());
    }
  }
}

void Embedder::describe_shifted(const image::ImageView& image, const image::PixelRect& window,
                                std::span<const image::GridShift> shifts,
                                image::DescriptorRows& out) {
  out.reset(shifts.size(), dimension());
  if (shifts.empty()) return;
  const WindowGrid grid(window, shifts);
  require_inside(image, grid.region);
  if (cell_ == 0) {
    CropDescriptor::describe_shifted(image, window, shifts, out);
    return;
  }
  image::Preprocessing preprocessing = model_->metadata.preprocessing;
  preprocessing.width = cell_ * grid.columns;
  preprocessing.height = cell_ * grid.rows;
  patches_.resize({1, preprocessing.height, preprocessing.width, 3});
  if (!image::extract_patch(image, grid.region, preprocessing, patches_.data())) return;
  const nn::Tensor& map = model_->network.trunk().infer(patches_, workspace_.trunk);

  const std::size_t most = static_cast<std::size_t>(options_.max_batch);
  const auto channels = static_cast<std::size_t>(map.shape().c);
  for (std::size_t first = 0; first < shifts.size(); first += most) {
    const int count = static_cast<int>(std::min(most, shifts.size() - first));
    windows_.resize({count, image::GridShift::kRows, image::GridShift::kColumns, map.shape().c});
    // nothing throws
#pragma omp parallel for schedule(static)
    for (int i = 0; i < count; ++i) {
      const image::GridShift& shift = shifts[first + i];
      for (int y = 0; y < image::GridShift::kRows; ++y) {
        const auto from = static_cast<std::size_t>(shift.rows - grid.top + y) *
                              static_cast<std::size_t>(grid.columns) +
                          static_cast<std::size_t>(shift.columns - grid.left);
        std::copy_n(map.data() + from * channels, image::GridShift::kColumns * channels,
                    windows_.image(i) +
                        static_cast<std::size_t>(y) * image::GridShift::kColumns * channels);
      }
    }
    const nn::Tensor& rows = model_->network.head().infer(windows_, workspace_.head);
    require_unit_rows(rows, model_->source);
    std::copy_n(rows.data(), rows.size(), out.row(first).begin());
  }
  std::fill(out.valid.begin(), out.valid.end(), static_cast<unsigned char>(1));
}

}  // namespace sdmt::reid

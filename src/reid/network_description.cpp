// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/network_description.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

namespace sdmt::reid {

namespace {

constexpr int kMaxSide = 4096;
constexpr int kMaxOutputs = 65536;
constexpr int kMaxKernel = 15;
constexpr std::size_t kMaxLayers = 512;
constexpr std::size_t kMaxMap = std::size_t{1} << 24;      // values: 64 MiB a patch
constexpr std::size_t kMaxWeights = std::size_t{1} << 29;  // of a layer: 2 GiB

bool works_on_maps(LayerType type) {
  return type == LayerType::conv2d || type == LayerType::batch_norm2d ||
         type == LayerType::instance_norm2d || type == LayerType::max_pool2d ||
         type == LayerType::avg_pool2d;
}

bool is_norm(LayerType type) {
  return type == LayerType::batch_norm1d || type == LayerType::batch_norm2d ||
         type == LayerType::instance_norm2d;
}

std::string map_text(const nn::Shape& map) {
  return std::to_string(map.h) + " x " + std::to_string(map.w) + " x " + std::to_string(map.c);
}

// What a layer makes of one image; 0 rows or columns when its kernel is larger than the map.
nn::Shape output_of(const LayerDescription& layer, const nn::Shape& in) {
  const auto extent = [&layer](int size) {
    const int padded = size + 2 * layer.padding;
    return padded < layer.kernel_size ? 0 : (padded - layer.kernel_size) / layer.stride + 1;
  };
  switch (layer.type) {
    case LayerType::conv2d:
      return {1, extent(in.h), extent(in.w), layer.out_channels};
    case LayerType::max_pool2d:
      return {1, in.h / 2, in.w / 2, in.c};
    case LayerType::avg_pool2d:
      return {1, in.h / layer.block_height, in.w / layer.block_width, in.c};
    case LayerType::linear:
      return {1, 1, 1, layer.out_features};
    default:
      return in;
  }
}

std::size_t weight_count(const LayerDescription& layer, const nn::Shape& in) {
  switch (layer.type) {
    case LayerType::conv2d:
      return nn::Shape{layer.out_channels, layer.kernel_size, layer.kernel_size, in.c}.size();
    case LayerType::linear:
      return nn::Shape{layer.out_features, in.h, in.w, in.c}.size();
    default:
      return 0;
  }
}

// One layer being checked, at its place in a network.
class LayerCheck {
 public:
  LayerCheck(const std::string& network, const LayerDescription& layer)
      : layer_(layer),
        where_("network " + network + ": layer " + layer.name + " (" +
               std::string(layer_type_name(layer.type)) + ") ") {}

  void range(const char* field, int value, int low, int high) const {
    if (value >= low && value <= high) return;
    fail("has " + std::string(field) + " " + std::to_string(value) + ", expected " +
         std::to_string(low) + " to " + std::to_string(high));
  }

  void numbers() const {
    if (layer_.type == LayerType::conv2d) {
      range("out_channels", layer_.out_channels, 1, kMaxOutputs);
      range("kernel_size", layer_.kernel_size, 1, kMaxKernel);
      range("stride", layer_.stride, 1, kMaxKernel);
      range("padding", layer_.padding, 0, layer_.kernel_size - 1);
    } else if (layer_.type == LayerType::avg_pool2d) {
      range("kernel_size[0]", layer_.block_height, 1, kMaxSide);
      range("kernel_size[1]", layer_.block_width, 1, kMaxSide);
    } else if (layer_.type == LayerType::linear) {
      range("out_features", layer_.out_features, 1, kMaxOutputs);
    } else if (is_norm(layer_.type)) {
      if (!(layer_.initial_gamma > 0) || !std::isfinite(layer_.initial_gamma)) {
        fail("has initial_gamma " + std::to_string(layer_.initial_gamma) + ", expected > 0");
      }
      if (!std::isfinite(layer_.initial_beta)) {
        fail("has initial_beta " + std::to_string(layer_.initial_beta) +
             ", expected a finite number");
      }
    }
  }

  void place(bool in_head, bool last) const {
    if (in_head && works_on_maps(layer_.type)) {
      fail("stands behind a Linear, expected before: it works on maps");
    }
    if (!in_head && layer_.type == LayerType::batch_norm1d) {
      fail("stands before the first Linear, expected BatchNorm2d there");
    }
    if (!last && layer_.type == LayerType::l2_normalize) {
      fail("stands before other layers, expected as the last");
    }
    if (last && layer_.type != LayerType::l2_normalize) {
      fail("is the last, expected an L2Normalize there");
    }
  }

  void fit(const nn::Shape& in, const nn::Shape& out) const {
    if (layer_.type == LayerType::max_pool2d && (in.h % 2 != 0 || in.w % 2 != 0)) {
      fail("gets a map of " + map_text(in) + ", expected an even height and width");
    }
    if (layer_.type == LayerType::avg_pool2d &&
        (in.h % layer_.block_height != 0 || in.w % layer_.block_width != 0)) {
      fail("gets a map of " + map_text(in) + ", expected blocks of " +
           std::to_string(layer_.block_height) + " x " + std::to_string(layer_.block_width) +
           " to fill it");
    }
    if (layer_.type == LayerType::instance_norm2d && in.h * in.w < 2) {
      fail("gets a map of " + map_text(in) + ", expected more than one position");
    }
    if (out.image_size() == 0) {
      fail("gets a map of " + map_text(in) + ", expected one as large as its kernel");
    }
    if (out.image_size() > kMaxMap) {
      fail("makes a map of " + map_text(out) + ", expected at most 2^24 values");
    }
    if (weight_count(layer_, in) > kMaxWeights) {
      fail("has " + std::to_string(weight_count(layer_, in)) + " weights, expected at most 2^29");
    }
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::invalid_argument(where_ + what);
  }

  const LayerDescription& layer_;
  std::string where_;
};

bool is_name(const std::string& text, const std::string& more) {
  return !text.empty() && text.find_first_not_of(
                              "abcdefghijklmnopqrstuvwxyz"
                              "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-" +
                              more) == std::string::npos;
}

void check_names(const NetworkDescription& network) {
  std::set<std::string> names, stored;
  for (const LayerDescription& layer : network.layers) {
    const std::string where = "network " + network.name + ": layer name \"" + layer.name + "\" ";
    if (!is_name(layer.name, "")) {
      throw std::invalid_argument(where + "is not made of letters, digits, '_' and '-'");
    }
    if (!layer.stored_as.empty() && !is_name(layer.stored_as, ".")) {
      throw std::invalid_argument(where + "has stored_as \"" + layer.stored_as +
                                  "\", expected letters, digits, '_', '-' and '.'");
    }
    if (!names.insert(layer.name).second || !stored.insert(layer.tensor_name("")).second) {
      throw std::invalid_argument(where + "or what it is stored as is taken by another layer");
    }
  }
}

}  // namespace

std::string LayerDescription::tensor_name(std::string_view parameter) const {
  return (stored_as.empty() ? name : stored_as) + "." + std::string(parameter);
}

std::string_view layer_type_name(LayerType type) {
  switch (type) {
    case LayerType::conv2d:
      return "Conv2d";
    case LayerType::batch_norm2d:
      return "BatchNorm2d";
    case LayerType::instance_norm2d:
      return "InstanceNorm2d";
    case LayerType::relu:
      return "ReLU";
    case LayerType::max_pool2d:
      return "MaxPool2d";
    case LayerType::avg_pool2d:
      return "AvgPool2d";
    case LayerType::linear:
      return "Linear";
    case LayerType::batch_norm1d:
      return "BatchNorm1d";
    case LayerType::l2_normalize:
      return "L2Normalize";
  }
  return "";
}

void NetworkDescription::validate() const {
  const auto refuse = [this](const std::string& what) {
    throw std::invalid_argument("network " + name + ": " + what);
  };
  if (name.empty()) throw std::invalid_argument("network name is empty");
  const auto check_side = [&](const char* side, int value) {
    if (value >= 1 && value <= kMaxSide) return;
    refuse("input " + std::string(side) + " is " + std::to_string(value) + ", expected 1 to " +
           std::to_string(kMaxSide));
  };
  check_side("height", height);
  check_side("width", width);
  if (layers.empty() || layers.size() > kMaxLayers) {
    refuse("has " + std::to_string(layers.size()) + " layers, expected 1 to " +
           std::to_string(kMaxLayers));
  }
  check_names(*this);
  bool in_head = false;
  nn::Shape shape = input_shape();
  for (const LayerDescription& layer : layers) {
    const LayerCheck check(name, layer);
    check.numbers();
    in_head = in_head || layer.type == LayerType::linear;
    check.place(in_head, &layer == &layers.back());
    const nn::Shape out = output_of(layer, shape);
    check.fit(shape, out);
    shape = out;
  }
  if (!in_head) refuse("has no Linear, expected at least one before the L2Normalize");
}

std::vector<nn::Shape> NetworkDescription::shapes() const {
  std::vector<nn::Shape> result{input_shape()};
  for (const LayerDescription& layer : layers) result.push_back(output_of(layer, result.back()));
  return result;
}

int NetworkDescription::first_of_head() const {
  const auto first = std::find_if(layers.begin(), layers.end(), [](const LayerDescription& layer) {
    return layer.type == LayerType::linear;
  });
  return static_cast<int>(first - layers.begin());
}

int NetworkDescription::embedding_size() const { return shapes().back().c; }

}  // namespace sdmt::reid

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/tied_head.h"

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "sdmt/nn/avg_pool2d.h"
#include "sdmt/nn/linear.h"

namespace sdmt::train {

namespace {

constexpr const char* kBlocks = "blocks";

// The map that FC1, the first layer of the head, reads.
nn::Shape map_shape(reid::EmbeddingNetwork& network) {
  return network.trunk().output_shape(network.input_shape(1));
}

void require_fit(const nn::Shape& map, BlockGrid grid) {
  if (grid.rows >= 1 && grid.columns >= 1 && map.h % grid.rows == 0 && map.w % grid.columns == 0) {
    return;
  }
  throw std::invalid_argument("tie is " + std::to_string(grid.rows) + "x" +
                              std::to_string(grid.columns) +
                              ", expected rows x columns that divide the map of " +
                              std::to_string(map.h) + "x" + std::to_string(map.w) + ", or none");
}

// Calls f(index in the full weights, index in the tied weights) for every weight.
template <typename F>
void for_each_weight(const nn::Shape& map, BlockGrid grid, int outputs, F f) {
  const int block_height = map.h / grid.rows, block_width = map.w / grid.columns;
  const auto channels = static_cast<std::size_t>(map.c);
  std::size_t full = 0;
  for (int o = 0; o < outputs; ++o) {
    for (int y = 0; y < map.h; ++y) {
      for (int x = 0; x < map.w; ++x) {
        const int block = (o * grid.rows + y / block_height) * grid.columns + x / block_width;
        const std::size_t tied = static_cast<std::size_t>(block) * channels;
        for (std::size_t c = 0; c < channels; ++c) f(full++, tied + c);
      }
    }
  }
}

// Everything of both heads but FC1's weight, the first parameter, which differs.
void copy_equal_tensors(nn::Sequential& from, nn::Sequential& to) {
  const auto sources = from.named_parameters(), targets = to.named_parameters();
  for (std::size_t i = 1; i < sources.size(); ++i) {
    targets[i].parameter->value = sources[i].parameter->value;
  }
  const auto statistics = from.named_buffers(), copies = to.named_buffers();
  for (std::size_t i = 0; i < statistics.size(); ++i) *copies[i].tensor = *statistics[i].tensor;
}

nn::Tensor& fc1_weight(nn::Sequential& head) {
  const int fc1 = head.name(0) == kBlocks ? 1 : 0;
  return dynamic_cast<nn::Linear&>(head.layer(fc1)).weight().value;
}

}  // namespace

std::unique_ptr<nn::Sequential> make_tied_head(reid::EmbeddingNetwork& network, BlockGrid grid) {
  const nn::Shape map = map_shape(network);
  require_fit(map, grid);
  const reid::NetworkDescription& description = network.description();
  auto head = std::make_unique<nn::Sequential>();
  head->add(kBlocks, std::make_unique<nn::AvgPool2d>(
                         nn::AvgPool2dOptions{map.h / grid.rows, map.w / grid.columns}));
  nn::Shape shape{1, grid.rows, grid.columns, map.c};
  for (int i = 0; i < network.head().size(); ++i) {
    auto layer = reid::make_layer(description.layers[description.first_of_head() + i], shape);
    shape = layer->output_shape(shape);
    head->add(description.layers[description.first_of_head() + i].name, std::move(layer));
  }

  copy_equal_tensors(network.head(), *head);
  const nn::Tensor& full = fc1_weight(network.head());
  nn::Tensor& tied = fc1_weight(*head);
  std::vector<double> sums(tied.size(), 0.0);
  for_each_weight(map, grid, full.shape().n,
                  [&](std::size_t i, std::size_t t) { sums[t] += full.data()[i]; });
  for (std::size_t i = 0; i < sums.size(); ++i) tied.data()[i] = static_cast<float>(sums[i]);
  head->parameters_changed();
  return head;
}

void store_tied_head(nn::Sequential& tied, BlockGrid grid, reid::EmbeddingNetwork& network) {
  const nn::Shape map = map_shape(network);
  require_fit(map, grid);
  copy_equal_tensors(tied, network.head());
  const nn::Tensor& weights = fc1_weight(tied);
  nn::Tensor& full = fc1_weight(network.head());
  const int block_size = map.h / grid.rows * (map.w / grid.columns);
  const auto positions = static_cast<float>(block_size);
  for_each_weight(map, grid, weights.shape().n, [&](std::size_t i, std::size_t t) {
    full.data()[i] = weights.data()[t] / positions;
  });
  network.parameters_changed();
}

}  // namespace sdmt::train

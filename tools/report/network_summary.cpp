// SPDX-License-Identifier: Apache-2.0
#include "report/network_summary.h"

#include <numeric>

#include "sdmt/nn/sequential.h"

namespace sdmt::tools {

std::vector<LayerSummary> summarize(reid::EmbeddingNetwork& network) {
  std::vector<LayerSummary> layers;
  nn::Shape shape = network.input_shape(1);
  for (nn::Sequential* part : {&network.trunk(), &network.head()}) {
    for (int i = 0; i < part->size(); ++i) {
      nn::Layer& layer = part->layer(i);
      shape = layer.output_shape(shape);
      LayerSummary summary{part->name(i), std::string(layer.type()), shape};
      for (const nn::Parameter* parameter : layer.parameters()) {
        summary.parameters += static_cast<std::int64_t>(parameter->value.size());
        // Convolutions and fully connected layers use each weight once for each output position.
        const bool is_matrix = parameter->value.shape().n > 1;
        const double positions = static_cast<double>(shape.h) * shape.w;
        if (is_matrix) {
          summary.gflop += 2e-9 * positions * static_cast<double>(parameter->value.size());
        }
      }
      layers.push_back(summary);
    }
  }
  return layers;
}

double total_gflop(reid::EmbeddingNetwork& network) {
  const auto layers = summarize(network);
  return std::accumulate(layers.begin(), layers.end(), 0.0,
                         [](double sum, const LayerSummary& layer) { return sum + layer.gflop; });
}

}  // namespace sdmt::tools

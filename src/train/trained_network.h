// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdmt/nn/sequential.h"
#include "sdmt/reid/embedding_network.h"
#include "sdmt/train/tied_head.h"

namespace sdmt::train {

// The embedding network as a training sees it: a frozen front, whose result for an image never
// changes and can be cached, and a trained rest. With a tied FC1 and a frozen trunk the means over
// the blocks belong to the front: 4,096 values an image in place of 131,072.
class TrainedNetwork {
 public:
  // Trains from the layer `first_trained` on, a layer of the trunk or the first of the head.
  // `network` must outlive this object.
  TrainedNetwork(reid::EmbeddingNetwork& network, std::optional<BlockGrid> tie,
                 const std::string& first_trained, float trunk_lr_scale);

  // Result of the frozen front for `batch` images.
  nn::Shape front_shape(int batch) const;
  bool has_front() const { return trunk_cut_ > 0; }
  // [n, height, width, 3] -> front_shape(n). Valid until the next call of any function here.
  const nn::Tensor& run_front(const nn::Tensor& patches);

  // The trained layers normalise by the statistics that they have, and keep them.
  void freeze_statistics();
  // Of which batch the training passes to come are a part: see nn::Layer::set_shards().
  void set_shards(const nn::BatchShards* shards);
  // front_shape(n) -> [n, 1, 1, embedding size]. In training mode `front` must live until
  // backward().
  const nn::Tensor& forward(const nn::Tensor& front, nn::Mode mode);
  void backward(const nn::Tensor& dy);

  // What is trained: "trunk.conv3_1.weight", ..., "head.bn.bias".
  std::vector<nn::NamedParameter> parameters();
  // What a training changes: the values of parameters() and the running statistics.
  std::vector<nn::NamedTensor> state();
  // After the values of state() were changed.
  void parameters_changed();
  // Brings the trained values into the network, FC1 expanded.
  void store();
  // Hash of all that is frozen.
  std::uint64_t front_fingerprint();
  // Hash of state().
  std::uint64_t state_fingerprint();

 private:
  reid::EmbeddingNetwork& network_;
  std::optional<BlockGrid> tie_;
  std::unique_ptr<nn::Sequential> tied_;  // null when FC1 is not tied
  nn::Sequential& head() { return tied_ ? *tied_ : network_.head(); }
  int trunk_cut_ = 0;  // first trained layer of the trunk
  int head_cut_ = 0;   // first layer of the head behind the front
  nn::Tensor map_gradient_;
};

}  // namespace sdmt::train

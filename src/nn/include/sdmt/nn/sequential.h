// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sdmt/nn/inference_workspace.h"
#include "sdmt/nn/layer.h"

namespace sdmt::nn {

class InferencePlans;
class TrainingPlan;

/// Layers applied one after another, any sub-range [first, last) of them at a time: last == -1
/// means all. Owns the layers and, for forward(), the tensors between them, whose memory is reused,
/// so that running shapes seen before allocates nothing. infer() may run in several threads at
/// once, nothing else may beside it.
class Sequential {
 public:
  Sequential();
  ~Sequential();
  Sequential(Sequential&&) noexcept;
  Sequential& operator=(Sequential&&) noexcept;

  /// Appends a layer. Throws std::invalid_argument when the name is empty or taken.
  Sequential& add(std::string name, std::unique_ptr<Layer> layer);

  int size() const { return static_cast<int>(entries_.size()); }
  /// 0 <= i < size().
  const std::string& name(int i) const { return entries_[i].name; }
  Layer& layer(int i) { return *entries_[i].layer; }
  const Layer& layer(int i) const { return *entries_[i].layer; }
  /// Position of the layer of that name. Throws std::invalid_argument when there is none.
  int index(std::string_view name) const;

  /// Shape after layers [first, last). Throws as the layers do, or for a range outside the layers.
  Shape output_shape(Shape in, int first = 0, int last = -1) const;

  /// Runs layers [first, last) on x in inference. The result lies in the workspace, where x must
  /// not be; for an empty range it is x itself.
  const Tensor& infer(const Tensor& x, InferenceWorkspace& workspace, int first = 0,
                      int last = -1) const;
  /// Runs layers [first, last) on x. The result belongs to the sequence and holds until its next
  /// forward(); for an empty range it is x itself.
  ///
  /// inference: as infer(). A convolution and the BatchNorm, ReLU and MaxPool2d after it run as
  /// one, with the normalisation folded into its weights, for as many images at a time as the
  /// caches hold; only two results are in memory at a time. training: every result is kept for
  /// backward(), except that of a convolution or normalisation followed by ReLU; x must stay alive
  /// and unchanged.
  const Tensor& forward(const Tensor& x, Mode mode, int first = 0, int last = -1);

  /// For the last forward() in training mode: given dy = dL/d(its result), adds to the gradients of
  /// its trainable parameters, and sets *dx to dL/dx unless dx is null. Without dx, it stops at the
  /// lowest layer that has a trainable parameter. May be called once for each forward(). Throws
  /// std::logic_error without a training forward(), std::invalid_argument for a dy of another
  /// shape.
  void backward(const Tensor& dy, Tensor* dx = nullptr);

  /// Parameters as "<layer name>.<parameter name>" in the order of the layers.
  std::vector<NamedParameter> named_parameters();
  /// Buffers (running statistics) likewise.
  std::vector<NamedTensor> named_buffers();
  /// Tells every layer; see Layer::set_shards().
  void set_shards(const BatchShards* shards);
  /// Gives up the weights that inference through all layers has a copy of, see
  /// Linear::release_weights(); of convolutions, those into which a batch normalisation was folded.
  /// Only inference through all layers may follow.
  void release_for_inference();
  /// Tells every layer; see Layer::parameters_changed().
  void parameters_changed();

 private:
  struct Entry {
    std::string name;
    std::unique_ptr<Layer> layer;
  };

  using Range = std::pair<int, int>;
  Range checked_range(int first, int last) const;
  std::vector<Layer*> layers_in(Range range) const;

  std::vector<Entry> entries_;
  std::unique_ptr<InferencePlans> inference_plans_;
  std::map<Range, InferenceWorkspace> workspaces_;  // of forward() in inference
  std::map<Range, std::unique_ptr<TrainingPlan>> training_plans_;
  TrainingPlan* training_ = nullptr;  // of the forward() that awaits its backward()
  Shape result_shape_;                // of that forward()
};

}  // namespace sdmt::nn

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sdmt/nn/layer.h"

namespace sdmt::nn {

class Conv2d;

/// Layers applied one after another, any sub-range [first, last) of them at a time: last == -1
/// means all. Owns the layers and the tensors between them, whose memory is reused, so that running
/// shapes seen before allocates nothing. Not thread-safe.
class Sequential {
 public:
  /// Appends a layer. Throws std::invalid_argument when the name is empty or taken.
  Sequential& add(std::string name, std::unique_ptr<Layer> layer);

  int size() const { return static_cast<int>(entries_.size()); }
  /// 0 <= i < size().
  const std::string& name(int i) const { return entries_[static_cast<std::size_t>(i)].name; }
  Layer& layer(int i) { return *entries_[static_cast<std::size_t>(i)].layer; }
  const Layer& layer(int i) const { return *entries_[static_cast<std::size_t>(i)].layer; }
  /// Position of the layer of that name. Throws std::invalid_argument when there is none.
  int index(std::string_view name) const;

  /// Shape after layers [first, last). Throws as the layers do, or for a range outside the layers.
  Shape output_shape(Shape in, int first = 0, int last = -1) const;

  /// Runs layers [first, last) on x. The result belongs to the sequence and holds until its next
  /// forward(); for an empty range it is x itself.
  ///
  /// inference: a convolution and the ReLU and MaxPool2d after it run as one, between two
  /// alternating buffers, for as many images at a time as the caches hold. training: every
  /// activation is kept for backward(), except that of a convolution or followed by ReLU, which is
  /// overwritten by the ReLU; x must stay alive and unchanged.
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
  /// Tells every layer; see Layer::parameters_changed().
  void parameters_changed();

 private:
  struct Entry {
    std::string name;
    std::unique_ptr<Layer> layer;
  };

  int checked_last(int first, int last) const;
  template <typename Kind>
  bool is(int i, int end);
  Conv2d& convolution(int i);
  const Tensor& forward_inference(const Tensor& x, int first, int end);
  /// Runs layers [first, end) between the two buffers; the last result goes to `result` if given.
  const Tensor& run_layers(const Tensor& x, int first, int end, Tensor* result);
  /// Number of layers, fused ones together, that forward_inference runs as one from layer i on.
  int fused_layers(int i, int end);
  const Tensor& forward_training(const Tensor& x, int first, int end);
  /// Result of layer i in the last training forward; its input for i < first_.
  const Tensor& activation(int i) const;
  /// First layer of that range with a trainable parameter, or last_.
  int lowest_trainable();

  std::vector<Entry> entries_;
  std::vector<Tensor> activations_;  // training: [i] is the result of layer i
  Tensor ping_pong_[2];              // inference: results; backward: gradients
  Tensor joined_;                    // inference: results of groups of images
  const Tensor* input_ = nullptr;    // of the last training forward
  int first_ = 0;                    // its range
  int last_ = 0;
};

}  // namespace sdmt::nn

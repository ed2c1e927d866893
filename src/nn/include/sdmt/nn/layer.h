// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sdmt/nn/batch_shards.h"
#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

/// A learnt array and the gradient of the loss with respect to it. The layer that owns it documents
/// the order of its values (for a convolution OHWI, for a matrix rows = outputs).
struct Parameter {
  std::string name;  ///< within its layer: "weight" or "bias"
  Tensor value;
  Tensor grad;            ///< same shape as value; empty until the first backward()
  bool decay = true;      ///< weight decay applies (false for biases and normalisation)
  bool trainable = true;  ///< false: frozen, backward() leaves grad alone
  float lr_scale = 1.0F;  ///< factor on the optimiser's learning rate, > 0
};

/// A parameter with its name in the whole network, "conv1_1.weight". The layer owns the parameter.
struct NamedParameter {
  std::string name;
  Parameter* parameter = nullptr;
};

/// A named array that is part of a layer's state but is not learnt by gradient (running
/// statistics).
struct Buffer {
  std::string name;
  Tensor value;
};

/// A tensor that somebody else owns, with its name in the whole network or optimiser: what is saved
/// and loaded by name.
struct NamedTensor {
  std::string name;
  Tensor* tensor = nullptr;
};

/// inference: running statistics, nothing kept for backward(). training: batch statistics.
enum class Mode { inference, training };

/// One step of a network: y = f(x), with its derivative. Tensors belong to the caller, who keeps x
/// and y alive between forward() and backward() of the same batch; a layer holds only its
/// parameters and small scratch memory. Sums over the images of a batch are those of BatchShards.
/// infer() may run in several threads at once, nothing else may beside it; a layer uses OpenMP
/// inside. Results do not depend on the number of threads.
class Layer {
 public:
  virtual ~Layer() = default;

  /// Name of the kind as PyTorch spells it: "Conv2d", "Linear", "ReLU", ...
  virtual std::string_view type() const = 0;

  /// Shape of y for x of shape `in`. Throws std::invalid_argument naming the layer, the shape and
  /// what was expected.
  virtual Shape output_shape(Shape in) const = 0;

  /// Resizes and fills y. x and y are different tensors. Throws as output_shape().
  virtual void infer(const Tensor& x, Tensor& y) const = 0;
  /// In inference mode infer(); layers that differ in training override it.
  virtual void forward(const Tensor& x, Tensor& y, Mode /*mode*/) { infer(x, y); }

  /// Given dy = dL/dy for the x and y of the last forward(..., Mode::training): adds dL/dparameter
  /// to the grad of every trainable parameter (there after ProcessGroup::wait() where processes
  /// share the batch), and, when dx is not null, resizes *dx to x's shape
  /// and sets it to dL/dx.
  virtual void backward(const Tensor& x, const Tensor& y, const Tensor& dy, Tensor* dx) = 0;

  /// Learnt arrays in a fixed order; pointers stay valid for the life of the layer.
  virtual std::vector<Parameter*> parameters() { return {}; }
  /// Other state in a fixed order.
  virtual std::vector<Buffer*> buffers() { return {}; }
  /// Must be called after the values of parameters or buffers were changed from outside (loading,
  /// an optimiser step): layers may keep transformed copies, such as Winograd weights.
  virtual void parameters_changed() {}

  /// What the tensors of the training passes to come are of: some images of a batch that other
  /// processes have the rest of. Must outlive them. Null, as at first: they are whole batches.
  void set_shards(const BatchShards* shards) { shards_ = shards; }

 protected:
  /// How the batch is cut that x holds the images of.
  BatchShards shards_of(const Tensor& x) const {
    return shards_ != nullptr ? *shards_ : BatchShards(x.shape().n);
  }

 private:
  const BatchShards* shards_ = nullptr;
};

}  // namespace sdmt::nn

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "sdmt/nn/inference_workspace.h"
#include "sdmt/nn/layer.h"

namespace sdmt::nn {

class BatchNorm;
class Conv2d;
class Convolution;
class InstanceNorm;

/// How layers run one after another in inference: a convolution together with the batch
/// normalisation, ReLU and MaxPool2d after it, the normalisation folded into a copy of the weights;
/// an instance normalisation with the ReLU after it; and a first convolution of images as the
/// second one reads it. Running is const: it may be done
/// in several threads at once.
class InferencePlan {
 public:
  /// The layers must outlive the plan.
  explicit InferencePlan(const std::vector<Layer*>& layers);
  ~InferencePlan();

  /// Folds the normalisations, unless nothing has changed since. To be called before run().
  void fold();
  /// To be called after the values of parameters or buffers were changed.
  void parameters_changed() { folded_current_ = false; }
  /// Gives up the weights of convolutions that were folded. No change of parameters, and no other
  /// plan with these layers, may follow.
  void release_weights();
  /// The result lies in the workspace, where x must not be; it is x itself when there are no
  /// layers.
  const Tensor& run(const Tensor& x, InferenceWorkspace& workspace) const;

 private:
  struct Folded;
  struct Step {
    Layer* layer = nullptr;              // either this
    InstanceNorm* norm = nullptr;        // which is this, if a ReLU follows
    Convolution* convolution = nullptr;  // or this, with what follows it
    Convolution* before = nullptr;       // whose rectified result it reads, if they run together
    bool relu = false;
    bool max_pool = false;
    bool by_image = false;  // works on each image alone

    Shape output_shape(Shape in) const;
    void run(const Tensor& x, Tensor& y) const;
  };

  /// Takes the layers from i on that run as one, and returns how many they are.
  std::size_t add_step(const std::vector<Layer*>& layers, std::size_t i);
  Convolution* folded(Conv2d& convolution, BatchNorm& norm);
  /// Runs steps [first, end) between two tensors; the last result goes to `result` if given.
  const Tensor& run_steps(const Tensor& x, std::size_t first, std::size_t end,
                          InferenceWorkspace& workspace, Tensor* result) const;

  std::vector<Step> steps_;
  std::vector<std::unique_ptr<Folded>> folded_;
  bool folded_current_ = false;
};

}  // namespace sdmt::nn

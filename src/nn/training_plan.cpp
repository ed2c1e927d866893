// SPDX-License-Identifier: Apache-2.0
#include "training_plan.h"

#include <algorithm>
#include <cstddef>

#include "convolution.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/norm_layer.h"
#include "sdmt/nn/relu.h"

namespace sdmt::nn {

TrainingPlan::TrainingPlan(const std::vector<Layer*>& layers) {
  const auto is_relu = [&layers](std::size_t i) {
    return i < layers.size() && dynamic_cast<ReLU*>(layers[i]) != nullptr;
  };
  for (std::size_t i = 0; i < layers.size(); ++i) {
    Step step{.layer = layers[i],
              .convolution = dynamic_cast<Conv2d*>(layers[i]),
              .norm = dynamic_cast<NormLayer*>(layers[i]),
              .pool = dynamic_cast<MaxPool2d*>(layers[i]),
              .relu = is_relu(i)};
    if ((step.convolution != nullptr || step.norm != nullptr) && is_relu(i + 1)) {
      step.relu = true;
      ++i;
    }
    if (!steps_.empty() && steps_.back().relu && steps_.back().norm == nullptr) {
      step.takes_relu_below = step.convolution != nullptr || step.pool != nullptr;
      steps_.back().relu_taken_above = step.takes_relu_below;
    }
    steps_.push_back(std::move(step));
  }
}

const Tensor& TrainingPlan::forward(const Tensor& x) {
  input_ = &x;
  for (int i = 0; i < static_cast<int>(steps_.size()); ++i) run_forward(steps_[i], input_of(i));
  return input_of(static_cast<int>(steps_.size()));
}

void TrainingPlan::run_forward(Step& step, const Tensor& x) {
  if (step.convolution != nullptr) {
    step.convolution->convolution_->forward(x, {.relu = step.relu}, Mode::training, step.result);
  } else if (step.norm != nullptr) {
    step.norm->train(x, step.result, step.relu);
  } else {
    step.layer->forward(x, step.result, Mode::training);
  }
}

void TrainingPlan::backward(const Tensor& dy, Tensor* dx) {
  const int steps = static_cast<int>(steps_.size());
  const int lowest = dx != nullptr ? 0 : lowest_trainable();
  const Tensor* gradient = &dy;
  const auto other = [&] { return &gradients_[gradient == &gradients_[0] ? 1 : 0]; };
  for (int i = steps - 1; i >= lowest; --i) {
    Step& step = steps_[i];
    if (step.relu && step.norm == nullptr && !step.relu_taken_above) {
      Tensor* const masked = other();
      ReLU().backward(step.result, step.result, *gradient, masked);
      gradient = masked;
    }
    if (step.relu && step.convolution == nullptr && step.norm == nullptr) continue;
    Tensor* const to = i > lowest ? other() : dx;
    run_backward(step, input_of(i), *gradient, to);
    gradient = to;
  }
  if (dx != nullptr && gradient != dx) *dx = *gradient;
}

void TrainingPlan::run_backward(Step& step, const Tensor& x, const Tensor& dy, Tensor* dx) {
  if (step.convolution != nullptr) {
    step.convolution->add_parameter_gradients(x, dy);
    if (dx == nullptr) return;
    step.convolution->convolution_->input_gradient(x, dy, step.takes_relu_below ? &x : nullptr,
                                                   *dx);
  } else if (step.norm != nullptr) {
    step.norm->gradients(x, dy, dx, step.relu);
  } else if (step.takes_relu_below) {
    if (dx != nullptr) step.pool->backward_through_relu(x, step.result, dy, *dx);
  } else {
    step.layer->backward(x, step.result, dy, dx);
  }
}

int TrainingPlan::lowest_trainable() const {
  const auto is_trainable = [](const Step& step) {
    return std::ranges::any_of(step.layer->parameters(), &Parameter::trainable);
  };
  return static_cast<int>(std::ranges::find_if(steps_, is_trainable) - steps_.begin());
}

}  // namespace sdmt::nn

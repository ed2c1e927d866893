// SPDX-License-Identifier: Apache-2.0
#include "inference_plan.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>

#include "convolution.h"
#include "kernels/channel_norm.h"
#include "sdmt/nn/avg_pool2d.h"
#include "sdmt/nn/batch_norm.h"
#include "sdmt/nn/instance_norm.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/relu.h"

namespace sdmt::nn {

/// A convolution whose weights and bias do what the batch normalisation after it would do.
struct InferencePlan::Folded {
  Conv2d& source;
  BatchNorm& norm;
  Tensor weight;
  Tensor bias;
  Convolution convolution;

  Folded(Conv2d& conv, BatchNorm& batch_norm)
      : source(conv), norm(batch_norm), convolution(conv.options(), weight, bias) {}

  void update() {
    if (source.weight().value.empty()) {
      throw std::logic_error("Conv2d: the weights were given up");
    }
    const ChannelAffine affine = norm.affine(norm.running_statistics());
    weight = source.weight().value;
    const int channels = weight.shape().n;
    bias.resize({1, 1, 1, channels});
    for (int o = 0; o < channels; ++o) {
      for (float& value : weight.images(o, 1).values()) {
        value = static_cast<float>(value * affine.scale[o]);
      }
      const double old = source.bias().value.empty() ? 0.0 : source.bias().value.data()[o];
      bias.data()[o] = static_cast<float>(old * affine.scale[o] + affine.shift[o]);
    }
    convolution.weights_changed();
  }
};

InferencePlan::InferencePlan(const std::vector<Layer*>& layers) {
  for (std::size_t i = 0; i < layers.size();) i += add_step(layers, i);
}

InferencePlan::~InferencePlan() = default;

std::size_t InferencePlan::add_step(const std::vector<Layer*>& layers, std::size_t i) {
  const auto next = [&]<typename Kind>(Kind*& found) {
    found = i < layers.size() ? dynamic_cast<Kind*>(layers[i]) : nullptr;
    if (found != nullptr) ++i;
    return found != nullptr;
  };
  const std::size_t begin = i;
  Conv2d* conv = nullptr;
  BatchNorm* norm = nullptr;
  ReLU* relu = nullptr;
  MaxPool2d* pool = nullptr;
  Step step{.by_image = true};
  if (next(conv)) {
    step.convolution = next(norm) ? folded(*conv, *norm) : conv->convolution_.get();
    step.relu = next(relu);
    step.max_pool = step.relu && next(pool);
    if (step.relu && !steps_.empty()) {
      const Step& last = steps_.back();
      const bool alone = last.convolution != nullptr && last.before == nullptr;
      if (alone && last.relu && !last.max_pool && step.convolution->can_follow(*last.convolution)) {
        step.before = last.convolution;
        steps_.pop_back();
      }
    }
  } else {
    step.layer = layers[i++];
    step.norm = dynamic_cast<InstanceNorm*>(step.layer);
    if (step.norm != nullptr && !next(relu)) step.norm = nullptr;
    step.by_image = dynamic_cast<ReLU*>(step.layer) != nullptr ||
                    dynamic_cast<MaxPool2d*>(step.layer) != nullptr ||
                    dynamic_cast<AvgPool2d*>(step.layer) != nullptr ||
                    dynamic_cast<BatchNorm*>(step.layer) != nullptr ||
                    dynamic_cast<InstanceNorm*>(step.layer) != nullptr;
  }
  steps_.push_back(step);
  return i - begin;
}

Convolution* InferencePlan::folded(Conv2d& convolution, BatchNorm& norm) {
  folded_.push_back(std::make_unique<Folded>(convolution, norm));
  return &folded_.back()->convolution;
}

Shape InferencePlan::Step::output_shape(Shape in) const {
  if (layer != nullptr) return layer->output_shape(in);
  const Shape out = convolution->output_shape(before != nullptr ? before->output_shape(in) : in);
  return max_pool ? MaxPool2d().output_shape(out) : out;
}

void InferencePlan::Step::run(const Tensor& x, Tensor& y) const {
  const ConvolutionEpilogue epilogue{.relu = relu, .max_pool = max_pool};
  if (norm != nullptr) {
    norm->normalise(x, y, true, nullptr);
  } else if (layer != nullptr) {
    layer->infer(x, y);
  } else if (before != nullptr) {
    convolution->forward_after(*before, x, epilogue, y);
  } else {
    convolution->forward(x, epilogue, Mode::inference, y);
  }
}

void InferencePlan::fold() {
  if (folded_current_) return;
  for (const auto& folded : folded_) folded->update();
  folded_current_ = true;
}

void InferencePlan::release_weights() {
  fold();
  for (const auto& folded : folded_) folded->source.weight().value = Tensor();
}

const Tensor& InferencePlan::run(const Tensor& x, InferenceWorkspace& workspace) const {
  // Convolutions and what follows them work on each image alone: a few images at a time pass
  // through all of them, so that a layer finds in the caches what the last one left there. Fully
  // connected layers need the whole batch, to read their weights once.
  constexpr std::size_t kGroupValues = 8 << 20;  // of a step's input and output
  std::size_t by_image = 0;                      // number of steps
  std::size_t largest = 1;
  Shape shape = x.shape();
  for (; by_image < steps_.size() && steps_[by_image].by_image; ++by_image) {
    const Shape out = steps_[by_image].output_shape(shape);
    largest = std::max(largest, shape.image_size() + out.image_size());
    shape = out;
  }
  const int group = static_cast<int>(std::max<std::size_t>(1, kGroupValues / largest));
  const int groups = (x.shape().n + group - 1) / group;
  if (groups <= 1 || by_image <= 1) return run_steps(x, 0, steps_.size(), workspace, nullptr);
  workspace.joined.resize(shape);
  for (int i = 0; i < groups; ++i) {
    const int begin = static_cast<int>(std::int64_t{i} * x.shape().n / groups);
    const int count = static_cast<int>((i + std::int64_t{1}) * x.shape().n / groups) - begin;
    Tensor result = workspace.joined.images(begin, count);
    run_steps(x.images(begin, count), 0, by_image, workspace, &result);
  }
  return run_steps(workspace.joined, by_image, steps_.size(), workspace, nullptr);
}

const Tensor& InferencePlan::run_steps(const Tensor& x, std::size_t first, std::size_t end,
                                       InferenceWorkspace& workspace, Tensor* result) const {
  Tensor* const results = workspace.results;
  const Tensor* from = &x;
  for (std::size_t i = first; i < end; ++i) {
    Tensor* to = from == &results[0] ? &results[1] : &results[0];
    if (result != nullptr && i + 1 == end) to = result;
    steps_[i].run(*from, *to);
    from = to;
  }
  return *from;
}

}  // namespace sdmt::nn

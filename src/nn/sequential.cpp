// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/sequential.h"

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <utility>

#include "sdmt/nn/conv2d.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/relu.h"

namespace sdmt::nn {

Sequential& Sequential::add(std::string name, std::unique_ptr<Layer> layer) {
  if (name.empty()) throw std::invalid_argument("Sequential: a layer has no name");
  for (const Entry& entry : entries_) {
    if (entry.name == name) {
      throw std::invalid_argument("Sequential: two layers are named " + name);
    }
  }
  entries_.push_back({std::move(name), std::move(layer)});
  activations_.emplace_back();
  input_ = nullptr;
  return *this;
}

int Sequential::index(std::string_view name) const {
  for (int i = 0; i < size(); ++i) {
    if (this->name(i) == name) return i;
  }
  std::string known;
  for (int i = 0; i < size(); ++i) known += (i == 0 ? "" : ", ") + this->name(i);
  throw std::invalid_argument("there is no layer '" + std::string(name) + "', expected one of " +
                              known);
}

int Sequential::checked_last(int first, int last) const {
  const int end = last == -1 ? size() : last;
  if (first < 0 || end < first || end > size()) {
    throw std::invalid_argument("Sequential: layers [" + std::to_string(first) + "," +
                                std::to_string(last) + ") asked for, expected a range within [0," +
                                std::to_string(size()) + ")");
  }
  return end;
}

Shape Sequential::output_shape(Shape in, int first, int last) const {
  const int end = checked_last(first, last);
  for (int i = first; i < end; ++i) in = layer(i).output_shape(in);
  return in;
}

template <typename Kind>
bool Sequential::is(int i, int end) {
  return i < end && dynamic_cast<Kind*>(&layer(i)) != nullptr;
}

const Tensor& Sequential::forward(const Tensor& x, Mode mode, int first, int last) {
  const int end = checked_last(first, last);
  input_ = nullptr;
  const Tensor& y =
      mode == Mode::training ? forward_training(x, first, end) : forward_inference(x, first, end);
  if (mode == Mode::training) {
    input_ = &x;
    first_ = first;
    last_ = end;
  }
  return y;
}

int Sequential::fused_layers(int i, int end) {
  if (!is<Conv2d>(i, end) || !is<ReLU>(i + 1, end)) return 1;
  return is<MaxPool2d>(i + 2, end) ? 3 : 2;
}

const Tensor& Sequential::forward_inference(const Tensor& x, int first, int end) {
  // Convolutions and what follows them work on each image alone: a few images at a time pass
  // through all of them, so that a layer finds in the caches what the last one left there. Fully
  // connected layers need the whole batch, to read their weights once.
  constexpr std::size_t kGroupValues = 8 << 20;  // of a layer's input and output
  int local_end = first;
  std::size_t largest = 1;
  Shape shape = x.shape();
  while (local_end < end && (is<Conv2d>(local_end, end) || is<ReLU>(local_end, end) ||
                             is<MaxPool2d>(local_end, end))) {
    const int next = local_end + fused_layers(local_end, end);
    const Shape out = output_shape(shape, local_end, next);
    largest = std::max(largest, shape.image_size() + out.image_size());
    shape = out;
    local_end = next;
  }
  const int group = static_cast<int>(std::max<std::size_t>(1, kGroupValues / largest));
  const int groups = (x.shape().n + group - 1) / group;
  if (groups <= 1 || local_end - first <= 1) return run_layers(x, first, end, nullptr);
  joined_.resize(shape);
  for (int i = 0; i < groups; ++i) {
    const int begin = static_cast<int>(std::int64_t{i} * x.shape().n / groups);
    const int count = static_cast<int>((i + std::int64_t{1}) * x.shape().n / groups) - begin;
    Tensor result = joined_.images(begin, count);
    run_layers(x.images(begin, count), first, local_end, &result);
  }
  return run_layers(joined_, local_end, end, nullptr);
}

Conv2d& Sequential::convolution(int i) { return dynamic_cast<Conv2d&>(layer(i)); }

const Tensor& Sequential::run_layers(const Tensor& x, int first, int end, Tensor* result) {
  const Tensor* from = &x;
  for (int i = first; i < end;) {
    Tensor* to = from == &ping_pong_[0] ? &ping_pong_[1] : &ping_pong_[0];
    int layers = fused_layers(i, end);
    // A first convolution of images is made while the second reads it.
    const int second = i + 2;
    const int second_layers = layers == 2 ? fused_layers(second, end) : 1;
    const bool together = second_layers > 1 && convolution(second).can_follow(convolution(i));
    if (together) layers += second_layers;
    if (result != nullptr && i + layers == end) to = result;
    if (together) {
      convolution(second).forward_after(convolution(i), *from, *to,
                                        second_layers == 3 ? Fusion::relu_max_pool : Fusion::relu);
    } else if (layers > 1) {
      convolution(i).forward_fused(*from, *to, layers == 3 ? Fusion::relu_max_pool : Fusion::relu);
    } else {
      layer(i).forward(*from, *to, Mode::inference);
    }
    from = to;
    i += layers;
  }
  return *from;
}

const Tensor& Sequential::forward_training(const Tensor& x, int first, int end) {
  const Tensor* from = &x;
  for (int i = first; i < end; ++i) {
    // The ReLU's backward needs only its own result, so the convolution's need not exist.
    auto* conv = dynamic_cast<Conv2d*>(&layer(i));
    const bool fused = conv != nullptr && is<ReLU>(i + 1, end);
    if (fused) ++i;
    Tensor& to = activations_[static_cast<std::size_t>(i)];
    if (fused) {
      conv->forward_fused(*from, to, Fusion::relu, Mode::training);
    } else {
      layer(i).forward(*from, to, Mode::training);
    }
    from = &to;
  }
  return *from;
}

const Tensor& Sequential::activation(int i) const {
  return i < first_ ? *input_ : activations_[static_cast<std::size_t>(i)];
}

int Sequential::lowest_trainable() {
  for (int i = first_; i < last_; ++i) {
    for (const Parameter* parameter : layer(i).parameters()) {
      if (parameter->trainable) return i;
    }
  }
  return last_;
}

void Sequential::backward(const Tensor& dy, Tensor* dx) {
  if (input_ == nullptr) {
    throw std::logic_error("Sequential: backward() without a forward() in training mode");
  }
  const Shape expected = activation(last_ - 1).shape();
  if (dy.shape() != expected) {
    throw std::invalid_argument("Sequential: the gradient is " + dy.shape().str() + ", expected " +
                                expected.str());
  }
  const int lowest = dx != nullptr ? first_ : lowest_trainable();
  const Tensor* gradient = &dy;
  for (int i = last_ - 1; i >= lowest;) {
    Tensor* to = gradient == &ping_pong_[0] ? &ping_pong_[1] : &ping_pong_[0];
    const Tensor& x = activation(i - 1);
    const Tensor& y = activation(i);
    auto* conv = dynamic_cast<Conv2d*>(&layer(i));
    auto* pool = dynamic_cast<MaxPool2d*>(&layer(i));
    const bool through_relu =
        (conv != nullptr || pool != nullptr) && i > lowest && is<ReLU>(i - 1, last_);
    const int next = through_relu ? i - 2 : i - 1;
    if (next < lowest) to = dx;
    if (through_relu && to != nullptr) {
      if (conv != nullptr) conv->backward_through_relu(x, *gradient, *to);
      if (pool != nullptr) pool->backward_through_relu(x, y, *gradient, *to);
    } else {
      // A ReLU does not read x, which does not exist when the convolution below was fused with it.
      layer(i).backward(is<ReLU>(i, last_) ? y : x, y, *gradient, to);
    }
    gradient = to;
    i = next;
  }
  if (dx != nullptr && first_ == last_) *dx = dy;
  input_ = nullptr;
}

std::vector<NamedParameter> Sequential::named_parameters() {
  std::vector<NamedParameter> all;
  for (const Entry& entry : entries_) {
    for (Parameter* parameter : entry.layer->parameters()) {
      all.push_back({entry.name + "." + parameter->name, parameter});
    }
  }
  return all;
}

std::vector<NamedTensor> Sequential::named_buffers() {
  std::vector<NamedTensor> all;
  for (const Entry& entry : entries_) {
    for (Buffer* buffer : entry.layer->buffers()) {
      all.push_back({entry.name + "." + buffer->name, &buffer->value});
    }
  }
  return all;
}

void Sequential::parameters_changed() {
  for (const Entry& entry : entries_) entry.layer->parameters_changed();
}

}  // namespace sdmt::nn

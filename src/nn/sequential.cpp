// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/sequential.h"

#include <stdexcept>
#include <utility>

#include "inference_plan.h"
#include "training_plan.h"

namespace sdmt::nn {

Sequential::Sequential() = default;
Sequential::~Sequential() = default;
Sequential::Sequential(Sequential&&) noexcept = default;
Sequential& Sequential::operator=(Sequential&&) noexcept = default;

Sequential& Sequential::add(std::string name, std::unique_ptr<Layer> layer) {
  if (name.empty()) throw std::invalid_argument("Sequential: a layer has no name");
  for (const Entry& entry : entries_) {
    if (entry.name == name) {
      throw std::invalid_argument("Sequential: two layers are named " + name);
    }
  }
  entries_.push_back({std::move(name), std::move(layer)});
  inference_plans_.clear();
  training_plans_.clear();
  training_ = nullptr;
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

Sequential::Range Sequential::checked_range(int first, int last) const {
  const int end = last == -1 ? size() : last;
  if (first < 0 || end < first || end > size()) {
    throw std::invalid_argument("Sequential: layers [" + std::to_string(first) + "," +
                                std::to_string(last) + ") asked for, expected a range within [0," +
                                std::to_string(size()) + ")");
  }
  return {first, end};
}

Shape Sequential::output_shape(Shape in, int first, int last) const {
  for (const Layer* layer : layers_in(checked_range(first, last))) in = layer->output_shape(in);
  return in;
}

std::vector<Layer*> Sequential::layers_in(Range range) const {
  std::vector<Layer*> layers;
  for (int i = range.first; i < range.second; ++i) layers.push_back(entries_[i].layer.get());
  return layers;
}

template <typename Plan>
Plan& Sequential::plan_for(Range range, Plans<Plan>& plans) {
  std::unique_ptr<Plan>& plan = plans[range];
  if (plan == nullptr) plan = std::make_unique<Plan>(layers_in(range));
  return *plan;
}

const Tensor& Sequential::forward(const Tensor& x, Mode mode, int first, int last) {
  const Range range = checked_range(first, last);
  training_ = nullptr;
  if (mode == Mode::inference) return plan_for(range, inference_plans_).run(x);
  TrainingPlan& plan = plan_for(range, training_plans_);
  const Tensor& y = plan.forward(x);
  training_ = &plan;
  result_shape_ = y.shape();
  return y;
}

void Sequential::backward(const Tensor& dy, Tensor* dx) {
  if (training_ == nullptr) {
    throw std::logic_error("Sequential: backward() without a forward() in training mode");
  }
  if (dy.shape() != result_shape_) {
    throw std::invalid_argument("Sequential: the gradient is " + dy.shape().str() + ", expected " +
                                result_shape_.str());
  }
  std::exchange(training_, nullptr)->backward(dy, dx);
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
  for (auto& [range, plan] : inference_plans_) plan->parameters_changed();
}

}  // namespace sdmt::nn

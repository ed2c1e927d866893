// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/sequential.h"

#include <mutex>
#include <stdexcept>
#include <utility>

#include "inference_plan.h"
#include "sdmt/nn/linear.h"
#include "training_plan.h"

namespace sdmt::nn {

/// The plans of the ranges that were asked for, each made once, by whichever thread comes first.
class InferencePlans {
 public:
  template <typename Layers>
  const InferencePlan& plan(std::pair<int, int> range, Layers layers) {
    const std::scoped_lock lock(mutex_);
    std::unique_ptr<InferencePlan>& plan = plans_[range];
    if (plan == nullptr) plan = std::make_unique<InferencePlan>(layers(range));
    plan->fold();
    return *plan;
  }
  void release_weights() {
    for (auto& [range, plan] : plans_) plan->release_weights();
  }
  void parameters_changed() {
    for (auto& [range, plan] : plans_) plan->parameters_changed();
  }

 private:
  std::mutex mutex_;
  std::map<std::pair<int, int>, std::unique_ptr<InferencePlan>> plans_;
};

Sequential::Sequential() : inference_plans_(std::make_unique<InferencePlans>()) {}
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
  inference_plans_ = std::make_unique<InferencePlans>();
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

const Tensor& Sequential::infer(const Tensor& x, InferenceWorkspace& workspace, int first,
                                int last) const {
  const auto layers = [this](Range range) { return layers_in(range); };
  return inference_plans_->plan(checked_range(first, last), layers).run(x, workspace);
}

const Tensor& Sequential::forward(const Tensor& x, Mode mode, int first, int last) {
  const Range range = checked_range(first, last);
  training_ = nullptr;
  if (mode == Mode::inference) return infer(x, workspaces_[range], range.first, range.second);
  std::unique_ptr<TrainingPlan>& plan = training_plans_[range];
  if (plan == nullptr) plan = std::make_unique<TrainingPlan>(layers_in(range));
  const Tensor& y = plan->forward(x);
  training_ = plan.get();
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

void Sequential::set_shards(const BatchShards* shards) {
  for (const Entry& entry : entries_) entry.layer->set_shards(shards);
}

void Sequential::release_for_inference() {
  const Range all = checked_range(0, -1);
  for (Layer* layer : layers_in(all)) {
    if (auto* linear = dynamic_cast<Linear*>(layer)) linear->release_weights();
  }
  inference_plans_ = std::make_unique<InferencePlans>();
  inference_plans_->plan(all, [this](Range range) { return layers_in(range); });
  inference_plans_->release_weights();
}

void Sequential::parameters_changed() {
  for (const Entry& entry : entries_) entry.layer->parameters_changed();
  inference_plans_->parameters_changed();
}

}  // namespace sdmt::nn

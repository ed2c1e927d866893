// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/linear.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "gradient_sum.h"
#include "kernels/column_sum.h"
#include "kernels/gemm.h"
#include "kernels/half_weights.h"
#include "kernels/outer_products.h"
#include "kernels/row_products.h"
#include "parameter_access.h"
#include "sdmt/io/checked_value.h"

namespace sdmt::nn {

void LinearOptions::validate() const {
  io::require(in_features >= 1, "Linear: in_features", in_features, ">= 1");
  io::require(out_features >= 1, "Linear: out_features", out_features, ">= 1");
}

Linear::Linear(LinearOptions options)
    : options_(options),
      half_weights_(std::make_unique<HalfWeights>()),
      weight_sum_(std::make_unique<GradientSum>()),
      bias_sum_(std::make_unique<GradientSum>()) {
  options_.validate();
  weight_.name = "weight";
  weight_.value = Tensor({options_.out_features, 1, 1, options_.in_features});
  bias_.name = "bias";
  bias_.decay = false;
  if (options_.bias) bias_.value = Tensor({1, 1, 1, options_.out_features});
}

Linear::~Linear() = default;

void Linear::reset_parameters(Random& random) {
  he_normal(weight_.value, options_.in_features, random);
  if (options_.bias) bias_.value.fill(0.0F);
  parameters_changed();
}

Shape Linear::output_shape(Shape in) const {
  if (in.image_size() != static_cast<std::size_t>(options_.in_features)) {
    throw std::invalid_argument("Linear: input is " + in.str() + ", expected " +
                                std::to_string(options_.in_features) + " values a row");
  }
  return {in.n, 1, 1, options_.out_features};
}

void Linear::infer(const Tensor& x, Tensor& y) const { multiply(x, has_half_weights(), y); }

void Linear::forward(const Tensor& x, Tensor& y, Mode mode) {
  multiply(x, mode == Mode::inference && has_half_weights(), y);
}

void Linear::multiply(const Tensor& x, bool half, Tensor& y) const {
  y.resize(output_shape(x.shape()));
  const std::ptrdiff_t in = options_.in_features;
  const std::ptrdiff_t out = options_.out_features;
  const ProductView product = {
      .data = y.data(), .row_stride = out, .bias = options_.bias ? bias_.value.data() : nullptr};
  if (half) {
    multiply_rows(x.shape().n, x.data(), *half_weights_, product);
  } else {
    require_weights();
    multiply_rows(x.shape().n, out, in, x.data(), weight_.value.data(), product);
  }
}

bool Linear::has_half_weights() const {
  constexpr std::size_t kFewWeights = 1 << 18;  // they stay in the caches
  const std::scoped_lock lock(making_half_weights_);
  if (weight_.value.size() > kFewWeights && !half_weights_tried_) half_weights_->set(weight_.value);
  half_weights_tried_ = true;
  return !half_weights_->empty();
}

void Linear::release_weights() {
  if (has_half_weights()) weight_.value = Tensor();
}

void Linear::require_weights() const {
  if (weight_.value.empty()) throw std::logic_error("Linear: the weights were given up");
}

void Linear::parameters_changed() {
  if (weight_.value.empty()) return;
  half_weights_->clear();
  half_weights_tried_ = false;
}

void Linear::backward(const Tensor& x, const Tensor&, const Tensor& dy, Tensor* dx) {
  const std::ptrdiff_t in = options_.in_features;
  const std::ptrdiff_t out = options_.out_features;
  const int n = x.shape().n;
  require_weights();
  add_parameter_gradients(x, dy);
  if (dx == nullptr) return;
  dx->resize(x.shape());
  gemm(n, in, out, {dy.data(), out, 1}, {weight_.value.data(), in, 1},
       {.data = dx->data(), .row_stride = in});
}

void Linear::add_parameter_gradients(const Tensor& x, const Tensor& dy) {
  const std::ptrdiff_t in = options_.in_features;
  const std::ptrdiff_t out = options_.out_features;
  const BatchShards shards = shards_of(x);
  if (weight_.trainable) {
    weight_sum_->start(shards, {&weight_});
    const auto nodes = shard_nodes(shards.first(), shards.end());
    std::vector<float*> targets;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      targets.push_back(weight_sum_->target(static_cast<int>(i), 0));
    }
    add_outer_products(shards, out, in, dy.data(), x.data(), targets);
    weight_sum_->finish();
  }
  if (!options_.bias || !bias_.trainable) return;
  bias_sum_->start(shards, {&bias_});
  bias_sum_->add_shards([&](int first, int count, bool add, const std::vector<float*>& sums) {
    if (!add) std::fill_n(sums[0], out, 0.0F);
    add_column_sums(dy.image(first), count, out, sums[0]);
  });
  bias_sum_->finish();
}

std::vector<Parameter*> Linear::parameters() {
  if (options_.bias) return {&weight_, &bias_};
  return {&weight_};
}

}  // namespace sdmt::nn

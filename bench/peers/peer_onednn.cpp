// SPDX-License-Identifier: Apache-2.0
// The network in oneDNN, asked as peer.h says:  peer_onednn MODEL winograd|direct
#include <map>
#include <memory>
#include <oneapi/dnnl/dnnl.hpp>
#include <vector>

#include "peer.h"
#include "sdmt/nn/batch_norm.h"
#include "sdmt/nn/conv2d.h"
#include "sdmt/nn/l2_normalize.h"
#include "sdmt/nn/linear.h"
#include "sdmt/nn/sequential.h"
#include "sdmt/reid/model_file.h"

namespace {

using namespace sdmt;
using dnnl::memory;
using Tag = memory::format_tag;
constexpr auto kFloat = memory::data_type::f32;

/// The network for one batch size: primitives and memory made once, weights in oneDNN's own order.
class Network {
 public:
  Network(reid::EmbeddingNetwork& network, int batch, dnnl::algorithm algorithm)
      : engine_(dnnl::engine::kind::cpu, 0), stream_(engine_), network_(network) {
    shape_ = network.input_shape(batch);
    input_ = memory({dims(shape_), kFloat, Tag::nhwc}, engine_);
    current_ = input_;
    nn::Sequential& trunk = network.trunk();
    for (int i = 0; i < trunk.size(); ++i) {
      if (auto* conv = dynamic_cast<nn::Conv2d*>(&trunk.layer(i))) add(*conv, algorithm);
      if (trunk.layer(i).type() == "MaxPool2d") add_pool();
    }
    add(dynamic_cast<nn::Linear&>(network.head().layer(0)), true);
    add(dynamic_cast<nn::Linear&>(network.head().layer(2)), false);
  }

  /// Batch normalisation and the unit sphere are 128 values a patch; our own layers do them.
  const nn::Tensor& run(const nn::Tensor& x) {
    input_.set_data_handle(const_cast<float*>(x.data()));
    for (auto& [primitive, arguments] : steps_) primitive.execute(stream_, arguments);
    stream_.wait();
    nn::Tensor fc2({shape_.n, 1, 1, network_.embedding_size()});
    const auto* values = static_cast<const float*>(current_.get_data_handle());
    std::copy_n(values, fc2.size(), fc2.data());
    return network_.head().forward(fc2, nn::Mode::inference, 3);
  }

 private:
  static memory::dims dims(nn::Shape s) { return {s.n, s.c, s.h, s.w}; }

  void reorder(const memory& from, const memory& to, bool at_run_time) {
    dnnl::reorder step(from, to);
    const std::unordered_map<int, memory> arguments{{DNNL_ARG_FROM, from}, {DNNL_ARG_TO, to}};
    if (at_run_time) {
      steps_.emplace_back(step, arguments);
    } else {
      step.execute(stream_, arguments);
      stream_.wait();
    }
  }

  memory in_order(const memory& m, const memory::desc& order, bool at_run_time) {
    if (m.get_desc() == order) return m;
    memory result(order, engine_);
    reorder(m, result, at_run_time);
    return result;
  }

  template <typename Description>
  void add_with_weights(const Description& description, nn::Tensor& weight, Tag weight_tag,
                        const memory::dims& weight_dims, nn::Tensor& bias) {
    memory weights({weight_dims, kFloat, weight_tag}, engine_, weight.data());
    if (weight_tag == Tag::ohwi) {
      // Its reorder to Winograd weights knows only the usual order.
      weights = in_order(weights, {weight_dims, kFloat, Tag::oihw}, false);
    }
    const memory biases({{bias.shape().c}, kFloat, Tag::a}, engine_, bias.data());
    const memory source = in_order(current_, description.src_desc(), true);
    const memory result(description.dst_desc(), engine_);
    using Primitive =
        std::conditional_t<std::is_same_v<Description, dnnl::convolution_forward::primitive_desc>,
                           dnnl::convolution_forward, dnnl::inner_product_forward>;
    steps_.emplace_back(
        Primitive(description),
        std::unordered_map<int, memory>{
            {DNNL_ARG_SRC, source},
            {DNNL_ARG_WEIGHTS, in_order(weights, description.weights_desc(), false)},
            {DNNL_ARG_BIAS, biases},
            {DNNL_ARG_DST, result}});
    current_ = result;
  }

  static dnnl::primitive_attr attributes(bool relu) {
    dnnl::primitive_attr attributes;
    dnnl::post_ops operations;
    if (relu) operations.append_eltwise(1.0F, dnnl::algorithm::eltwise_relu, 0.0F, 0.0F);
    attributes.set_post_ops(operations);
    return attributes;
  }

  void add(nn::Conv2d& conv, dnnl::algorithm algorithm) {
    const nn::Shape out = conv.output_shape(shape_);
    const memory::dims weights{out.c, shape_.c, 3, 3};
    // Its Winograd kernel does not pay for three channels, where the direct one is faster.
    if (shape_.c == 3) algorithm = dnnl::algorithm::convolution_auto;
    const dnnl::convolution_forward::desc description(
        dnnl::prop_kind::forward_inference, algorithm, {dims(shape_), kFloat, Tag::any},
        {weights, kFloat, Tag::any}, {{out.c}, kFloat, Tag::a}, {dims(out), kFloat, Tag::any},
        {1, 1}, {1, 1}, {1, 1});
    add_with_weights(
        dnnl::convolution_forward::primitive_desc(description, attributes(true), engine_),
        conv.weight().value, Tag::ohwi, weights, conv.bias().value);
    shape_ = out;
  }

  void add_pool() {
    const nn::Shape out{shape_.n, shape_.h / 2, shape_.w / 2, shape_.c};
    const dnnl::pooling_forward::desc description(
        dnnl::prop_kind::forward_inference, dnnl::algorithm::pooling_max, current_.get_desc(),
        {dims(out), kFloat, Tag::any}, {2, 2}, {2, 2}, {0, 0}, {0, 0});
    const dnnl::pooling_forward::primitive_desc primitive(description, engine_);
    const memory result(primitive.dst_desc(), engine_);
    steps_.emplace_back(
        dnnl::pooling_forward(primitive),
        std::unordered_map<int, memory>{{DNNL_ARG_SRC, current_}, {DNNL_ARG_DST, result}});
    current_ = result;
    shape_ = out;
  }

  void add(nn::Linear& linear, bool relu) {
    const nn::Shape out{shape_.n, 1, 1, linear.options().out_features};
    const bool flat = shape_.h * shape_.w == 1;
    const memory::dims from = flat ? memory::dims{shape_.n, shape_.c} : dims(shape_);
    const memory::dims weights =
        flat ? memory::dims{out.c, shape_.c} : memory::dims{out.c, shape_.c, shape_.h, shape_.w};
    const dnnl::inner_product_forward::desc description(
        dnnl::prop_kind::forward_inference, {from, kFloat, Tag::any}, {weights, kFloat, Tag::any},
        {{out.c}, kFloat, Tag::a}, {{out.n, out.c}, kFloat, Tag::nc});
    add_with_weights(
        dnnl::inner_product_forward::primitive_desc(description, attributes(relu), engine_),
        linear.weight().value, flat ? Tag::oi : Tag::ohwi, weights, linear.bias().value);
    shape_ = out;
  }

  dnnl::engine engine_;
  dnnl::stream stream_;
  reid::EmbeddingNetwork& network_;
  nn::Shape shape_;
  memory input_;
  memory current_;
  std::vector<std::pair<dnnl::primitive, std::unordered_map<int, memory>>> steps_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  reid::Model model = reid::load_model(argv[1]);
  const auto algorithm = std::string(argv[2]) == "winograd" ? dnnl::algorithm::convolution_winograd
                                                            : dnnl::algorithm::convolution_auto;
  std::map<int, std::unique_ptr<Network>> networks;
  std::map<int, nn::Tensor> inputs;
  peers::serve([&](const std::string& what, int batch, const std::string&) {
    if (what == "train") return false;
    auto& network = networks[batch];
    if (network == nullptr) {
      network = std::make_unique<Network>(model.network, batch, algorithm);
      inputs[batch] = peers::patches(batch);
    }
    const nn::Tensor& x = inputs[batch];
    if (what == "embed") {
      std::printf("%.4f\n", peers::milliseconds([&] { network->run(x); }));
    } else {
      const nn::Tensor& y = network->run(x);
      peers::print_values(y.image(0), y.image(batch - 1), y.shape().c);
    }
    return true;
  });
  return 0;
}

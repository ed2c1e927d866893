// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/pair_classifier.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "random_stream.h"
#include "sdmt/io/safetensors.h"
#include "sdmt/nn/avg_pool2d.h"
#include "sdmt/nn/batch_norm.h"
#include "sdmt/nn/linear.h"
#include "sdmt/nn/relu.h"

namespace sdmt::train {

namespace {

constexpr const char* kPrefix = "pair.";

std::vector<std::uint64_t> file_shape(const nn::Shape& shape) {
  if (shape.n == 1) return {static_cast<std::uint64_t>(shape.c)};
  return {static_cast<std::uint64_t>(shape.n), static_cast<std::uint64_t>(shape.c)};
}

void combine(const float* a, const float* b, float* out) {
  constexpr int kSize = PairClassifier::kFeatures;
  for (int k = 0; k < kSize; ++k) {
    out[k] = std::abs(a[k] - b[k]);
    out[kSize + k] = a[k] * b[k];
  }
}

// Rows of a batch that are here.
struct Part {
  int first = 0;
  int count = 0;
};

Part part(const nn::BatchShards* shards, int whole) {
  if (shards == nullptr) return {0, whole};
  return {shards->begin(shards->first()), shards->images_here()};
}

// Sixteen sums side by side, for vector registers; `size` is a multiple of 16.
float dot(const float* a, const float* b, int size) {
  std::array<float, 16> sums{};
  for (int k = 0; k < size; k += 16) {
    for (std::size_t lane = 0; lane < sums.size(); ++lane) {
      sums[lane] += a[k + static_cast<int>(lane)] * b[k + static_cast<int>(lane)];
    }
  }
  float total = 0;
  for (const float sum : sums) total += sum;
  return total;
}

}  // namespace

PairClassifier::PairClassifier(const nn::Shape& map) {
  constexpr BlockGrid grid;
  if (map.h % grid.rows != 0 || map.w % grid.columns != 0) {
    throw std::invalid_argument("pair classifier: 8x2 blocks do not fill the map " + map.str());
  }
  blocks_.add("blocks", std::make_unique<nn::AvgPool2d>(
                            nn::AvgPool2dOptions{map.h / grid.rows, map.w / grid.columns}));
  tower_
      .add("fc1", std::make_unique<nn::Linear>(
                      nn::LinearOptions{grid.rows * grid.columns * map.c, kFeatures, true}))
      .add("relu1", std::make_unique<nn::ReLU>())
      .add("bn", std::make_unique<nn::BatchNorm>(nn::BatchNormOptions{kFeatures}));
  auto fc2 = std::make_unique<nn::Linear>(nn::LinearOptions{2 * kFeatures, kHidden, true});
  auto fc3 = std::make_unique<nn::Linear>(nn::LinearOptions{kHidden, 2, true});
  fc2_ = fc2.get();
  fc3_ = fc3.get();
  classifier_.add("fc2", std::move(fc2))
      .add("relu2", std::make_unique<nn::ReLU>())
      .add("fc3", std::move(fc3));
}

void PairClassifier::initialize(std::uint64_t seed) {
  auto random = random_stream(seed, Purpose::weights);
  for (nn::Sequential* part : {&tower_, &classifier_}) {
    for (int i = 0; i < part->size(); ++i) {
      if (auto* linear = dynamic_cast<nn::Linear*>(&part->layer(i))) {
        linear->reset_parameters(random);
      }
    }
  }
  parameters_changed();
}

const nn::Tensor& PairClassifier::features_of_maps(const nn::Tensor& maps) {
  return forward_features(blocks_.forward(maps, nn::Mode::inference), nn::Mode::inference);
}

float PairClassifier::distance(const float* a, const float* b) const {
  std::array<float, 2 * kFeatures> combined{};
  std::array<float, kHidden> hidden{};
  combine(a, b, combined.data());
  const nn::Tensor& weights = fc2_->weight().value;
  const float* biases = fc2_->bias().value.data();
  for (int h = 0; h < kHidden; ++h) {
    const float sum = dot(combined.data(), weights.image(h), 2 * kFeatures) + biases[h];
    hidden[h] = std::max(0.0F, sum);
  }
  const nn::Tensor& last = fc3_->weight().value;
  const float* offsets = fc3_->bias().value.data();
  const float other = dot(hidden.data(), last.image(0), kHidden) + offsets[0];
  const float same = dot(hidden.data(), last.image(1), kHidden) + offsets[1];
  return 1.0F / (1.0F + std::exp(same - other));
}

void PairClassifier::set_shards(const nn::BatchShards* images, const nn::BatchShards* pairs) {
  image_shards_ = images;
  pair_shards_ = pairs;
  tower_.set_shards(images);
  classifier_.set_shards(pairs);
}

const nn::Tensor& PairClassifier::forward_features(const nn::Tensor& blocks, nn::Mode mode) {
  return tower_.forward(blocks, mode);
}

const nn::Tensor& PairClassifier::forward_pairs(const nn::Tensor& features,
                                                std::span<const FeaturePair> pairs, nn::Mode mode) {
  features_ = &features;
  pairs_.assign(pairs.begin(), pairs.end());
  const Part here = part(pair_shards_, static_cast<int>(pairs.size()));
  combined_.resize({here.count, 1, 1, 2 * kFeatures});
  // nothing throws
#pragma omp parallel for schedule(static)
  for (int p = 0; p < here.count; ++p) {
    const FeaturePair& pair = pairs_[here.first + p];
    combine(features.image(pair.first), features.image(pair.second), combined_.image(p));
  }
  return classifier_.forward(combined_, mode);
}

void PairClassifier::backward(const nn::Tensor& d_scores) {
  const Part here = part(pair_shards_, static_cast<int>(pairs_.size()));
  classifier_.backward(d_scores, &d_combined_here_);
  d_combined_.resize({static_cast<int>(pairs_.size()), 1, 1, 2 * kFeatures});
  std::ranges::copy(d_combined_here_.values(), d_combined_.image(here.first));
  if (pair_shards_ != nullptr) pair_shards_->gather_images(d_combined_.values(), 2 * kFeatures);
  d_features_.resize(features_->shape());
  d_features_.fill(0.0F);
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const float* a = features_->image(pairs_[p].first);
    const float* b = features_->image(pairs_[p].second);
    const float* d = d_combined_.image(static_cast<int>(p));
    float* da = d_features_.image(pairs_[p].first);
    float* db = d_features_.image(pairs_[p].second);
    for (int k = 0; k < kFeatures; ++k) {
      const float sign = a[k] > b[k] ? 1.0F : a[k] < b[k] ? -1.0F : 0.0F;
      da[k] += sign * d[k] + b[k] * d[kFeatures + k];
      db[k] += -sign * d[k] + a[k] * d[kFeatures + k];
    }
  }
  const Part images = part(image_shards_, d_features_.shape().n);
  tower_.backward(d_features_.images(images.first, images.count));
}

std::vector<nn::NamedParameter> PairClassifier::parameters() {
  auto all = tower_.named_parameters();
  const auto more = classifier_.named_parameters();
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

std::vector<nn::NamedTensor> PairClassifier::state() {
  std::vector<nn::NamedTensor> tensors;
  for (const auto& [name, parameter] : parameters()) tensors.push_back({name, &parameter->value});
  for (const auto& buffer : tower_.named_buffers()) tensors.push_back(buffer);
  return tensors;
}

void PairClassifier::parameters_changed() {
  tower_.parameters_changed();
  classifier_.parameters_changed();
}

double softmax_cross_entropy(const nn::Tensor& scores, const std::vector<bool>& same,
                             nn::Tensor& d_scores) {
  d_scores.resize(scores.shape());
  const double share = 1.0 / static_cast<double>(same.size());
  double loss = 0;
  for (std::size_t i = 0; i < same.size(); ++i) {
    const float* s = scores.image(static_cast<int>(i));
    const double right = same[i] ? s[1] : s[0];
    const double wrong = same[i] ? s[0] : s[1];
    // -log(e^right / (e^right + e^wrong)), without overflow for large scores.
    const double gap = wrong - right;
    loss += share * (gap > 0 ? gap + std::log1p(std::exp(-gap)) : std::log1p(std::exp(gap)));
    const double p_wrong = 1.0 / (1.0 + std::exp(-gap));
    float* d = d_scores.image(static_cast<int>(i));
    d[same[i] ? 1 : 0] = static_cast<float>(-share * p_wrong);
    d[same[i] ? 0 : 1] = static_cast<float>(share * p_wrong);
  }
  return loss;
}

LabelledPairs draw_pairs(std::span<const int> labels, std::span<const int> images,
                         nn::Random& random) {
  LabelledPairs drawn;
  std::vector<int> partners;
  std::vector<int> others;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    partners.clear();
    others.clear();
    for (std::size_t j = 0; j < labels.size(); ++j) {
      if (labels[j] != labels[i]) {
        others.push_back(static_cast<int>(j));
      } else if (images[j] != images[i]) {  // people with few images have some twice
        partners.push_back(static_cast<int>(j));
      }
    }
    for (const auto* choices : {&partners, &others}) {
      if (choices->empty()) continue;
      drawn.pairs.push_back({static_cast<int>(i), (*choices)[random.below(choices->size())]});
      drawn.same.push_back(choices == &partners);
    }
  }
  return drawn;
}

void save_pair_classifier(const std::filesystem::path& path, const reid::Model& model,
                          PairClassifier& classifier, reid::Storage storage) {
  io::SafetensorsWriter writer;
  reid::add_model(writer, model, storage);
  for (const auto& [name, tensor] : classifier.state()) {
    writer.add(kPrefix + name, file_shape(tensor->shape()),
               std::span<const float>(tensor->values()));
  }
  writer.write(path);
}

PairClassifier load_pair_classifier(const std::filesystem::path& path, reid::Model& model) {
  const io::Safetensors file(path);
  model = reid::read_model(file);
  if (file.find(std::string(kPrefix) + "fc1.weight") == nullptr) {
    throw std::invalid_argument(path.string() +
                                ": holds no pair classifier, expected a tensor pair.fc1.weight "
                                "(train-embedder --head pair-classifier)");
  }
  PairClassifier classifier(model.network.trunk().output_shape(model.network.input_shape(1)));
  for (const auto& [name, tensor] : classifier.state()) {
    file.read_floats(file.at(kPrefix + name, file_shape(tensor->shape())), tensor->values());
  }
  classifier.parameters_changed();
  return classifier;
}

}  // namespace sdmt::train

// SPDX-License-Identifier: Apache-2.0
#include "validation/contender.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "sdmt/image/color_histogram.h"
#include "sdmt/nn/l2_normalize.h"
#include "sdmt/nn/sequential.h"
#include "sdmt/reid/embedder.h"
#include "sdmt/train/pair_classifier.h"

namespace sdmt::tools {

namespace {

// Something made of the trunk's feature maps, a piece of the crops at a time.
class MapDescriptor : public image::CropDescriptor {
 public:
  explicit MapDescriptor(reid::Model model) : model_(std::move(model)) {}

  std::optional<double> tau_a() const override { return std::nullopt; }
  void describe(std::span<const image::Crop> crops, image::DescriptorRows& out) override {
    constexpr std::size_t kBatch = 32;
    out.reset(crops.size(), dimension());
    std::vector<std::size_t> visible;
    for (std::size_t i = 0; i < crops.size(); ++i) {
      const auto& [image, rect] = crops[i];
      if (image::visible_region(image.width, image.height, rect)) visible.push_back(i);
    }
    for (std::size_t begin = 0; begin < visible.size(); begin += kBatch) {
      const auto piece =
          std::span(visible).subspan(begin, std::min(kBatch, visible.size() - begin));
      const int count = static_cast<int>(piece.size());
      patches_.resize(model_.network.input_shape(count));
      for (int i = 0; i < count; ++i) {
        const auto& [image, rect] = crops[piece[i]];
        image::extract_patch(image, rect, model_.metadata.preprocessing, patches_.image(i));
      }
      const auto& rows = of_maps(model_.network.trunk().forward(patches_, nn::Mode::inference));
      for (int i = 0; i < count; ++i) {
        std::copy_n(rows.image(i), out.dimension, out.row(piece[i]).begin());
        out.valid[piece[i]] = 1;
      }
    }
  }

 protected:
  virtual const nn::Tensor& of_maps(const nn::Tensor& maps) = 0;
  nn::Shape map_shape() const {
    return model_.network.trunk().output_shape(model_.network.input_shape(1));
  }

 private:
  reid::Model model_;
  nn::Tensor patches_;
};

class TrunkDescriptor final : public MapDescriptor {
 public:
  using MapDescriptor::MapDescriptor;
  std::string name() const override { return "trunk features"; }
  int dimension() const override { return static_cast<int>(map_shape().image_size()); }

 private:
  const nn::Tensor& of_maps(const nn::Tensor& maps) override {
    normalize_.forward(maps, rows_, nn::Mode::inference);
    return rows_;
  }

  nn::L2Normalize normalize_;
  nn::Tensor rows_;
};

class PairClassifierDescriptor final : public MapDescriptor {
 public:
  PairClassifierDescriptor(reid::Model model, std::shared_ptr<train::PairClassifier> classifier)
      : MapDescriptor(std::move(model)), classifier_(std::move(classifier)) {}
  std::string name() const override { return "pair classifier"; }
  int dimension() const override { return train::PairClassifier::kFeatures; }

 private:
  const nn::Tensor& of_maps(const nn::Tensor& maps) override {
    return classifier_->features_of_maps(maps);
  }

  std::shared_ptr<train::PairClassifier> classifier_;  // with the distance
};

Contender named(std::unique_ptr<image::CropDescriptor> descriptor) {
  std::string name = descriptor->name();
  return {std::move(name), std::move(descriptor), {}, {}};
}

}  // namespace

Contender embedding_contender(reid::Model model) {
  return named(std::make_unique<reid::Embedder>(std::move(model)));
}

Contender untrained_head_contender(reid::Model model, std::uint64_t seed) {
  reid::EmbeddingNetwork untrained(model.network.description());
  untrained.initialize(seed);
  const auto& fresh = untrained.state();
  const auto& state = model.network.state();
  for (std::size_t i = 0; i < state.size(); ++i) {
    const bool in_head = state[i].layer >= model.network.description().first_of_head();
    if (in_head) *state[i].value = *fresh[i].value;
  }
  model.network.parameters_changed();
  model.metadata.tau_a.reset();
  return {"untrained head", std::make_unique<reid::Embedder>(std::move(model)), {}, {}};
}

Contender trunk_contender(reid::Model model) {
  return named(std::make_unique<TrunkDescriptor>(std::move(model)));
}

Contender pair_classifier_contender(const std::filesystem::path& file) {
  reid::Model model;
  auto classifier =
      std::make_shared<train::PairClassifier>(train::load_pair_classifier(file, model));
  const auto distance = [classifier](const float* a, const float* b) {
    return classifier->distance(a, b);
  };
  auto contender = named(std::make_unique<PairClassifierDescriptor>(std::move(model), classifier));
  contender.distance = distance;
  return contender;
}

Contender color_histogram_contender() {
  return named(std::make_unique<image::ColorHistogramDescriptor>());
}

}  // namespace sdmt::tools

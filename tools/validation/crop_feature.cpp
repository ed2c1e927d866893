// SPDX-License-Identifier: Apache-2.0
#include "validation/crop_feature.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "sdmt/image/color_histogram.h"
#include "sdmt/media/image_file.h"
#include "sdmt/nn/l2_normalize.h"
#include "sdmt/nn/sequential.h"
#include "sdmt/train/pair_classifier.h"

namespace sdmt::tools {

namespace {

class EmbeddingFeature : public CropFeature {
 public:
  EmbeddingFeature(std::string name, reid::Model model)
      : name_(std::move(name)), embedder_(std::move(model)) {}

  std::string name() const override { return name_; }
  int dimensions() const override { return static_cast<int>(embedder_.dimension()); }
  void compute(std::span<const reid::Crop> crops, float* rows) override {
    embedder_.embed(crops, rows_);
    std::copy(rows_.values.begin(), rows_.values.end(), rows);
  }

 private:
  std::string name_;
  reid::Embedder embedder_;
  reid::EmbeddingRows rows_;
};

// Something made of the trunk's feature maps, a piece of the crops at a time.
class MapFeature : public CropFeature {
 public:
  explicit MapFeature(reid::Model model) : model_(std::move(model)) {}

  void compute(std::span<const reid::Crop> crops, float* rows) override {
    constexpr std::size_t kBatch = 32;
    const auto size = static_cast<std::size_t>(dimensions());
    for (std::size_t begin = 0; begin < crops.size(); begin += kBatch) {
      const auto piece = crops.subspan(begin, std::min(kBatch, crops.size() - begin));
      patches_.resize(model_.network.input_shape(static_cast<int>(piece.size())));
      for (std::size_t i = 0; i < piece.size(); ++i) {
        image::extract_patch(piece[i].image, piece[i].rect, model_.metadata.preprocessing,
                             patches_.image(static_cast<int>(i)));
      }
      const auto& result = of_maps(model_.network.trunk().forward(patches_, nn::Mode::inference));
      std::copy_n(result.data(), piece.size() * size, rows + begin * size);
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

class TrunkFeature : public MapFeature {
 public:
  using MapFeature::MapFeature;
  std::string name() const override { return "trunk features"; }
  int dimensions() const override { return static_cast<int>(map_shape().image_size()); }

 private:
  const nn::Tensor& of_maps(const nn::Tensor& maps) override {
    normalize_.forward(maps, rows_, nn::Mode::inference);
    return rows_;
  }

  nn::L2Normalize normalize_;
  nn::Tensor rows_;
};

class PairClassifierFeature : public MapFeature {
 public:
  PairClassifierFeature(reid::Model model, train::PairClassifier classifier)
      : MapFeature(std::move(model)), classifier_(std::move(classifier)) {}
  std::string name() const override { return "pair classifier"; }
  int dimensions() const override { return train::PairClassifier::kFeatures; }
  reid::PairDistance distance() const override {
    return [this](const float* a, const float* b) { return classifier_.distance(a, b); };
  }

 private:
  const nn::Tensor& of_maps(const nn::Tensor& maps) override {
    return classifier_.features_of_maps(maps);
  }

  train::PairClassifier classifier_;
};

class ColorHistogramFeature : public CropFeature {
 public:
  std::string name() const override { return "colour histogram"; }
  int dimensions() const override { return image::kColorHistogramSize; }
  void compute(std::span<const reid::Crop> crops, float* rows) override {
#pragma omp parallel for schedule(dynamic)
    for (std::size_t i = 0; i < crops.size(); ++i) {
      image::color_histogram(crops[i].image, crops[i].rect,
                             {rows + i * image::kColorHistogramSize, image::kColorHistogramSize});
    }
  }
};

// The images of consecutive crops, each decoded once (boxes of a frame follow each other).
class DecodedImages {
 public:
  explicit DecodedImages(std::span<const ValidationCrop> crops) {
    for (const auto& crop : crops) {
      if (paths_.empty() || paths_.back() != crop.image) paths_.push_back(crop.image);
      index_.push_back(paths_.size() - 1);
    }
    images_ = media::read_images(paths_);
  }

  // The box of crop i; nothing when its image cannot be read or shows too little of it.
  std::optional<reid::Crop> crop(std::size_t i, const ValidationCrop& crop) const {
    const auto& image = images_[index_[i]];
    if (!image) return std::nullopt;
    const image::ImageView view = image->view();
    const image::PixelRect whole{0, 0, static_cast<double>(view.width),
                                 static_cast<double>(view.height)};
    const image::PixelRect rect = crop.rect.value_or(whole);
    if (!image::visible_region(view.width, view.height, rect)) return std::nullopt;
    return reid::Crop{view, rect};
  }

 private:
  std::vector<std::filesystem::path> paths_;
  std::vector<std::size_t> index_;  // of each crop's image
  std::vector<std::optional<image::Image>> images_;
};

nn::Tensor first_rows(nn::Tensor all, std::size_t rows) {
  nn::Shape shape = all.shape();
  if (rows == static_cast<std::size_t>(shape.n)) return all;
  shape.n = static_cast<int>(rows);
  nn::Tensor first(shape);
  std::copy_n(all.data(), first.size(), first.data());
  return first;
}

}  // namespace

std::unique_ptr<CropFeature> embedding_feature(reid::Model model) {
  return std::make_unique<EmbeddingFeature>("embedding", std::move(model));
}

std::unique_ptr<CropFeature> untrained_head_feature(reid::Model model, std::uint64_t seed) {
  reid::EmbeddingNetwork untrained(model.network.description());
  untrained.initialize(seed);
  const auto& fresh = untrained.state();
  const auto& state = model.network.state();
  for (std::size_t i = 0; i < state.size(); ++i) {
    const bool in_head = state[i].layer >= model.network.description().first_of_head();
    if (in_head) *state[i].value = *fresh[i].value;
  }
  model.network.parameters_changed();
  return std::make_unique<EmbeddingFeature>("untrained head", std::move(model));
}

std::unique_ptr<CropFeature> trunk_feature(reid::Model model) {
  return std::make_unique<TrunkFeature>(std::move(model));
}

std::unique_ptr<CropFeature> pair_classifier_feature(const std::filesystem::path& file) {
  reid::Model model;
  auto classifier = train::load_pair_classifier(file, model);
  return std::make_unique<PairClassifierFeature>(std::move(model), std::move(classifier));
}

std::unique_ptr<CropFeature> color_histogram_feature() {
  return std::make_unique<ColorHistogramFeature>();
}

DescribedCrops describe_crops(const std::vector<ValidationCrop>& crops,
                              std::span<const std::unique_ptr<CropFeature>> features,
                              const std::function<void(std::int64_t)>& progress) {
  constexpr std::size_t kBatch = 120;
  DescribedCrops described;
  media::UnreadableImages unreadable(crops.size());
  for (const auto& feature : features) {
    described.features.emplace_back().embeddings.resize(
        {static_cast<int>(crops.size()), 1, 1, feature->dimensions()});
  }
  std::vector<reid::Crop> visible;
  progress(0);
  for (std::size_t begin = 0; begin < crops.size(); begin += kBatch) {
    const std::span batch(crops.data() + begin, std::min(kBatch, crops.size() - begin));
    const DecodedImages images(batch);
    const int row = static_cast<int>(described.crops.size());
    visible.clear();
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto crop = images.crop(i, batch[i]);
      if (!crop) {
        unreadable.add(batch[i].image);
        continue;
      }
      visible.push_back(*crop);
      described.crops.push_back(batch[i]);
    }
    if (!visible.empty()) {
      for (std::size_t f = 0; f < features.size(); ++f) {
        features[f]->compute(visible, described.features[f].embeddings.image(row));
      }
    }
    progress(static_cast<std::int64_t>(begin + batch.size()));
  }
  described.unreadable = unreadable.paths();
  for (auto& labelled : described.features) {
    for (const auto& crop : described.crops) {
      labelled.pids.push_back(crop.pid);
      labelled.camids.push_back(crop.camid);
    }
    labelled.embeddings = first_rows(std::move(labelled.embeddings), labelled.pids.size());
  }
  return described;
}

}  // namespace sdmt::tools

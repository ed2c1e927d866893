// SPDX-License-Identifier: Apache-2.0
#include "validation/described_crops.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

#include "sdmt/media/image_file.h"
#include "sdmt/reid/image_vectors.h"

namespace sdmt::tools {

namespace {

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
  std::optional<image::Crop> crop(std::size_t i, const ValidationCrop& crop) const {
    const auto& image = images_[index_[i]];
    if (!image) return std::nullopt;
    const image::ImageView view = image->view();
    const image::PixelRect whole{0, 0, static_cast<double>(view.width),
                                 static_cast<double>(view.height)};
    const image::PixelRect rect = crop.rect.value_or(whole);
    if (!image::visible_region(view.width, view.height, rect)) return std::nullopt;
    return image::Crop{view, rect};
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

nn::Tensor rows_of_files(const Contender& contender, const std::vector<ValidationCrop>& crops) {
  std::vector<std::filesystem::path> paths;
  std::vector<std::filesystem::path> roots;
  for (const ValidationCrop& crop : crops) {
    if (crop.rect) {
      throw std::invalid_argument(crop.root.string() + ": is a sequence, whose boxes " +
                                  contender.name +
                                  " has no vectors of; write the crops as images and give their "
                                  "folder");
    }
    paths.push_back(crop.image);
    roots.push_back(crop.root);
  }
  return reid::image_vectors(contender.files, paths, roots);
}

}  // namespace

DescribedCrops describe_crops(const std::vector<ValidationCrop>& crops,
                              std::span<const Contender> contenders,
                              const std::function<void(std::int64_t)>& progress) {
  constexpr std::size_t kBatch = 120;
  DescribedCrops described;
  media::UnreadableImages unreadable(crops.size());
  std::vector<nn::Tensor> from_files;
  for (const Contender& contender : contenders) {
    from_files.push_back(contender.descriptor ? nn::Tensor() : rows_of_files(contender, crops));
    described.rows.emplace_back().embeddings.resize(
        {static_cast<int>(crops.size()), 1, 1,
         contender.descriptor ? contender.descriptor->dimension() : from_files.back().shape().c});
  }
  std::vector<image::Crop> visible;
  image::DescriptorRows rows;
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
      for (std::size_t c = 0; c < contenders.size(); ++c) {
        if (contenders[c].descriptor) continue;
        nn::Tensor& rows_of = described.rows[c].embeddings;
        std::copy_n(from_files[c].image(static_cast<int>(begin + i)), rows_of.shape().c,
                    rows_of.image(static_cast<int>(described.crops.size())));
      }
      visible.push_back(*crop);
      described.crops.push_back(batch[i]);
    }
    if (!visible.empty()) {
      for (std::size_t c = 0; c < contenders.size(); ++c) {
        if (!contenders[c].descriptor) continue;
        contenders[c].descriptor->describe(visible, rows);
        std::copy(rows.values.begin(), rows.values.end(), described.rows[c].embeddings.image(row));
      }
    }
    progress(static_cast<std::int64_t>(begin + batch.size()));
  }
  described.unreadable = unreadable.paths();
  for (auto& labelled : described.rows) {
    for (const auto& crop : described.crops) {
      labelled.pids.push_back(crop.pid);
      labelled.camids.push_back(crop.camid);
    }
    labelled.embeddings = first_rows(std::move(labelled.embeddings), labelled.pids.size());
  }
  return described;
}

}  // namespace sdmt::tools

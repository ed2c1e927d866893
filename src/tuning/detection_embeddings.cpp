// SPDX-License-Identifier: Apache-2.0
#include "sdmt/tuning/detection_embeddings.h"

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

#include "sdmt/media/image_file.h"
#include "sdmt/track/pixel_rect.h"

namespace sdmt::tuning {

namespace {

void check(const TuningPlan& plan) {
  for (const TuningSetting& setting : plan.settings) {
    if (setting.options.boosting.enabled) {
      throw std::invalid_argument(
          "boosting is on, expected off: it looks at frames, and embeddings of boxes are stored "
          "instead");
    }
  }
  for (const TuningSequence& input : plan.sequences) {
    if (!input.sequence.has_images()) {
      throw std::invalid_argument(input.sequence.folder.string() +
                                  ": the sequence has no frames to see people on, expected some, "
                                  "or motion alone");
    }
  }
}

}  // namespace

void embed_detections(TuningPlan& plan, image::CropDescriptor& appearance,
                      const std::function<void(int frames)>& progress) {
  check(plan);
  const track::TrackerOptions& base = plan.settings.front().options;
  plan.tau_a = base.appearance.tau_a ? base.appearance.tau_a : appearance.tau_a();
  if (!plan.tau_a) {
    throw std::invalid_argument(appearance.name() +
                                " has no tau_a, expected one, or the option tau-a");
  }
  double least = base.input.strong_confidence;
  for (const TuningSetting& setting : plan.settings) {
    least = std::min(least, setting.options.input.strong_confidence);
  }
  int frames = 0;
  for (TuningSequence& input : plan.sequences) {
    if (input.detections.dimension() > 0) continue;
    const track::InputOptions options = input.adjusted(base).input;
    std::vector<mot::DetectionRow> rows;
    std::vector<std::size_t> looked_at;
    std::vector<image::Crop> crops;
    image::DescriptorRows vectors;
    for (int frame = 1; frame <= input.gt.num_frames; ++frame, progress(++frames)) {
      const auto image = media::read_image(input.sequence.image(frame));
      const image::ImageView view = image.view();
      crops.clear();
      looked_at.clear();
      for (const mot::Detection& box : input.detections.frame(frame)) {
        rows.push_back({frame, box, std::vector<float>(appearance.dimension(), 0.0F)});
        if (options.probability(box.score) < least) continue;
        looked_at.push_back(rows.size() - 1);
        crops.push_back({view, track::to_pixel_rect(box.box)});
      }
      appearance.describe(crops, vectors);
      for (std::size_t i = 0; i < crops.size(); ++i) {
        const auto vector = vectors.row(i);
        rows[looked_at[i]].embedding.assign(vector.begin(), vector.end());
      }
    }
    input.detections = mot::DetectionFile::from_rows(std::move(rows), input.gt.name);
  }
}

}  // namespace sdmt::tuning

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/embedder.h"

#include <algorithm>
#include <limits>

#include "guard.h"
#include "handles.h"
#include "sdmt/track/pixel_rect.h"

using namespace sdmt;

struct sdmt_embedder {
  reid::Embedder embedder;
  image::DescriptorRows rows;
};

sdmt_model* sdmt_model_load(const char* path, sdmt_error* error) {
  return c::guarded_new(error, [&] {
    // An embedder gives up what only training needs.
    return new sdmt_model{reid::Embedder(reid::load_model(&c::given(path, "path"))).model()};
  });
}
void sdmt_model_free(sdmt_model* model) { delete model; }
int sdmt_model_dimension(const sdmt_model* model) {
  return model != nullptr ? model->model->network.embedding_size() : 0;
}
double sdmt_model_tau_a(const sdmt_model* model) {
  const bool known = model != nullptr && model->model->metadata.tau_a;
  return known ? model->model->metadata.tau_a->value : std::numeric_limits<double>::quiet_NaN();
}

sdmt_embedder* sdmt_embedder_new(const sdmt_model* model, sdmt_error* error) {
  return c::guarded_new(error, [&] {
    return new sdmt_embedder{reid::Embedder(c::given(model, "model").model), {}};
  });
}
void sdmt_embedder_free(sdmt_embedder* embedder) { delete embedder; }

sdmt_status sdmt_embedder_describe(sdmt_embedder* embedder, const sdmt_image* image,
                                   const sdmt_box* boxes, size_t count, float* vectors,
                                   uint8_t* valid, sdmt_error* error) {
  return c::guarded(error, [&] {
    c::given(embedder, "embedder");
    const image::ImageView view = c::to_view(c::given(image, "image"));
    if (count == 0) return;
    c::given(boxes, "boxes"), c::given(vectors, "vectors"), c::given(valid, "valid");
    std::vector<image::Crop> crops;
    crops.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      crops.push_back({view, track::to_pixel_rect(c::to_tlwh(boxes[i]))});
    }
    embedder->embedder.describe(crops, embedder->rows);
    std::copy(embedder->rows.values.begin(), embedder->rows.values.end(), vectors);
    std::copy(embedder->rows.valid.begin(), embedder->rows.valid.end(), valid);
  });
}

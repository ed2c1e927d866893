// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <malloc.h>

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "reid/formula_network.h"
#include "sdmt/reid/architectures.h"
#include "sdmt/reid/embedder.h"
#include "sdmt/reid/shared_embedder.h"

namespace sdmt::reid {
namespace {

using testing_support::FormulaCrop;

constexpr int kCameras = 8;

// What camera i sees: windows of one picture, and a crop of another size.
std::vector<float> look(image::CropDescriptor& embedder, int i) {
  const FormulaCrop picture(5), crop(i);
  image::DescriptorRows shifted, rows;
  const std::vector<image::GridShift> shifts{{0, 0}, {i % 2, 1}};
  embedder.describe_shifted(picture.view(), {10, 8, 32, 96}, shifts, shifted);
  embedder.describe(std::vector{image::Crop{crop.view(), crop.rect()}}, rows);
  rows.values.insert(rows.values.end(), shifted.values.begin(), shifted.values.end());
  return rows.values;
}

// lite folds normalisations into its weights and has Winograd's for several sizes of map; all are
// made when first needed, here by whichever thread comes first.
TEST(SharedModel, EmbeddersInSeveralThreadsGiveWhatOneAloneGives) {
  std::vector<std::vector<float>> expected;
  Embedder alone(untrained_model(lite(), 5));
  for (int i = 0; i < kCameras; ++i) expected.push_back(look(alone, i));

  std::vector<std::vector<float>> seen(kCameras);
  {
    const auto model = Embedder(untrained_model(lite(), 5)).model();
    std::vector<std::thread> cameras;
    for (int i = 0; i < kCameras; ++i) {
      cameras.emplace_back([&, i] {
        Embedder embedder(model);
        seen[i] = look(embedder, i);
      });
    }
    for (std::thread& camera : cameras) camera.join();
  }
  for (int i = 0; i < kCameras; ++i) EXPECT_EQ(seen[i], expected[i]) << i;
}

TEST(SharedModel, AnotherEmbedderTakesNoOtherWeights) {
  const auto used = [] {
    const struct mallinfo2 memory = mallinfo2();  // zeros under a sanitizer
    return memory.uordblks + memory.hblkhd;
  };
  const std::size_t before = used();
  Embedder first(untrained_model(vgg16(), 5));
  const FormulaCrop crop(1);
  const std::vector crops{image::Crop{crop.view(), crop.rect()}};
  image::DescriptorRows rows, others;
  first.describe(crops, rows);
  const std::size_t with_one = used();
  Embedder second(first.model());
  second.describe(crops, others);
  EXPECT_EQ(others.values, rows.values);
  // Of the second's own: what lies between the layers.
  EXPECT_LE(used() - with_one, (with_one - before) / 4);
}

TEST(SharedModel, NoModelIsAnError) {
  EXPECT_THROW(Embedder{std::shared_ptr<const Model>()}, std::invalid_argument);
}

TEST(SharedEmbedder, ClientsInSeveralThreadsGiveWhatOneAloneGives) {
  Embedder alone(untrained_model(lite(), 5));
  SharedEmbedder shared(alone.model(), 2);
  std::vector<std::vector<std::vector<float>>> seen(kCameras);
  {
    std::vector<std::thread> cameras;
    for (int i = 0; i < kCameras; ++i) {
      cameras.emplace_back([&, i] {
        const auto client = shared.client();
        for (int round = 0; round < 5; ++round) seen[i].push_back(look(*client, i));
      });
    }
    for (std::thread& camera : cameras) camera.join();
  }
  for (int i = 0; i < kCameras; ++i) {
    const auto expected = look(alone, i);
    for (const auto& rows : seen[i]) EXPECT_EQ(rows, expected) << i;
  }
}

TEST(SharedEmbedder, AnErrorIsItsClientsAlone) {
  Embedder alone(untrained_model(lite(), 5));
  SharedEmbedder shared(alone.model(), 2);
  std::vector<int> errors(kCameras, 0);
  std::vector<std::vector<float>> seen(kCameras);
  {
    std::vector<std::thread> cameras;
    for (int i = 0; i < kCameras; ++i) {
      cameras.emplace_back([&, i] {
        const auto client = shared.client();
        const FormulaCrop picture(5);
        image::DescriptorRows rows;
        for (int round = 0; round < 5; ++round) {
          seen[i] = look(*client, i);
          if (i % 2 == 0) continue;
          try {  // a window that leaves the image
            client->describe_shifted(picture.view(), {10, 8, 32, 96},
                                     std::vector{image::GridShift{99, 0}}, rows);
          } catch (const std::invalid_argument&) {
            ++errors[i];
          }
        }
      });
    }
    for (std::thread& camera : cameras) camera.join();
  }
  for (int i = 0; i < kCameras; ++i) {
    EXPECT_EQ(errors[i], i % 2 == 0 ? 0 : 5) << i;
    EXPECT_EQ(seen[i], look(alone, i)) << i;
  }
}

}  // namespace
}  // namespace sdmt::reid

// SPDX-License-Identifier: Apache-2.0
// The whole network against PyTorch, layer by layer; the fixtures are made by
// tests/parity/make_network.py.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "nn/every_target.h"
#include "reid/formula_network.h"
#include "sdmt/nn/sequential.h"
#include "sdmt/reid/embedder.h"

namespace sdmt::reid {
namespace {

using testing_support::FormulaCrop;
using testing_support::kFormulaCrops;
namespace fs = std::filesystem;

constexpr int kDimension = 128;  // of vgg16's embeddings
const fs::path kFixtures = fs::path(SDMT_TESTS_DIR) / "reid/fixtures";

std::vector<double> numbers(const io::Safetensors& file, const std::string& name) {
  const auto& entry = file.at(name);
  if (entry.dtype == io::DType::i64) {
    const auto integers = file.read_integers(name);
    return {integers.begin(), integers.end()};
  }
  std::vector<float> values(entry.count());
  file.read_floats(entry, values);
  return {values.begin(), values.end()};
}

// Compares an activation with what PyTorch made of it: sampled values within `tolerance` of the
// layer's largest, and the sum over each picture, where errors that average out would be seen.
void expect_layer(const io::Safetensors& fixture, const std::string& name, const nn::Tensor& ours,
                  double tolerance) {
  const nn::Shape& shape = ours.shape();
  const double largest = numbers(fixture, name + ".largest").front();
  const auto positions = fixture.read_integers(name + ".positions");
  const auto values = numbers(fixture, name + ".values");
  double worst = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    // The position counts in NCHW.
    const auto h = static_cast<std::uint64_t>(shape.h);
    const auto w = static_cast<std::uint64_t>(shape.w);
    const auto c = static_cast<std::uint64_t>(shape.c);
    const std::uint64_t x = positions[i] % w;
    const std::uint64_t y = positions[i] / w % h;
    const std::uint64_t channel = positions[i] / (w * h) % c;
    const std::uint64_t n = positions[i] / (w * h * c);
    ASSERT_LT(n, static_cast<std::uint64_t>(shape.n)) << name;
    const double value = ours.data()[((n * h + y) * w + x) * c + channel];
    worst = std::max(worst, std::abs(value - values[i]));
  }
  EXPECT_LT(worst, tolerance * largest) << name;
  const auto sums = numbers(fixture, name + ".sums");
  ASSERT_EQ(sums.size(), static_cast<std::size_t>(shape.n)) << name;
  for (int n = 0; n < shape.n; ++n) {
    double sum = 0;
    double magnitude = 0;
    for (std::size_t i = 0; i < shape.image_size(); ++i) {
      sum += ours.image(n)[i];
      magnitude += std::abs(ours.image(n)[i]);
    }
    EXPECT_NEAR(sum, sums[static_cast<std::size_t>(n)], tolerance * magnitude)
        << name << " of " << n;
  }
}

class NetworkParity : public nn::EveryTarget {
 protected:
  // The model passes through a file, so that loading is part of what is compared.
  static void SetUpTestSuite() {
    path_ =
        fs::path(testing::TempDir()) / ("formula-" + std::to_string(::getpid()) + ".safetensors");
    testing_support::write_formula_model(path_);
  }
  static void TearDownTestSuite() { fs::remove(path_); }

  void SetUp() override {
    nn::EveryTarget::SetUp();
    model_ = load_model(path_);
    patches_.resize(model_.network.input_shape(kFormulaCrops));
    for (int i = 0; i < kFormulaCrops; ++i) {
      const FormulaCrop crop(i);
      ASSERT_TRUE(image::extract_patch(crop.view(), crop.rect(), {}, patches_.image(i)));
    }
  }

  static void expect_embeddings(const float* ours) {
    const auto theirs = numbers(io::Safetensors(kFixtures / "network.safetensors"), "embeddings");
    ASSERT_EQ(theirs.size(), static_cast<std::size_t>(kFormulaCrops * kDimension));
    double worst = 0;
    for (std::size_t i = 0; i < theirs.size(); ++i) {
      worst = std::max(worst, std::abs(ours[i] - theirs[i]));
    }
    EXPECT_LT(worst, 1e-5);
    RecordProperty("worst_difference", std::to_string(worst));
  }

  static fs::path path_;
  Model model_;
  nn::Tensor patches_;
};

fs::path NetworkParity::path_;
SDMT_INSTANTIATE_EVERY_TARGET(NetworkParity);

// Any rectangle of a picture is stretched to the very pixels that OpenCV makes of it.
TEST(PatchParity, PixelsAreThoseOfOpenCv) {
  const io::Safetensors fixture(kFixtures / "network.safetensors");
  const auto rects = fixture.read_integers("patches.rects");
  const auto checksums = fixture.read_integers("patches.checksums");
  const FormulaCrop picture(kFormulaCrops - 1);
  const image::Preprocessing p;
  std::vector<float> patch(static_cast<std::size_t>(p.height * p.width * 3));
  const auto weights = testing_support::hashed(patch.size(), 401);
  ASSERT_GE(checksums.size(), 100U);
  for (std::size_t r = 0; r < checksums.size(); ++r) {
    const auto side = [&](std::size_t i) { return static_cast<double>(rects[r * 4 + i]); };
    ASSERT_TRUE(image::extract_patch(picture.view(), {side(0), side(1), side(2), side(3)}, p,
                                     patch.data()));
    std::uint64_t checksum = 0;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      const float pixel = (patch[i] * p.std[i % 3] + p.mean[i % 3]) * 255.0F;
      ASSERT_NEAR(pixel, std::round(pixel), 1e-3);
      checksum += static_cast<std::uint64_t>(std::lround(pixel)) *
                  static_cast<std::uint64_t>(weights[i] * 0x1p24F);
    }
    EXPECT_EQ(checksum, checksums[r]) << side(2) << " x " << side(3);
  }
}

TEST_P(NetworkParity, LayerByLayer) {
  const io::Safetensors fixture(kFixtures / "network.safetensors");
  expect_layer(fixture, "input", patches_, 1e-6);
  const nn::Tensor* x = &patches_;
  nn::Tensor buffers[2];
  int next = 0;
  int compared = 0;
  for (nn::Sequential* part : {&model_.network.trunk(), &model_.network.head()}) {
    for (int i = 0; i < part->size(); ++i) {
      nn::Tensor& y = buffers[next];
      // The trunk has nothing that training does otherwise, but for the smaller Winograd tiles,
      // whose rounding is less.
      const bool trunk = part == &model_.network.trunk();
      part->layer(i).forward(*x, y, trunk ? nn::Mode::training : nn::Mode::inference);
      if (fixture.find(part->name(i) + ".values") != nullptr) {
        expect_layer(fixture, part->name(i), y, 1e-5);
        ++compared;
      }
      x = &y;
      next = 1 - next;
    }
  }
  EXPECT_EQ(compared, 7 + 2 + 3);  // convolutions, poolings, fc1, fc2, bn
  expect_embeddings(x->data());
}

TEST_P(NetworkParity, FusedForwardPass) {
  const nn::Tensor& features = model_.network.trunk().forward(patches_, nn::Mode::inference);
  EXPECT_EQ(features.shape(), (nn::Shape{kFormulaCrops, 32, 16, 256}));
  expect_layer(io::Safetensors(kFixtures / "network.safetensors"), "features", features, 4e-5);
  expect_embeddings(model_.network.forward(patches_, nn::Mode::inference).data());
}

TEST_P(NetworkParity, Embedder) {
  std::vector<FormulaCrop> pictures;
  std::vector<image::Crop> crops;
  for (int i = 0; i < kFormulaCrops; ++i) pictures.emplace_back(i);
  for (const FormulaCrop& picture : pictures) crops.push_back({picture.view(), picture.rect()});
  // One that shows nothing, in the middle: its neighbours must keep their rows.
  crops.insert(crops.begin() + 5, image::Crop{pictures[0].view(), {-100, 0, 50, 50}});
  image::DescriptorRows rows;
  Embedder embedder(std::move(model_), {.max_batch = 7});
  embedder.describe(crops, rows);
  ASSERT_EQ(rows.valid.size(), crops.size());
  EXPECT_EQ(rows.valid[5], 0);
  EXPECT_EQ(std::count(rows.valid.begin(), rows.valid.end(), 1), kFormulaCrops);
  const auto bad = rows.values.begin() + 5 * kDimension;
  EXPECT_TRUE(std::all_of(bad, bad + kDimension, [](float v) { return v == 0; }));
  rows.values.erase(bad, bad + kDimension);
  expect_embeddings(rows.values.data());

  // A row does not depend on its company.
  image::DescriptorRows alone;
  embedder.describe(std::span(crops).subspan(3, 1), alone);
  for (std::size_t i = 0; i < kDimension; ++i) {
    EXPECT_NEAR(alone.values[i], rows.values[3 * kDimension + i], 1e-6);
  }
  embedder.describe(std::span<const image::Crop>(), alone);
  EXPECT_TRUE(alone.values.empty());
}

using TrunkParity = nn::EveryTarget;
SDMT_INSTANTIATE_EVERY_TARGET(TrunkParity);

TEST_P(TrunkParity, RealVgg16Features) {
  const fs::path file = fs::path(SDMT_DATA_DIR) / "vgg16/vgg16-conv1_1-conv3_3.safetensors";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is not there";
  EmbeddingNetwork network;
  EXPECT_TRUE(load_trunk(file, network).empty());
  const FormulaCrop crop(0);
  nn::Tensor patch(network.input_shape(1));
  ASSERT_TRUE(image::extract_patch(crop.view(), crop.rect(), {}, patch.data()));
  expect_layer(io::Safetensors(kFixtures / "vgg16_conv3_3.safetensors"), "features",
               network.trunk().forward(patch, nn::Mode::inference), 4e-5);
}

// A network that only its file describes: strides, kernels, biases and normalisations of every
// kind, weights and names as PyTorch's state_dict has them
// (tests/parity/make_described_network.py).
using DescribedNetwork = nn::EveryTarget;
SDMT_INSTANTIATE_EVERY_TARGET(DescribedNetwork);

TEST_P(DescribedNetwork, EmbedsAsPyTorch) {
  const io::Safetensors file(kFixtures / "described_network.safetensors");
  Model model = read_model(file);
  EXPECT_EQ(model.network.description().layers.size(), 17u);
  EXPECT_EQ(model.network.embedding_size(), 10);
  nn::Tensor patches(model.network.input_shape(5));
  file.read_floats(file.at("test.patches"), patches.values());
  const auto expected = numbers(file, "test.embeddings");
  const nn::Tensor& embeddings = model.network.forward(patches, nn::Mode::inference);
  ASSERT_EQ(embeddings.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(embeddings.data()[i], expected[i], 1e-5) << i;
  }
}

// Finite weights whose results overflow, and weights that make nothing: never a row of NaN or
// zeros.
TEST(Embedder, EmbeddingsThatAreNoUnitVectorsAreAnError) {
  for (const float gamma : {1e30F, 0.0F}) {
    Model model = read_model(io::Safetensors(kFixtures / "described_network.safetensors"));
    for (const StoredTensor& tensor : stored_tensors(model.network)) {
      if (tensor.name == "bn.weight" || tensor.name == "bn3.weight") tensor.value->fill(gamma);
      if (tensor.name == "bn.bias") tensor.value->fill(0);
    }
    model.network.parameters_changed();
    Embedder embedder(std::move(model));
    const FormulaCrop crop(1);
    image::DescriptorRows rows;
    try {
      embedder.describe(std::vector{image::Crop{crop.view(), crop.rect()}}, rows);
      FAIL() << gamma;
    } catch (const std::runtime_error& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find("described_network.safetensors: the network makes an embedding of "
                          "length "),
                std::string::npos)
          << text;
    }
  }
}

}  // namespace
}  // namespace sdmt::reid

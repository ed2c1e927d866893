// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/model_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdmt/nn/random.h"
#include "sdmt/nn/sequential.h"

namespace sdmt::reid {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

fs::path temporary(const std::string& name) {
  return fs::path(testing::TempDir()) / ("model-" + std::to_string(::getpid()) + name);
}

std::string content(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string message(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

// The architecture on small pictures: 2 x 3 positions of conv3_3.
Model small_model(std::uint64_t seed) {
  Model model = untrained_model(vgg16(8, 12), seed);
  nn::Random random(seed, 99);
  for (const auto& tensor : stored_tensors(model.network)) {
    if (tensor.file_shape.size() > 1) continue;
    for (float& value : tensor.value->values()) {
      value = static_cast<float>(random.uniform(0.1, 1.0));
    }
  }
  return model;
}

// Largest difference between the values of a tensor in two models, relative to the largest value.
double difference(const Model& a, const Model& b, const std::string& name) {
  const auto& tensors = stored_tensors(a.network);
  for (std::size_t t = 0; t < tensors.size(); ++t) {
    if (tensors[t].name != name) continue;
    const auto& x = *tensors[t].value;
    const auto& y = *stored_tensors(b.network)[t].value;
    double worst = 0;
    double largest = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      worst = std::max<double>(worst, std::abs(x.data()[i] - y.data()[i]));
      largest = std::max<double>(largest, std::abs(x.data()[i]));
    }
    return worst / largest;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

TEST(ModelFile, HasTorchvisionsNamesAndShapes) {
  const fs::path path = temporary("names");
  save_model(path, small_model(1));
  const io::Safetensors file(path);
  std::vector<std::string> shown;
  for (const auto& entry : file.tensors()) shown.push_back(entry.name + entry.shape_str());
  EXPECT_THAT(shown, ElementsAre("features.0.weight[64,3,3,3]", "features.0.bias[64]",
                                 "features.2.weight[64,64,3,3]", "features.2.bias[64]",
                                 "features.5.weight[128,64,3,3]", "features.5.bias[128]",
                                 "features.7.weight[128,128,3,3]", "features.7.bias[128]",
                                 "features.10.weight[256,128,3,3]", "features.10.bias[256]",
                                 "features.12.weight[256,256,3,3]", "features.12.bias[256]",
                                 "features.14.weight[256,256,3,3]", "features.14.bias[256]",
                                 "head.fc1.weight[128,1536]", "head.fc1.bias[128]",
                                 "head.fc2.weight[128,128]", "head.fc2.bias[128]",
                                 "head.bn.weight[128]", "head.bn.bias[128]",
                                 "head.bn.running_mean[128]", "head.bn.running_var[128]"));
}

TEST(ModelFile, KeepsPyTorchsOrder) {
  Model model = small_model(2);
  const fs::path path = temporary("order");
  save_model(path, model);
  const io::Safetensors file(path);
  std::vector<float> conv(64 * 3 * 9);
  file.read_floats(file.at("features.0.weight"), conv);
  std::vector<float> fc1(128 * 1536);
  file.read_floats(file.at("head.fc1.weight"), fc1);
  for (const auto& tensor : stored_tensors(model.network)) {
    const float* value = tensor.value->data();
    if (tensor.name == "features.0.weight") {
      for (std::size_t o = 0; o < 64; ++o)
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t k = 0; k < 9; ++k)
            ASSERT_EQ(conv[(o * 3 + i) * 9 + k], value[(o * 9 + k) * 3 + i]);
    } else if (tensor.name == "head.fc1.weight") {
      for (std::size_t o = 0; o < 128; ++o)
        for (std::size_t c = 0; c < 256; ++c)
          for (std::size_t p = 0; p < 6; ++p)
            ASSERT_EQ(fc1[(o * 256 + c) * 6 + p], value[(o * 6 + p) * 256 + c]);
    }
  }
}

TEST(ModelFile, RoundTripsBitForBitInFloat32) {
  Model model = small_model(3);
  model.metadata.tau_a = AffinityThreshold{0.86, "fpr", 0.01};
  const fs::path path = temporary("f32");
  save_model(path, model);
  const Model read = load_model(path);
  for (const auto& tensor : stored_tensors(model.network)) {
    EXPECT_EQ(difference(model, read, tensor.name), 0.0) << tensor.name;
  }
  EXPECT_EQ(to_json(read.metadata), to_json(model.metadata));
  const fs::path again = temporary("f32-again");
  save_model(again, read);
  EXPECT_EQ(content(again), content(path));
}

TEST(ModelFile, SmallerStoragesRoundWithinTheirPrecision) {
  Model model = small_model(4);
  nn::Tensor patches(model.network.input_shape(3));
  nn::Random random(1);
  for (float& value : patches.values()) value = static_cast<float>(random.normal());
  const nn::Tensor expected = model.network.forward(patches, nn::Mode::inference);
  const auto check = [&](Storage storage, double weight_error, double embedding_error,
                         double megabytes) {
    const fs::path path = temporary("small");
    save_model(path, model, storage);
    EXPECT_LT(static_cast<double>(fs::file_size(path)) / 1e6, megabytes);
    Model read = load_model(path);
    for (const auto& tensor : stored_tensors(model.network)) {
      const bool weight = tensor.file_shape.size() > 1;
      EXPECT_LE(difference(model, read, tensor.name), weight ? weight_error : 0.0) << tensor.name;
      if (weight) {
        EXPECT_GT(difference(model, read, tensor.name), 0.0) << tensor.name;
      }
    }
    const nn::Tensor& rows = read.network.forward(patches, nn::Mode::inference);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      ASSERT_NEAR(rows.data()[i], expected.data()[i], embedding_error);
    }
    // What was rounded once is not rounded again.
    const fs::path again = temporary("small-again");
    save_model(again, read, storage);
    Model twice = load_model(again);
    for (const auto& tensor : stored_tensors(model.network)) {
      EXPECT_LE(difference(read, twice, tensor.name), 1e-7) << tensor.name;
    }
  };
  check(Storage::float16, std::ldexp(1.0, -11), 1e-3, 4.0);
  check(Storage::int8, 0.5 / 127 * 1.0001, 2e-2, 2.1);
}

TEST(ModelFile, ChannelOfZerosSurvivesInt8) {
  Model model = small_model(5);
  auto& conv = *stored_tensors(model.network).front().value;
  std::fill_n(conv.data(), 27, 0.0F);
  const fs::path path = temporary("zeros");
  save_model(path, model, Storage::int8);
  const Model read = load_model(path);
  EXPECT_EQ(stored_tensors(read.network).front().value->data()[5], 0.0F);
}

TEST(ModelFile, RewritingMetadataKeepsTheTensors) {
  Model model = small_model(6);
  const fs::path path = temporary("rewrite");
  save_model(path, model, Storage::int8);
  const std::string before = content(path);
  model.metadata.tau_a = AffinityThreshold{0.875, "accuracy", std::nullopt};
  rewrite_metadata(path, model.metadata);
  const Model read = load_model(path);
  ASSERT_TRUE(read.metadata.tau_a.has_value());
  EXPECT_EQ(read.metadata.tau_a->value, 0.875);
  const std::string after = content(path);
  EXPECT_NE(after, before);
  model.metadata.tau_a.reset();
  rewrite_metadata(path, model.metadata);
  EXPECT_EQ(content(path), before);
}

TEST(ModelFile, CheckpointsCanBeReadAsModels) {
  const Model model = small_model(7);
  const std::vector<std::uint64_t> state{1, 2, 3, 4};
  io::SafetensorsWriter writer;
  add_model(writer, model, Storage::float32);
  writer.add("trainer.random", {4}, state);
  const fs::path path = temporary("checkpoint");
  writer.write(path);
  EXPECT_EQ(difference(model, load_model(path), "head.fc1.weight"), 0.0);
}

// Writes a model file whose tensors were changed by `change`, and returns why it is refused.
struct EditedEntry : io::SafetensorsEntry {
  std::vector<std::byte> content;
  std::span<const std::byte> bytes;
};
std::string refusal(const std::function<void(EditedEntry&)>& change,
                    Storage storage = Storage::float32) {
  const fs::path good = temporary("good");
  const fs::path bad = temporary("bad");
  save_model(good, small_model(8), storage);
  {
    const io::Safetensors file(good);
    io::SafetensorsWriter writer;
    for (const auto& [key, text] : file.metadata()) writer.set_metadata(key, text);
    std::vector<EditedEntry> entries;
    for (const io::SafetensorsEntry& stored : file.tensors()) {
      EditedEntry& entry = entries.emplace_back(EditedEntry{stored, {}, {}});
      entry.content.resize(stored.size);
      file.read_bytes(stored, entry.content);
      entry.bytes = entry.content;
      change(entry);
      if (!entry.name.empty()) writer.add_bytes(entry.name, entry.dtype, entry.shape, entry.bytes);
    }
    writer.write(bad);
  }
  std::string text = message([&] { load_model(bad); });
  const std::string prefix = bad.string() + ": ";
  if (text.starts_with(prefix)) text.erase(0, prefix.size());
  return text;
}

TEST(ModelFile, RefusalsNameTheTensor) {
  EXPECT_EQ(refusal([](auto&) {}), "accepted");
  EXPECT_EQ(refusal([](auto& e) {
              if (e.name == "features.7.bias") e.name = "";
            }),
            "tensor features.7.bias is missing; the file has features.0.weight, features.0.bias, "
            "features.2.weight, ...");
  EXPECT_EQ(refusal([](auto& e) {
              if (e.name == "head.fc1.weight") e.shape = {1536, 128};
            }),
            "tensor head.fc1.weight has shape [1536,128], expected [128,1536]");
  EXPECT_EQ(refusal([](auto& e) {
              if (e.name == "features.2.weight") e.dtype = io::DType::i32;
            }),
            "tensor features.2.weight has dtype I32, expected F32, F16, BF16, F64 or I8");
  const std::vector<std::int8_t> bytes(64);
  EXPECT_EQ(refusal([&](auto& e) {
              if (e.name != "features.2.bias") return;
              e.dtype = io::DType::i8;
              e.bytes = std::as_bytes(std::span(bytes));
            }),
            "tensor features.2.bias has dtype I8, expected F32, F16, BF16, F64");
  const std::vector<float> nan(64, std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(refusal([&](auto& e) {
              if (e.name == "features.2.bias") e.bytes = std::as_bytes(std::span(nan));
            }),
            "tensor features.2.bias holds a value that is not finite");
  EXPECT_EQ(refusal(
                [](auto& e) {
                  if (e.name == "features.5.weight.scale") e.name = "";
                },
                Storage::int8),
            "tensor features.5.weight.scale is missing; the file has "
            "features.0.weight.scale, features.0.bias, features.2.weight.scale, ...");
  const std::vector<float> negative(128, -1.0F);
  EXPECT_EQ(refusal([&](auto& e) {
              if (e.name == "head.bn.running_var") e.bytes = std::as_bytes(std::span(negative));
            }),
            "tensor head.bn.running_var holds -1.000000, expected >= 0");
}

TEST(ModelFile, ForeignNamesAreRecognised) {
  for (const std::string prefix : {"module.", "vgg.net."}) {
    EXPECT_EQ(refusal([&](auto& e) { e.name = prefix + e.name; }),
              "tensor features.0.weight is missing; the file has " + prefix +
                  "features.0.weight, " + prefix + "features.0.bias, " + prefix +
                  "features.2.weight, ...; take the prefix \"" + prefix + "\" off its names");
  }
}

TEST(ModelFile, RefusesFilesOfAnotherKind) {
  const fs::path path = temporary("plain");
  const std::vector<float> one(1);
  io::SafetensorsWriter plain;
  plain.add("x", {1}, one);
  plain.write(path);
  EXPECT_EQ(message([&] { load_model(path); }),
            path.string() + ": has no metadata \"sdmt\", expected a model written by sdmt");
  // A size the file has no weights for: refused before that much memory is asked for.
  ModelMetadata metadata;
  metadata.preprocessing.height = 4096;
  metadata.preprocessing.width = 4096;
  plain.set_metadata(kModelMetadataKey, to_json(metadata));
  plain.write(path);
  EXPECT_EQ(message([&] { load_model(path); }),
            path.string() +
                ": network vgg16-conv3_3-fc128-fc128: layer conv1_1 (Conv2d) makes a map of 4096 x "
                "4096 x 64, expected at most 2^24 values");
  metadata.preprocessing.height = 512;
  metadata.preprocessing.width = 512;
  plain.set_metadata(kModelMetadataKey, to_json(metadata));
  plain.write(path);
  EXPECT_EQ(message([&] { load_model(path); }),
            path.string() + ": tensor features.0.weight is missing; the file has x");
  metadata.preprocessing.width = 63;
  plain.set_metadata(kModelMetadataKey, to_json(metadata));
  plain.write(path);
  EXPECT_EQ(message([&] { load_model(path); }),
            path.string() +
                ": network vgg16-conv3_3-fc128-fc128: layer pool1 (MaxPool2d) gets a map of 512 x "
                "63 x 64, expected an even height and width");
}

TEST(ModelFile, DoesNotSaveWhatItCouldNotLoad) {
  const fs::path path = temporary("unsaved");
  fs::remove(path);
  Model model = small_model(9);
  stored_tensors(model.network)[2].value->data()[0] = 1e6F;
  save_model(path, model);
  fs::remove(path);
  EXPECT_EQ(message([&] { save_model(path, model, Storage::float16); }),
            "tensor features.2.weight holds 1000000.000000, which the file cannot store");
  stored_tensors(model.network)[1].value->data()[0] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(message([&] { save_model(path, model); }),
            "tensor features.0.bias holds inf, which the file cannot store");
  model = small_model(9);
  model.metadata.margin = -1;
  EXPECT_EQ(message([&] { save_model(path, model); }),
            "metadata margin is -1.000000, expected > 0");
  EXPECT_FALSE(fs::exists(path));
}

TEST(LoadTrunk, TakesTheTrunkOutOfAWholeVgg16) {
  const fs::path path = temporary("trunk");
  const Model source = small_model(10);
  io::SafetensorsWriter writer;
  add_model(writer, source, Storage::float16);
  const std::vector<float> other(512);
  writer.add("features.17.bias", {512}, other);
  writer.add("classifier.6.bias", {512}, other);
  writer.write(path);

  Model target = small_model(11);
  const Model before = small_model(11);
  EXPECT_THAT(load_trunk(path, target.network),
              testing::IsSupersetOf({"features.17.bias", "classifier.6.bias", "head.fc1.weight"}));
  EXPECT_LT(difference(source, target, "features.14.weight"), 5e-4);
  EXPECT_EQ(difference(source, target, "features.14.bias"), 0.0);
  EXPECT_EQ(difference(before, target, "head.fc1.weight"), 0.0);
}

TEST(LoadTrunk, RefusesAnotherNetworkAndChangesNothing) {
  const fs::path path = temporary("other");
  const std::vector<float> values(64 * 3 * 7 * 7);
  io::SafetensorsWriter writer;
  writer.add("features.0.weight", {64, 3, 7, 7}, values);
  writer.write(path);
  Model target = small_model(12);
  EXPECT_EQ(message([&] { load_trunk(path, target.network); }),
            path.string() + ": tensor features.0.weight has shape [64,3,7,7], expected [64,3,3,3]");
  const Model whole = small_model(13);
  io::SafetensorsWriter partial;
  for (const auto& tensor : stored_tensors(whole.network)) {
    if (tensor.name.starts_with("features.12.")) continue;
    partial.add(tensor.name, tensor.file_shape, tensor.value->values());
  }
  partial.write(path);
  EXPECT_EQ(message([&] { load_trunk(path, target.network); }),
            path.string() +
                ": tensor features.12.weight is missing; the file has features.0.weight, "
                "features.0.bias, features.2.weight, ...");
  for (const auto& tensor : stored_tensors(target.network)) {
    EXPECT_EQ(difference(target, small_model(12), tensor.name), 0.0) << tensor.name;
  }
}

TEST(EmbeddingNetwork, InitialisesAsHeAndRepeats) {
  EmbeddingNetwork a(vgg16(8, 12));
  EmbeddingNetwork b(vgg16(8, 12));
  a.initialize(5);
  b.initialize(5);
  for (std::size_t t = 0; t < stored_tensors(a).size(); ++t) {
    const auto& tensor = stored_tensors(a)[t];
    const auto values = tensor.value->values();
    EXPECT_TRUE(
        std::equal(values.begin(), values.end(), stored_tensors(b)[t].value->values().begin()))
        << tensor.name;
    if (tensor.file_shape.size() < 2) continue;
    double square = 0;
    for (const float value : values) square += value * value;
    const double inputs = static_cast<double>(tensor.value->shape().image_size());
    const double variance = square / static_cast<double>(values.size());
    EXPECT_NEAR(variance * inputs, 2.0, 2.0 * 6 / std::sqrt(static_cast<double>(values.size())))
        << tensor.name;
  }
  EXPECT_EQ(stored_tensors(a)[18].name, "head.bn.weight");
  EXPECT_EQ(stored_tensors(a)[18].value->data()[0], 0.15F);
  EXPECT_EQ(stored_tensors(a)[19].value->data()[0], 1.0F);
  b.initialize(6);
  EXPECT_NE(stored_tensors(a)[0].value->data()[0], stored_tensors(b)[0].value->data()[0]);
}

TEST(EmbeddingNetwork, RefusesSizesThatDoNotPool) {
  EXPECT_EQ(message([] { EmbeddingNetwork(vgg16(126, 64)); }),
            "network vgg16-conv3_3-fc128-fc128: layer pool2 (MaxPool2d) gets a map of 63 x 32 x "
            "128, expected an even height and width");
  EXPECT_EQ(message([] { EmbeddingNetwork(vgg16(128, 0)); }),
            "network vgg16-conv3_3-fc128-fc128: input width is 0, expected 1 to 4096");
}

}  // namespace
}  // namespace sdmt::reid

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/network_description.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdmt/reid/architectures.h"
#include "sdmt/reid/model_file.h"

namespace sdmt::reid {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

std::string message(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(NetworkDescription, TheArchitecturesAreThoseOfTheirTables) {
  // The paper's table 1, and what the issue of a small network asks for: output of each layer that
  // changes the shape.
  const auto outputs = [](const NetworkDescription& network) {
    std::vector<std::string> texts;
    const auto shapes = network.shapes();
    for (std::size_t i = 0; i < network.layers.size(); ++i) {
      if (shapes[i + 1] == shapes[i]) continue;
      texts.push_back(network.layers[i].name + shapes[i + 1].str());
    }
    return texts;
  };
  EXPECT_THAT(outputs(vgg16()),
              ElementsAre("conv1_1[1,128,64,64]", "pool1[1,64,32,64]", "conv2_1[1,64,32,128]",
                          "pool2[1,32,16,128]", "conv3_1[1,32,16,256]", "fc1[1,1,1,128]"));
  EXPECT_THAT(outputs(lite()),
              ElementsAre("conv1_1[1,64,32,32]", "pool1[1,32,16,32]", "conv2_1[1,32,16,64]",
                          "pool2[1,16,8,64]", "conv3_1[1,16,8,128]", "pool3[1,8,4,128]",
                          "conv4_1[1,8,4,192]", "stripes[1,4,1,192]", "fc[1,1,1,192]"));
  for (const NetworkDescription& network : {vgg16(), lite()}) {
    EXPECT_EQ(network.embedding_size(), network.name == "lite" ? 192 : 128);
    const EmbeddingNetwork built(network);
    EXPECT_EQ(built.description(), network);
    EXPECT_EQ(built.trunk().size(), network.first_of_head());
    EXPECT_EQ(built.trunk().output_shape(built.input_shape(2)).n, 2);
    EXPECT_EQ(built.head().name(0), network.name == "lite" ? "fc" : "fc1");
  }
}

TEST(NetworkDescription, RoundTripsAsJson) {
  for (NetworkDescription network : {vgg16(), lite(64, 64)}) {
    EXPECT_EQ(parse_network_description(to_json(network), "x"), network);
    network.layers[0].kernel_size = 1;
    network.layers[0].padding = 0;
    network.layers[0].bias = !network.layers[0].bias;
    network.layers[0].stored_as = "stem.0";
    network.layers.end()[-2].initial_beta = 0.3F;
    EXPECT_EQ(parse_network_description(to_json(network), "x"), network);
  }
}

TEST(NetworkDescription, IsFoundByNameOrFile) {
  EXPECT_EQ(find_architecture("vgg16"), vgg16());
  EXPECT_EQ(find_architecture("lite"), lite());
  EXPECT_EQ(message([] { find_architecture("resnet"); }),
            "architecture is \"resnet\", expected vgg16, lite or a file such as network.json");
  const fs::path path =
      fs::path(testing::TempDir()) / ("network-" + std::to_string(::getpid()) + ".json");
  std::ofstream(path) << to_json(lite(32, 64));
  EXPECT_EQ(find_architecture(path.string()), lite(32, 64));
  std::ofstream(path) << "{";
  EXPECT_EQ(message([&] { find_architecture(path.string()); }),
            path.string() + ": is not valid JSON (at byte 2)");
  fs::remove(path);
  EXPECT_EQ(message([&] { find_architecture(path.string()); }),
            path.string() + ": cannot be opened: No such file or directory");
}

// The smallest network there is, with one piece of its text replaced.
std::string refusal(const std::string& from, const std::string& to) {
  std::string text = R"({"name":"n","input":{"height":8,"width":4},"layers":[
    {"name":"conv","type":"Conv2d","out_channels":2,"kernel_size":3,"padding":1},
    {"name":"norm","type":"BatchNorm2d"},
    {"name":"pool","type":"MaxPool2d"},
    {"name":"fc","type":"Linear","out_features":5},
    {"name":"norm1","type":"BatchNorm1d"},
    {"name":"l2","type":"L2Normalize"}]})";
  const auto at = text.find(from);
  if (at == std::string::npos) return "no " + from;
  text.replace(at, from.size(), to);
  return message([&] { parse_network_description(text, "n.json"); });
}

TEST(NetworkDescription, RefusalsNameTheLayerAndTheValue) {
  EXPECT_EQ(refusal("n", "n"), "accepted");
  const std::vector<std::array<const char*, 3>> cases = {
      {"\"n\"", "\"\"", "n.json: network name is empty"},
      {"\"height\":8", "\"height\":0", "n.json: network n: input height is 0, expected 1 to 4096"},
      {"\"width\":4", "\"width\":1e9", "n.json: input.width is 1000000000.0, expected a whole"},
      {"Conv2d", "Conv3d", "n.json: layers[0].type is \"Conv3d\", expected one of Conv2d, Batch"},
      {"\"padding\":1", "\"dilation\":2", "n.json: layers[0].dilation is not known for a layer"},
      {"\"padding\":1", "\"padding\":3", "(Conv2d) has padding 3, expected 0 to 2"},
      {"\"padding\":1", "\"stride\":0", "(Conv2d) has stride 0, expected 1 to 15"},
      {"\"padding\":1", "\"bias\":1", "n.json: layers[0].bias is 1, expected true or false"},
      {"\"kernel_size\":3,", "", "n.json: layers[0].kernel_size is missing"},
      {"\"kernel_size\":3", "\"kernel_size\":15", "kernel"},
      {"\"out_channels\":2", "\"out_channels\":-2", "has out_channels -2, expected 1 to 65536"},
      {"\"out_channels\":2", "\"out_channels\":2e3", "expected a whole number"},
      {"BatchNorm2d\"", "BatchNorm2d\",\"initial_gamma\":0", "has initial_gamma 0.000000"},
      {"BatchNorm2d\"", "BatchNorm2d\",\"initial_beta\":1e300", "initial_beta"},
      {"MaxPool2d\"", "MaxPool2d\",\"kernel_size\":3", "layers[2].kernel_size is 3, expected 2"},
      {"MaxPool2d\"", "AvgPool2d\"", "n.json: layers[2].kernel_size is missing"},
      {"MaxPool2d\"", "AvgPool2d\",\"kernel_size\":2", "kernel_size is not a list of 2 numbers"},
      {"MaxPool2d\"", "AvgPool2d\",\"kernel_size\":[2,0]", "has kernel_size[1] 0, expected 1"},
      {"MaxPool2d\"", "AvgPool2d\",\"kernel_size\":[3,4]", "expected blocks of 3 x 4 to fill it"},
      {"\"BatchNorm1d\"", "\"InstanceNorm2d\"", "norm1 (InstanceNorm2d) stands behind a Linear"},
      {"\"width\":4", "\"width\":5", "layer pool (MaxPool2d) gets a map of 8 x 5 x 2, expected"},
      {"MaxPool2d\"", "L2Normalize\"", "pool (L2Normalize) stands before other layers"},
      {"\"BatchNorm1d\"", "\"BatchNorm2d\"", "norm1 (BatchNorm2d) stands behind a Linear"},
      {"BatchNorm2d", "BatchNorm1d", "norm (BatchNorm1d) stands before the first Linear"},
      {"\"L2Normalize\"", "\"ReLU\"", "l2 (ReLU) is the last, expected an L2Normalize there"},
      {"\"Linear\",\"out_features\":5", "\"ReLU\"", "norm1 (BatchNorm1d) stands before the first"},
      {"\"out_features\":5", "\"out_features\":0", "has out_features 0, expected 1 to 65536"},
      {"\"norm1\"", "\"norm\"", "layer name \"norm\" or what it is stored as is taken by another"},
      {"\"norm1\"", "\"a.b\"", "layer name \"a.b\" is not made of letters"},
      {"\"norm1\"", "\"a\",\"stored_as\":\"norm\"", "is taken by another layer"},
      {"\"norm1\"", "\"a\",\"stored_as\":\"../x\"", "stored_as \"../x\", expected letters"},
      {"\"name\":\"fc\",", "", "n.json: layers[3].name is missing"},
      {"[", "5,\"x\":[", "n.json: layers is not a list"},
      {"\"layers\"", "\"strata\"", "n.json: layers is missing"},
  };
  for (const auto& [from, to, expected] : cases) {
    EXPECT_THAT(refusal(from, to), HasSubstr(expected)) << to;
  }
  NetworkDescription none = lite();
  none.layers.clear();
  EXPECT_EQ(message([&] { none.validate(); }), "network lite: has 0 layers, expected 1 to 512");
  none.layers.assign(513, lite().layers[2]);
  EXPECT_EQ(message([&] { none.validate(); }), "network lite: has 513 layers, expected 1 to 512");
}

// A few bytes of text must not make anybody ask for terabytes.
TEST(NetworkDescription, SizesAreBounded) {
  NetworkDescription network = lite(4096, 4096);
  EXPECT_EQ(message([&] { network.validate(); }),
            "network lite: layer conv1_1 (Conv2d) makes a map of 2048 x 2048 x 32, expected at "
            "most 2^24 values");
  network = lite(2048, 64);
  network.layers[network.layers.size() - 3].out_features = 65536;
  EXPECT_EQ(message([&] { network.validate(); }),
            "network lite: layer fc (Linear) has 805306368 weights, expected at most 2^29");
  network = lite();
  for (int i = 0; i < network.first_of_head(); ++i) {
    auto& layer = network.layers[static_cast<std::size_t>(i)];
    if (layer.name.starts_with("conv4")) layer.out_channels = 65536;
  }
  EXPECT_EQ(message([&] { network.validate(); }),
            "network lite: layer conv4_2 (Conv2d) has 38654705664 weights, expected at most 2^29");
}

TEST(LiteModel, IsSavedAndLoadedBitForBit) {
  const fs::path path =
      fs::path(testing::TempDir()) / ("lite-" + std::to_string(::getpid()) + ".safetensors");
  NetworkDescription network = lite(32, 64);
  network.layers[1].type = LayerType::instance_norm2d;
  network.layers[1].name = "norm";
  Model model = untrained_model(network, 1);
  save_model(path, model);
  Model read = load_model(path);
  EXPECT_EQ(read.network.description(), model.network.description());
  EXPECT_EQ(read.metadata.architecture, "lite");
  EXPECT_EQ(to_json(read.metadata), to_json(model.metadata));
  ASSERT_EQ(read.network.state().size(), model.network.state().size());
  for (std::size_t i = 0; i < read.network.state().size(); ++i) {
    const auto ours = read.network.state()[i].value->values();
    const auto theirs = model.network.state()[i].value->values();
    EXPECT_TRUE(std::equal(ours.begin(), ours.end(), theirs.begin(), theirs.end())) << i;
  }
  const io::Safetensors file(path);
  EXPECT_EQ(file.at("conv1_1.weight").shape_str(), "[32,3,3,3]");
  EXPECT_EQ(file.find("conv1_1.bias"), nullptr);
  EXPECT_EQ(file.find("norm.running_var"), nullptr);
  EXPECT_EQ(file.at("norm.weight").shape_str(), "[32]");
  EXPECT_EQ(file.at("bn1_2.running_var").shape_str(), "[32]");
  EXPECT_EQ(file.at("fc.weight").shape_str(), "[192,192]");
  fs::remove(path);
}

TEST(LiteModel, MetadataMustDescribeTheNetwork) {
  const Model lite_as_vgg{ModelMetadata(vgg16(32, 64)), EmbeddingNetwork(lite(32, 64))};
  io::SafetensorsWriter writer;
  EXPECT_THAT(message([&] { add_model(writer, lite_as_vgg, Storage::float32); }),
              StartsWith("the metadata describes vgg16-conv3_3-fc128-fc128 for 32 x 64"));
}

}  // namespace
}  // namespace sdmt::reid

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/architectures.h"

#include <stdexcept>
#include <string>
#include <utility>

#include "sdmt/io/delimited_text.h"

namespace sdmt::reid {

namespace {

// clang-format off
// conv1_1 .. conv3_3 of VGG-16's configuration D (Simonyan & Zisserman, 2015); "features.N" is
// what torchvision's vgg16() calls them.
constexpr const char* kVgg16 = R"({
  "name": "vgg16-conv3_3-fc128-fc128", "input": {"height": 128, "width": 64}, "layers": [
  {"name": "conv1_1", "type": "Conv2d", "stored_as": "features.0", "out_channels": 64, "kernel_size": 3, "padding": 1},
  {"name": "relu1_1", "type": "ReLU"},
  {"name": "conv1_2", "type": "Conv2d", "stored_as": "features.2", "out_channels": 64, "kernel_size": 3, "padding": 1},
  {"name": "relu1_2", "type": "ReLU"},
  {"name": "pool1", "type": "MaxPool2d"},
  {"name": "conv2_1", "type": "Conv2d", "stored_as": "features.5", "out_channels": 128, "kernel_size": 3, "padding": 1},
  {"name": "relu2_1", "type": "ReLU"},
  {"name": "conv2_2", "type": "Conv2d", "stored_as": "features.7", "out_channels": 128, "kernel_size": 3, "padding": 1},
  {"name": "relu2_2", "type": "ReLU"},
  {"name": "pool2", "type": "MaxPool2d"},
  {"name": "conv3_1", "type": "Conv2d", "stored_as": "features.10", "out_channels": 256, "kernel_size": 3, "padding": 1},
  {"name": "relu3_1", "type": "ReLU"},
  {"name": "conv3_2", "type": "Conv2d", "stored_as": "features.12", "out_channels": 256, "kernel_size": 3, "padding": 1},
  {"name": "relu3_2", "type": "ReLU"},
  {"name": "conv3_3", "type": "Conv2d", "stored_as": "features.14", "out_channels": 256, "kernel_size": 3, "padding": 1},
  {"name": "relu3_3", "type": "ReLU"},
  {"name": "fc1", "type": "Linear", "stored_as": "head.fc1", "out_features": 128},
  {"name": "relu1", "type": "ReLU"},
  {"name": "fc2", "type": "Linear", "stored_as": "head.fc2", "out_features": 128},
  {"name": "bn", "type": "BatchNorm1d", "stored_as": "head.bn", "initial_gamma": 0.15, "initial_beta": 1},
  {"name": "l2", "type": "L2Normalize"}]})";

constexpr const char* kLite = R"({
  "name": "lite", "input": {"height": 128, "width": 64}, "layers": [
  {"name": "conv1_1", "type": "Conv2d", "out_channels": 32, "kernel_size": 3, "stride": 2, "padding": 1, "bias": false},
  {"name": "bn1_1", "type": "BatchNorm2d"},
  {"name": "relu1_1", "type": "ReLU"},
  {"name": "conv1_2", "type": "Conv2d", "out_channels": 32, "kernel_size": 3, "padding": 1, "bias": false},
  {"name": "bn1_2", "type": "BatchNorm2d"},
  {"name": "relu1_2", "type": "ReLU"},
  {"name": "pool1", "type": "MaxPool2d"},
  {"name": "conv2_1", "type": "Conv2d", "out_channels": 64, "kernel_size": 3, "padding": 1, "bias": false},
  {"name": "bn2_1", "type": "BatchNorm2d"},
  {"name": "relu2_1", "type": "ReLU"},
  {"name": "conv2_2", "type": "Conv2d", "out_channels": 64, "kernel_size": 3, "padding": 1, "bias": false},
  {"name": "bn2_2", "type": "BatchNorm2d"},
  {"name": "relu2_2", "type": "ReLU"},
  {"name": "pool2", "type": "MaxPool2d"},
  {"name": "conv3_1", "type": "Conv2d", "out_channels": 128, "kernel_size": 3, "padding": 1, "bias": false},
  {"name": "bn3_1", "type": "BatchNorm2d"},
  {"name": "relu3_1", "type": "ReLU"},
  {"name": "conv3_2", "type": "Conv2d", "out_channels": 128, "kernel_size": 3, "padding": 1, "bias": false},
  {"name": "bn3_2", "type": "BatchNorm2d"},
  {"name": "relu3_2", "type": "ReLU"},
  {"name": "pool3", "type": "MaxPool2d"},
  {"name": "conv4_1", "type": "Conv2d", "out_channels": 192, "kernel_size": 3, "padding": 1, "bias": false},
  {"name": "bn4_1", "type": "BatchNorm2d"},
  {"name": "relu4_1", "type": "ReLU"},
  {"name": "conv4_2", "type": "Conv2d", "out_channels": 192, "kernel_size": 3, "padding": 1, "bias": false},
  {"name": "bn4_2", "type": "BatchNorm2d"},
  {"name": "relu4_2", "type": "ReLU"},
  {"name": "conv4_3", "type": "Conv2d", "out_channels": 192, "kernel_size": 3, "padding": 1, "bias": false},
  {"name": "bn4_3", "type": "BatchNorm2d"},
  {"name": "relu4_3", "type": "ReLU"},
  {"name": "stripes", "type": "AvgPool2d", "kernel_size": [2, 4]},
  {"name": "fc", "type": "Linear", "out_features": 192, "bias": false},
  {"name": "bn", "type": "BatchNorm1d", "initial_gamma": 0.1, "initial_beta": 0},
  {"name": "l2", "type": "L2Normalize"}]})";
// clang-format on

NetworkDescription shipped(const char* text, int height, int width) {
  NetworkDescription network = parse_network_description(text, "sdmt");
  network.height = height;
  network.width = width;
  return network;
}

}  // namespace

// vgg16 starts its last batch normalisation at gamma 0.15, beta 1: with the usual 1 and 0 two
// random embeddings are sqrt(2) apart, far outside the margin 0.2, and the contrastive loss hardly
// learns; these values make the mean distance start near the margin. lite learns from a teacher,
// whose vectors point everywhere: it starts about 0.
NetworkDescription vgg16(int height, int width) { return shipped(kVgg16, height, width); }
NetworkDescription lite(int height, int width) { return shipped(kLite, height, width); }

NetworkDescription find_architecture(const std::string& name_or_file) {
  if (name_or_file == "vgg16") return vgg16();
  if (name_or_file == "lite") return lite();
  if (name_or_file.find_first_of("./") != std::string::npos) {
    return parse_network_description(io::read_text(name_or_file), name_or_file);
  }
  throw std::invalid_argument("architecture is \"" + name_or_file +
                              "\", expected vgg16, lite or a file such as network.json");
}

}  // namespace sdmt::reid

// SPDX-License-Identifier: Apache-2.0
#include "pipeline/made_network.h"

#include <cstdint>
#include <vector>

#include "cli/run_command.h"

namespace sdmt::tests {

namespace {

constexpr int kBlock = 8 * 8;

template <typename Value>
void append(std::string& bytes, const Value& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// Protocol Buffers.
std::string varint(std::uint64_t value) {
  std::string bytes;
  for (; value >= 0x80; value >>= 7) bytes += static_cast<char>(value | 0x80);
  return bytes + static_cast<char>(value);
}
std::string number(int field, std::uint64_t value) { return varint(field << 3) + varint(value); }
std::string text(int field, const std::string& value) {
  return varint(field << 3 | 2) + varint(value.size()) + value;
}

std::string darknet_header() {
  std::string weights;
  for (const std::int32_t version : {0, 2, 0}) append(weights, version);
  append(weights, std::uint64_t{0});  // images seen
  return weights;
}

}  // namespace

std::filesystem::path make_darknet(const std::filesystem::path& folder) {
  write_file(folder / "made.cfg",
             "# made for a test\n[net]\nwidth=64\nheight=64\nchannels=3\n\n"
             "[convolutional]\nfilters=7\nsize=8\nstride=8\npad=0\nactivation=linear\n\n"
             "[yolo]\nmask=0\nanchors=8,24\nclasses=2\nnum=1\n");
  write_file(folder / "made.names", "person\ncar\n");
  std::string weights = darknet_header();
  // x, y, width, height, objectness, person, car: sigmoids of 20 (red - ...) - 10.
  for (const float bias : {0.F, 0.F, 0.F, 0.F, -10.F, -10.F, -10.F}) append(weights, bias);
  const float by_color[7][3] = {{}, {}, {}, {}, {20, -40, 20}, {20, 0, 0}, {0, 0, 20}};
  for (const auto& filter : by_color) {
    for (const float weight : filter) {
      for (int i = 0; i < kBlock; ++i) append(weights, weight / kBlock);
    }
  }
  write_file(folder / "made.weights", weights);
  return folder / "made.cfg";
}

std::filesystem::path make_fragile_darknet(const std::filesystem::path& folder) {
  // Cells of 32 pixels beside cells of 64 that are spread over four each.
  const auto convolution = [](int filters, int size) {
    const auto side = std::to_string(size);
    return "[convolutional]\nfilters=" + std::to_string(filters) + "\nsize=" + side +
           "\nstride=" + side + "\npad=0\nactivation=linear\n\n";
  };
  write_file(folder / "fragile.cfg",
             "[net]\nwidth=256\nheight=256\nchannels=3\n\n" + convolution(1, 32) +
                 convolution(1, 2) + "[upsample]\nstride=2\n\n[route]\nlayers=-1,-3\n\n" +
                 convolution(6, 1) + "[yolo]\nmask=0\nanchors=8,24\nclasses=1\nnum=1\n");
  constexpr int kValues = (1 + 3 * 32 * 32) + (1 + 2 * 2) + (6 + 2 * 6);
  write_file(folder / "fragile.weights",
             darknet_header() + std::string(sizeof(float) * kValues, '\0'));
  return folder / "fragile.cfg";
}

std::string make_onnx(int channels) {
  // The numbers of the fields are those of onnx.proto.
  const auto dimensions = [](int field, const std::vector<int>& sizes) {
    std::string shape;
    for (const int size : sizes) shape += text(1, number(1, size));
    return text(field, text(1, number(1, 1) + text(2, shape)));  // float32
  };
  const auto value = [&](const std::string& name, const std::vector<int>& sizes) {
    return text(1, name) + dimensions(2, sizes);
  };
  const auto ints = [](const std::string& name, int v) {
    return text(5, text(1, name) + number(8, v) + number(8, v) + number(20, 7));
  };
  std::string weights = number(1, channels) + number(1, 3) + number(1, 8) + number(1, 8) +
                        number(2, 1) + text(8, "w") +
                        text(9, std::string(sizeof(float) * channels * 3 * kBlock, '\0'));
  const std::string node = text(1, "input") + text(1, "w") + text(2, "output") + text(4, "Conv") +
                           ints("kernel_shape", 8) + ints("strides", 8);
  const std::string graph = text(1, node) + text(2, "made") + text(5, weights) +
                            text(11, value("input", {1, 3, 64, 64})) +
                            text(12, value("output", {1, channels, 8, 8}));
  return number(1, 7) + text(7, graph) + text(8, number(2, 12));
}

}  // namespace sdmt::tests

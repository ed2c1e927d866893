// SPDX-License-Identifier: Apache-2.0
#include "detector_files.h"

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "sdmt/io/checked_value.h"
#include "sdmt/io/delimited_text.h"

namespace sdmt::pipeline {

namespace fs = std::filesystem;

namespace {

constexpr const char* kExpected =
    "expected a detector network: ONNX, or Darknet's .cfg with its .weights beside it";

// Protocol Buffers, as far as ONNX needs them: the fields of one message.
class Message {
 public:
  struct Field {
    std::uint64_t number = 0;
    std::uint64_t value = 0;  // of a number
    std::string_view bytes;   // of a text or a message
  };

  explicit Message(std::string_view bytes) : rest_(bytes) {}
  /// The next field; nullopt at the end, or where it is damaged().
  std::optional<Field> next() {
    constexpr int kNumber = 0, kEightBytes = 1, kBytes = 2, kFourBytes = 5;
    if (rest_.empty() || damaged_) return std::nullopt;
    const std::uint64_t key = number();
    Field field{key >> 3, 0, {}};
    switch (key & 7) {
      case kNumber:
        field.value = number();
        break;
      case kEightBytes:
        field.bytes = take(8);
        break;
      case kBytes:
        field.bytes = take(number());
        break;
      case kFourBytes:
        field.bytes = take(4);
        break;
      default:
        damaged_ = true;
    }
    return damaged_ ? std::nullopt : std::optional(field);
  }
  bool damaged() const { return damaged_; }

 private:
  std::uint64_t number() {
    constexpr int kBits = 7, kMost = 64;
    std::uint64_t value = 0;
    for (int shift = 0; shift < kMost; shift += kBits) {
      if (rest_.empty()) break;
      const auto byte = static_cast<unsigned char>(rest_.front());
      rest_.remove_prefix(1);
      value |= static_cast<std::uint64_t>(byte & 0x7F) << shift;
      if (byte < 0x80) return value;
    }
    damaged_ = true;
    return 0;
  }
  std::string_view take(std::uint64_t count) {
    if (count > rest_.size()) {
      damaged_ = true;
      return {};
    }
    const auto bytes = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return bytes;
  }

  std::string_view rest_;
  bool damaged_ = false;
};

// The last field of this number in a message; empty without one.
std::string_view part(std::string_view message, std::uint64_t number) {
  Message fields(message);
  std::string_view found;
  while (const auto field = fields.next()) {
    if (field->number == number) found = field->bytes;
  }
  return found;
}

// {0: 'person', 1: "bicycle"}
std::vector<std::string> parse_names(std::string_view text) {
  std::vector<std::string> names;
  while (true) {
    const auto open = text.find_first_of("'\"");
    if (open == std::string_view::npos) return names;
    const auto close = text.find(text[open], open + 1);
    if (close == std::string_view::npos) return names;
    names.emplace_back(text.substr(open + 1, close - open - 1));
    text.remove_prefix(close + 1);
  }
}

// onnx.proto: ModelProto.graph 7, metadata_props 14; GraphProto.node 1, input 11;
// ValueInfoProto.type 2; TypeProto.tensor_type 1; Tensor.shape 2; Dimension.dim_value 1.
bool read_onnx(std::string_view bytes, DetectorFiles& files) {
  Message model(bytes);
  std::string_view graph;
  while (const auto field = model.next()) {
    if (field->number == 7) graph = field->bytes;
    if (field->number == 14 && part(field->bytes, 1) == "names") {
      files.names = parse_names(part(field->bytes, 2));
    }
  }
  constexpr std::string_view kVersionFirst = "\x08";  // ir_version, as all writers have it
  if (graph.empty() && !(model.damaged() && bytes.starts_with(kVersionFirst))) return false;
  if (model.damaged()) {
    throw std::invalid_argument(files.network.string() + ": the ONNX file is cut off or damaged");
  }
  Message parts(graph);
  while (const auto field = parts.next()) {
    if (field->number != 11) continue;
    std::vector<std::uint64_t> shape;
    Message dimensions(part(part(part(field->bytes, 2), 1), 2));
    while (const auto dimension = dimensions.next()) {
      Message size(dimension->bytes);
      const auto value = size.next();
      shape.push_back(value && value->number == 1 ? value->value : 0);
    }
    constexpr std::uint64_t kLargest = 1 << 14;
    if (shape.size() != 4 || shape[2] > kLargest || shape[3] > kLargest) continue;
    files.height = static_cast<int>(shape[2]);
    files.width = static_cast<int>(shape[3]);
    files.fixed_size = files.height > 0 && files.width > 0;
    break;
  }
  return true;
}

// The value of `key` in Darknet's text; nullopt when it is not there or no size.
std::optional<int> darknet_size(std::string_view text, std::string_view key) {
  std::optional<int> found;
  io::for_each_line(text, [&](std::size_t, std::string_view line) {
    const auto equals = line.find('=');
    if (found || equals == std::string_view::npos) return;
    const auto trim = [](std::string_view part) {
      while (part.ends_with(' ')) part.remove_suffix(1);
      while (part.starts_with(' ')) part.remove_prefix(1);
      return part;
    };
    if (trim(line.substr(0, equals)) == key) {
      found = io::parse_number<int>(trim(line.substr(equals + 1)));
    }
  });
  return found;
}

bool is_darknet(std::string_view text) {
  bool first = true, found = false;
  io::for_each_line(text.substr(0, 4096), [&](std::size_t, std::string_view line) {
    if (!first || line.starts_with('#')) return;
    first = false;
    found = line.starts_with("[net]") || line.starts_with("[network]");
  });
  return found;
}

std::vector<std::string> read_names(const fs::path& network) {
  fs::path file = fs::path(network).replace_extension(".names");
  std::error_code failed;
  if (!fs::exists(file, failed)) {
    std::vector<fs::path> others;
    const auto folder = network.has_parent_path() ? network.parent_path() : fs::path(".");
    for (const auto& entry : fs::directory_iterator(folder, failed)) {
      if (entry.path().extension() == ".names") others.push_back(entry.path());
    }
    if (others.size() != 1) return {};
    file = others.front();
  }
  std::vector<std::string> names;
  io::for_each_line(io::read_text(file),
                    [&](std::size_t, std::string_view line) { names.emplace_back(line); });
  return names;
}

void read_darknet(std::string_view text, DetectorFiles& files) {
  constexpr int kLargest = 1 << 14;
  const auto size = [&](const char* key) {
    const auto value = darknet_size(text, key);
    if (!value || *value < 1 || *value > kLargest) {
      throw std::invalid_argument(files.network.string() + ": has no " + key +
                                  " of the network's input, expected 1 to 16384");
    }
    return *value;
  };
  files.width = size("width");
  files.height = size("height");
  files.names = read_names(files.network);
}

}  // namespace

DetectorFiles find_detector_files(const fs::path& file) {
  DetectorFiles files;
  files.network = file;
  if (file.extension() == ".weights") files.network.replace_extension(".cfg");
  if (fs::is_directory(files.network)) {
    throw std::invalid_argument(files.network.string() + ": is a folder, " + kExpected);
  }
  const std::string bytes = io::read_text(files.network);
  if (is_darknet(bytes)) {
    files.weights = fs::path(files.network).replace_extension(".weights");
    if (!fs::exists(files.weights)) {
      throw std::invalid_argument(files.network.string() + ": its weights are missing, expected " +
                                  files.weights.string());
    }
    read_darknet(bytes, files);
    return files;
  }
  if (!read_onnx(bytes, files)) {
    const bool zip = bytes.starts_with("PK");
    throw std::invalid_argument(
        file.string() + ": " +
        (zip ? "is a zip archive (PyTorch's .pt? Export it to ONNX), " : "") + kExpected);
  }
  return files;
}

}  // namespace sdmt::pipeline

// SPDX-License-Identifier: Apache-2.0
#include "safetensors_header.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "sdmt/io/checked_value.h"
#include "sdmt/io/json_text.h"

namespace sdmt::io {

namespace {

using nlohmann::json;

struct DTypeInfo {
  std::string_view name;
  std::size_t size;
};
constexpr std::array<DTypeInfo, 13> kDTypes{{{"BOOL", 1},
                                             {"U8", 1},
                                             {"I8", 1},
                                             {"U16", 2},
                                             {"I16", 2},
                                             {"F16", 2},
                                             {"BF16", 2},
                                             {"U32", 4},
                                             {"I32", 4},
                                             {"F32", 4},
                                             {"U64", 8},
                                             {"I64", 8},
                                             {"F64", 8}}};

DType find_dtype(std::string_view name) {
  for (std::size_t i = 0; i < kDTypes.size(); ++i) {
    if (kDTypes[i].name == name) return static_cast<DType>(i);
  }
  return DType::unknown;
}

std::string shown(std::string_view text) { return printable(text, 100); }

[[noreturn]] void refuse(const std::string& file, const std::string& what) {
  throw std::invalid_argument(file + ": " + what);
}

[[noreturn]] void refuse(const std::string& file, std::string_view tensor,
                         const std::string& what) {
  refuse(file, "tensor " + shown(tensor) + " " + what);
}

std::map<std::string, std::string> parse_metadata(const json& object, const std::string& file) {
  if (!object.is_object()) refuse(file, "__metadata__ is not a JSON object");
  std::map<std::string, std::string> metadata;
  for (const auto& [key, value] : object.items()) {
    if (!value.is_string()) refuse(file, "__metadata__ key " + shown(key) + " is not a text");
    metadata.emplace(key, value.get<std::string>());
  }
  return metadata;
}

SafetensorsEntry parse_entry(const std::string& name, const json& description,
                             std::uint64_t data_bytes, const std::string& file) {
  const auto fail = [&](const std::string& what) { refuse(file, name, what); };
  const auto field = [&](const char* key) -> const json& {
    if (!description.is_object()) fail("is not described by a JSON object");
    const auto found = description.find(key);
    if (found == description.end()) fail(std::string("has no ") + key);
    return *found;
  };
  const auto integer = [&](const json& value, const char* where) {
    if (!value.is_number_unsigned()) {
      fail(std::string("has ") + shown(value.dump()) + " in its " + where +
           ", expected a whole number >= 0");
    }
    return value.get<std::uint64_t>();
  };

  SafetensorsEntry entry;
  entry.name = name;
  const json& dtype = field("dtype");
  if (!dtype.is_string()) fail("has a dtype that is not a text");
  entry.dtype_text = dtype.get<std::string>();
  entry.dtype = find_dtype(entry.dtype_text);

  const json& shape = field("shape");
  if (!shape.is_array()) fail("has a shape that is not a list");
  // Of an unknown type the values are counted, not the bytes.
  std::uint64_t size = entry.dtype == DType::unknown ? 1 : dtype_size(entry.dtype);
  for (const auto& value : shape) {
    const std::uint64_t extent = integer(value, "shape");
    entry.shape.push_back(extent);
    if (__builtin_mul_overflow(size, extent, &size)) {
      fail("has shape " + shown(entry.shape_str()) + "..., which overflows 64 bits");
    }
  }

  const json& offsets = field("data_offsets");
  if (!offsets.is_array() || offsets.size() != 2) fail("has data_offsets that are not two numbers");
  const std::uint64_t begin = integer(offsets[0], "data_offsets");
  const std::uint64_t end = integer(offsets[1], "data_offsets");
  const std::string range = "[" + std::to_string(begin) + "," + std::to_string(end) + "]";
  if (begin > end) fail("has data_offsets " + range + " that run backwards");
  if (end > data_bytes) {
    fail("has data_offsets " + range + " beyond the " + std::to_string(data_bytes) +
         " bytes of data in the file");
  }
  if (entry.dtype != DType::unknown && end - begin != size) {
    fail("has data_offsets " + range + ", but " + entry.dtype_text + " " + entry.shape_str() +
         " takes " + std::to_string(size) + " bytes");
  }
  entry.offset = begin;
  entry.size = end - begin;
  return entry;
}

// The tensors must cover the data without overlap, hole or end outside.
void check_cover(const std::vector<SafetensorsEntry>& tensors, std::uint64_t data_bytes,
                 const std::string& file) {
  std::uint64_t covered = 0;
  for (const SafetensorsEntry& entry : tensors) {
    if (entry.offset != covered) {
      refuse(file, entry.name,
             "starts at byte " + std::to_string(entry.offset) + " of the data, expected " +
                 std::to_string(covered) +
                 (entry.offset < covered ? " (it overlaps the tensor before it)"
                                         : " (there is a hole before it)"));
    }
    covered += entry.size;
  }
  if (covered != data_bytes) {
    refuse(file, "holds " + std::to_string(data_bytes) + " bytes of data, but its tensors end at " +
                     std::to_string(covered));
  }
}

}  // namespace

std::string_view dtype_name(DType dtype) {
  return dtype == DType::unknown ? "unknown" : kDTypes.at(static_cast<std::size_t>(dtype)).name;
}

std::size_t dtype_size(DType dtype) { return kDTypes.at(static_cast<std::size_t>(dtype)).size; }

SafetensorsHeader parse_safetensors_header(std::string_view text, std::uint64_t data_bytes,
                                           const std::string& file) {
  check_json(text, file + ": header");
  const json object = json::parse(text);
  if (!object.is_object()) refuse(file, "header is not a JSON object");
  SafetensorsHeader header;
  for (const auto& [key, value] : object.items()) {
    if (key == "__metadata__") {
      header.metadata = parse_metadata(value, file);
    } else {
      header.tensors.push_back(parse_entry(key, value, data_bytes, file));
    }
  }
  // Empty tensors come before the one that starts where they lie.
  std::stable_sort(header.tensors.begin(), header.tensors.end(), [](const auto& a, const auto& b) {
    return std::pair(a.offset, a.size) < std::pair(b.offset, b.size);
  });
  check_cover(header.tensors, data_bytes, file);
  return header;
}

}  // namespace sdmt::io

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "sdmt/io/output_file.h"
#include "sdmt/io/safetensors.h"

namespace sdmt::io {

namespace {

std::uint64_t byte_count(DType dtype, const std::vector<std::uint64_t>& shape) {
  std::uint64_t size = dtype_size(dtype);
  for (const std::uint64_t extent : shape) size *= extent;
  return size;
}

}  // namespace

void SafetensorsWriter::set_metadata(std::string key, std::string text) {
  metadata_.insert_or_assign(std::move(key), std::move(text));
}

void SafetensorsWriter::add(std::string tensor, DType dtype, std::vector<std::uint64_t> shape,
                            std::function<void(const Sink&)> produce) {
  const auto same_name = [&](const Item& item) { return item.name == tensor; };
  if (std::any_of(items_.begin(), items_.end(), same_name)) {
    throw std::invalid_argument("tensor " + tensor + " is added twice");
  }
  items_.push_back({std::move(tensor), dtype, std::move(shape), std::move(produce)});
}

void SafetensorsWriter::add_bytes(std::string tensor, DType dtype, std::vector<std::uint64_t> shape,
                                  std::span<const std::byte> bytes) {
  if (byte_count(dtype, shape) != bytes.size()) {
    throw std::invalid_argument("tensor " + tensor + " is given " + std::to_string(bytes.size()) +
                                " bytes, its shape takes " +
                                std::to_string(byte_count(dtype, shape)));
  }
  add(std::move(tensor), dtype, std::move(shape), [bytes](const Sink& sink) { sink(bytes); });
}

void SafetensorsWriter::add(std::string tensor, std::vector<std::uint64_t> shape,
                            std::span<const float> values) {
  add_bytes(std::move(tensor), DType::f32, std::move(shape), std::as_bytes(values));
}

void SafetensorsWriter::add(std::string tensor, std::vector<std::uint64_t> shape,
                            std::span<const std::uint64_t> values) {
  add_bytes(std::move(tensor), DType::u64, std::move(shape), std::as_bytes(values));
}

void SafetensorsWriter::write(const std::filesystem::path& path) const {
  // Wide types first: with the header padded to 8 bytes every tensor is then aligned.
  std::vector<const Item*> order;
  for (const Item& item : items_) order.push_back(&item);
  std::stable_sort(order.begin(), order.end(), [](const Item* a, const Item* b) {
    return dtype_size(a->dtype) > dtype_size(b->dtype);
  });

  nlohmann::ordered_json header = nlohmann::ordered_json::object();
  if (!metadata_.empty()) header["__metadata__"] = metadata_;
  std::uint64_t offset = 0;
  for (const Item* item : order) {
    const std::uint64_t end = offset + byte_count(item->dtype, item->shape);
    header[item->name] = {{"dtype", dtype_name(item->dtype)},
                          {"shape", item->shape},
                          {"data_offsets", {offset, end}}};
    offset = end;
  }
  std::string text = header.dump();
  text.resize((text.size() + 7) / 8 * 8, ' ');
  const std::uint64_t length = text.size();

  OutputFile file(path);
  file.write(&length, sizeof(length));
  file.write(text);
  for (const Item* item : order) {
    std::uint64_t written = 0;
    item->produce([&](std::span<const std::byte> bytes) {
      file.write(bytes.data(), bytes.size());
      written += bytes.size();
    });
    if (written != byte_count(item->dtype, item->shape)) {
      throw std::logic_error("tensor " + item->name + " produced " + std::to_string(written) +
                             " bytes, its shape takes " +
                             std::to_string(byte_count(item->dtype, item->shape)));
    }
  }
  file.commit();
}

}  // namespace sdmt::io

// SPDX-License-Identifier: Apache-2.0
// Any bytes either are refused with std::invalid_argument or make a file whose every tensor can be
// read.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <stdexcept>
#include <vector>

#include "sdmt/io/safetensors.h"
#include "sdmt/reid/model_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sdmt;
  try {
    const io::Safetensors file(std::as_bytes(std::span(data, size)), "fuzz");
    std::size_t bytes = 0;
    for (const io::SafetensorsEntry& entry : file.tensors()) {
      bytes += entry.size;
      if (file.find(entry.name) != &entry) std::abort();
      if (entry.dtype == io::DType::unknown) continue;  // its shape may ask for any memory
      std::vector<float> values(entry.count());
      try {
        file.read_floats(entry, values);
      } catch (const std::invalid_argument&) {  // a type that is no float
      }
    }
    if (bytes > size) std::abort();
    const auto metadata = file.metadata().find(reid::kModelMetadataKey);
    if (metadata != file.metadata().end()) reid::parse_model_metadata(metadata->second, "fuzz");
  } catch (const std::invalid_argument&) {
  }
  return 0;
}

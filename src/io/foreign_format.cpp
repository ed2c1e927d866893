// SPDX-License-Identifier: Apache-2.0
#include "foreign_format.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>

namespace sdmt::io {

namespace {

using namespace std::string_view_literals;

struct Signature {
  std::string_view bytes, meaning;
};
constexpr std::array kSignatures{
    Signature{"version https://git-lfs"sv,
              "a Git LFS pointer, not the file itself; fetch that with git lfs pull"sv},
    Signature{"PK\x03\x04"sv, "a zip archive (a .pth, .pt or .npz?); convert it to safetensors"sv},
    Signature{"\x89HDF\r\n\x1a\n"sv, "an HDF5 file (a .h5?); convert it to safetensors"sv},
    Signature{"\x80\x02"sv, "a Python pickle (an old .pth?); convert it to safetensors"sv},
    Signature{"\x80\x03"sv, "a Python pickle (an old .pth?); convert it to safetensors"sv},
    Signature{"\x80\x04"sv, "a Python pickle (an old .pth?); convert it to safetensors"sv},
    Signature{"\x80\x05"sv, "a Python pickle (an old .pth?); convert it to safetensors"sv},
    Signature{"\x93NUMPY"sv, "a NumPy array (.npy); convert it to safetensors"sv},
    Signature{"\x1f\x8b"sv, "gzip-compressed; unpack it"sv},
    Signature{"GGUF"sv, "a GGUF file; convert it to safetensors"sv},
    Signature{"\xff\xd8\xff"sv, "a JPEG image"sv},
    Signature{"\x89PNG"sv, "a PNG image"sv},
};

// A Protocol Buffers message of field 1, a small version, and field 2, the name of what wrote it.
bool is_onnx(std::string_view bytes) {
  return bytes.size() >= 5 && bytes[0] == 0x08 && bytes[1] > 0 && bytes[1] < 0x20 &&
         bytes[2] == 0x12 && std::isalpha(static_cast<unsigned char>(bytes[4])) != 0;
}

}  // namespace

std::string_view foreign_format(std::string_view first_bytes) {
  for (const auto& [bytes, meaning] : kSignatures) {
    if (first_bytes.starts_with(bytes)) return meaning;
  }
  if (is_onnx(first_bytes)) return "an ONNX model; convert its weights to safetensors";
  if (first_bytes.substr(std::min<std::size_t>(4, first_bytes.size())).starts_with("TFL3")) {
    return "a TensorFlow Lite model; convert its weights to safetensors";
  }
  first_bytes.remove_prefix(std::min(first_bytes.find_first_not_of(" \t\r\n"), first_bytes.size()));
  if (first_bytes.starts_with('<')) return "an HTML or XML page; was a download refused?";
  if (first_bytes.starts_with('{') || first_bytes.starts_with('[')) {
    return "JSON text (the index of a model in several files?)";
  }
  return {};
}

}  // namespace sdmt::io

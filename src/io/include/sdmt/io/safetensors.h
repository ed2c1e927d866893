// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace sdmt::io {

/// Element types of the safetensors format that are recognised in a file.
enum class DType { boolean, u8, i8, u16, i16, f16, bf16, u32, i32, f32, u64, i64, f64, unknown };

std::string_view dtype_name(DType dtype);  ///< as the format spells it: "F32", "I8", ...
std::size_t dtype_size(DType dtype);       ///< bytes; throws std::out_of_range for unknown

/// One tensor of a file: its values are little-endian, last dimension fastest.
struct SafetensorsEntry {
  std::string name;
  DType dtype = DType::f32;          ///< unknown: may be listed and copied, not read as numbers
  std::string dtype_text;            ///< as the file spells it
  std::vector<std::uint64_t> shape;  ///< empty for a scalar
  std::uint64_t offset = 0;          ///< of its first byte, from that of all tensors' data
  std::uint64_t size = 0;            ///< bytes

  std::uint64_t count() const;    ///< values
  std::string shape_str() const;  ///< "[64,3,3,3]"
};

/// A safetensors file (https://github.com/huggingface/safetensors), whose header is checked
/// completely before anything is handed out: length, JSON, shapes, duplicates, and that the tensors
/// cover the data without overlap, hole or end outside. Whatever is wrong throws
/// std::invalid_argument with one line: file, tensor, what was found, what was expected (for a file
/// of another kind, what it is); a file that cannot be read, or is cut short meanwhile,
/// std::runtime_error. May be read by several threads at a time.
class Safetensors {
 public:
  /// Opens the file and reads its header; tensors are read when they are asked for.
  explicit Safetensors(const std::filesystem::path& path);
  /// Reads from memory of the caller, which must outlive this object; `name` is for messages.
  Safetensors(std::span<const std::byte> file, std::string name);
  ~Safetensors();
  Safetensors(Safetensors&&) noexcept;
  Safetensors& operator=(Safetensors&&) noexcept;

  /// The file's name, as messages show it.
  const std::string& name() const { return name_; }
  /// In the order of their data.
  const std::vector<SafetensorsEntry>& tensors() const { return tensors_; }
  /// The texts of `__metadata__`; empty when there are none.
  const std::map<std::string, std::string>& metadata() const { return metadata_; }

  /// nullptr when there is no such tensor.
  const SafetensorsEntry* find(std::string_view tensor) const;
  /// Throws std::invalid_argument naming file and tensor when there is no such tensor.
  const SafetensorsEntry& at(std::string_view tensor) const;
  /// As at(); throws also when the shape differs from `shape`.
  const SafetensorsEntry& at(std::string_view tensor, std::span<const std::uint64_t> shape) const;

  /// out.size() bytes of a tensor of any type, from byte `first` on. Throws std::invalid_argument
  /// for bytes outside the tensor.
  void read_bytes(const SafetensorsEntry& entry, std::span<std::byte> out,
                  std::uint64_t first = 0) const;
  /// out.size() values of an F32, F16, BF16, F64 (rounded) or I8 tensor as float32, from value
  /// `first` on. Throws std::invalid_argument for another type or values outside the tensor.
  void read_floats(const SafetensorsEntry& entry, std::span<float> out,
                   std::uint64_t first = 0) const;
  /// The values of a U64 or I64 tensor (negative values keep their 64 bits); other types throw.
  std::vector<std::uint64_t> read_integers(std::string_view tensor) const;

 private:
  class Source;
  void parse();

  std::string name_;
  std::unique_ptr<Source> source_;
  std::uint64_t data_ = 0;  // where the tensors' data begin
  std::map<std::string, std::string> metadata_;
  std::vector<SafetensorsEntry> tensors_;
  std::map<std::string, std::size_t, std::less<>> index_;
};

/// Collects tensors and writes them as one safetensors file. Nothing is copied: the memory given to
/// add() must live until write().
class SafetensorsWriter {
 public:
  using Sink = std::function<void(std::span<const std::byte>)>;

  void set_metadata(std::string key, std::string text);

  /// Throws std::invalid_argument for a name used before, or values that do not fill the shape.
  void add(std::string tensor, std::vector<std::uint64_t> shape, std::span<const float> values);
  void add(std::string tensor, std::vector<std::uint64_t> shape,
           std::span<const std::uint64_t> values);
  /// Values whose bytes in memory are those of the file.
  void add_bytes(std::string tensor, DType dtype, std::vector<std::uint64_t> shape,
                 std::span<const std::byte> bytes);
  /// A tensor of any type made while writing: `produce` hands its bytes, in order and in pieces of
  /// any size, to the sink.
  void add(std::string tensor, DType dtype, std::vector<std::uint64_t> shape,
           std::function<void(const Sink&)> produce);

  /// Writes the file whole or not at all (OutputFile). The bytes depend only on what was added.
  /// Throws as OutputFile does, and std::logic_error when a tensor did not produce what its shape
  /// asks for.
  void write(const std::filesystem::path& path) const;

 private:
  struct Item {
    std::string name;
    DType dtype;
    std::vector<std::uint64_t> shape;
    std::function<void(const Sink&)> produce;
  };
  std::map<std::string, std::string> metadata_;
  std::vector<Item> items_;
};

}  // namespace sdmt::io

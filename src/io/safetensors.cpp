// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/safetensors.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "foreign_format.h"
#include "safetensors_header.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/io/half.h"
#include "sdmt/io/retry.h"

static_assert(std::endian::native == std::endian::little,
              "the values of safetensors files are little-endian and read as they are");

namespace sdmt::io {

namespace {

constexpr std::uint64_t kLengthBytes = 8;
constexpr std::uint64_t kMaxHeader = 100'000'000;  // as the format's own reader

[[noreturn]] void refuse(const std::string& file, const std::string& what) {
  throw std::invalid_argument(file + ": " + what);
}

[[noreturn]] void refuse(const std::string& file, std::string_view tensor,
                         const std::string& what) {
  refuse(file, "tensor " + printable(tensor, 100) + " " + what);
}

}  // namespace

std::uint64_t SafetensorsEntry::count() const {
  return std::accumulate(shape.begin(), shape.end(), std::uint64_t{1}, std::multiplies<>());
}

std::string SafetensorsEntry::shape_str() const {
  std::string text = "[";
  for (const std::uint64_t extent : shape) {
    if (text.size() > 1) text += ",";
    text += std::to_string(extent);
  }
  return text + "]";
}

// The bytes of a file, or of the caller's memory. A file is read, not mapped: if somebody cuts it
// short meanwhile, that is an error like another and not a signal.
class Safetensors::Source {
 public:
  explicit Source(std::span<const std::byte> memory) : memory_(memory), size_(memory.size()) {}
  explicit Source(std::string path) : path_(std::move(path)) {
    descriptor_ = retry([&] { return ::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK); });
    if (descriptor_ < 0) refuse(path_, std::string("cannot be opened: ") + std::strerror(errno));
    struct stat status {};
    const bool known = ::fstat(descriptor_, &status) == 0;
    const int cause = errno;
    if (!known || !S_ISREG(status.st_mode) || status.st_size == 0) ::close(descriptor_);
    if (!known) fail(std::strerror(cause));
    if (!S_ISREG(status.st_mode)) refuse(path_, "is not a regular file");
    if (status.st_size == 0) refuse(path_, "is empty, expected a safetensors file");
    size_ = static_cast<std::uint64_t>(status.st_size);
  }
  ~Source() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  std::uint64_t size() const { return size_; }

  // All of `out` from byte `offset` on; by several threads at a time.
  void read(std::uint64_t offset, std::span<std::byte> out) const {
    if (descriptor_ < 0) {
      std::copy_n(memory_.begin() + offset, out.size(), out.begin());
      return;
    }
    while (!out.empty()) {
      const ssize_t got =
          retry([&] { return ::pread(descriptor_, out.data(), out.size(), offset); });
      if (got < 0) fail(std::strerror(errno));
      if (got == 0) fail("it ends at byte " + std::to_string(offset) + "; was it cut short?");
      offset += got;
      out = out.subspan(got);
    }
  }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw std::runtime_error(path_ + ": cannot be read: " + why);
  }

  std::string path_;
  std::span<const std::byte> memory_;
  std::uint64_t size_ = 0;
  int descriptor_ = -1;
};

Safetensors::Safetensors(const std::filesystem::path& path)
    : name_(path.string()), source_(std::make_unique<Source>(name_)) {
  parse();
}

Safetensors::Safetensors(std::span<const std::byte> file, std::string name)
    : name_(std::move(name)), source_(std::make_unique<Source>(file)) {
  parse();
}

Safetensors::~Safetensors() = default;
Safetensors::Safetensors(Safetensors&&) noexcept = default;
Safetensors& Safetensors::operator=(Safetensors&&) noexcept = default;

void Safetensors::parse() {
  const auto read_text = [&](std::uint64_t offset, std::uint64_t size) {
    std::string text(size, '\0');
    source_->read(offset, std::as_writable_bytes(std::span(text)));
    return text;
  };
  // What is wrong with a file that is of another kind is that it is.
  const auto refuse_kind = [&](const std::string& what) {
    const std::string first = read_text(0, std::min<std::uint64_t>(source_->size(), 64));
    const std::string_view kind = foreign_format(first);
    if (kind.empty()) refuse(name_, what);
    refuse(name_, "expected a safetensors file, this is " + std::string(kind));
  };
  if (source_->size() < kLengthBytes) {
    refuse_kind("is " + std::to_string(source_->size()) +
                " bytes long, too short for a safetensors file");
  }
  std::uint64_t length = 0;
  source_->read(0, std::as_writable_bytes(std::span(&length, 1)));
  const std::uint64_t behind = source_->size() - kLengthBytes;
  if (length > kMaxHeader) {
    refuse_kind("header length is " + std::to_string(length) + ", expected at most " +
                std::to_string(kMaxHeader) + " (not a safetensors file?)");
  }
  if (length > behind) {
    refuse_kind("header length is " + std::to_string(length) + ", but only " +
                std::to_string(behind) + " bytes follow");
  }
  const std::string text = read_text(kLengthBytes, length);
  if (!text.starts_with('{') && !foreign_format(read_text(0, kLengthBytes)).empty()) {
    refuse_kind("");
  }
  data_ = kLengthBytes + length;
  SafetensorsHeader header = parse_safetensors_header(text, behind - length, name_);
  metadata_ = std::move(header.metadata);
  tensors_ = std::move(header.tensors);
  for (std::size_t i = 0; i < tensors_.size(); ++i) index_.emplace(tensors_[i].name, i);
}

const SafetensorsEntry* Safetensors::find(std::string_view tensor) const {
  const auto found = index_.find(tensor);
  return found == index_.end() ? nullptr : &tensors_[found->second];
}

const SafetensorsEntry& Safetensors::at(std::string_view tensor) const {
  const SafetensorsEntry* entry = find(tensor);
  if (entry == nullptr) refuse(name_, tensor, "is missing");
  return *entry;
}

const SafetensorsEntry& Safetensors::at(std::string_view tensor,
                                        std::span<const std::uint64_t> shape) const {
  const SafetensorsEntry& entry = at(tensor);
  if (!std::equal(shape.begin(), shape.end(), entry.shape.begin(), entry.shape.end())) {
    SafetensorsEntry expected;
    expected.shape.assign(shape.begin(), shape.end());
    refuse(name_, tensor,
           "has shape " + printable(entry.shape_str(), 100) + ", expected " + expected.shape_str());
  }
  return entry;
}

void Safetensors::read_bytes(const SafetensorsEntry& entry, std::span<std::byte> out,
                             std::uint64_t first) const {
  if (first > entry.size || out.size() > entry.size - first) {
    refuse(name_, entry.name,
           "has " + std::to_string(entry.size) + " bytes, asked for " + std::to_string(out.size()) +
               " from " + std::to_string(first));
  }
  source_->read(data_ + entry.offset + first, out);
}

void Safetensors::read_floats(const SafetensorsEntry& entry, std::span<float> out,
                              std::uint64_t first) const {
  if (first > entry.count() || out.size() > entry.count() - first) {
    refuse(name_, entry.name,
           "has " + std::to_string(entry.count()) + " values, asked for " +
               std::to_string(out.size()) + " from " + std::to_string(first));
  }
  // As many values at a time as fit into memory that is at hand.
  const auto convert = [&]<typename T>(T, auto to_float) {
    constexpr std::size_t kBlock = 4096;
    std::array<T, kBlock> values;
    for (std::size_t done = 0; done < out.size(); done += kBlock) {
      const auto part = std::span(values).first(std::min(kBlock, out.size() - done));
      read_bytes(entry, std::as_writable_bytes(part), (first + done) * sizeof(T));
      std::transform(part.begin(), part.end(), out.begin() + done, to_float);
    }
  };
  switch (entry.dtype) {
    case DType::f32:
      return read_bytes(entry, std::as_writable_bytes(out), first * sizeof(float));
    case DType::f16:
      return convert(std::uint16_t{}, half_to_float);
    case DType::bf16:
      return convert(std::uint16_t{}, bfloat16_to_float);
    case DType::f64:
      return convert(double{}, [](double v) { return static_cast<float>(v); });
    case DType::i8:
      return convert(std::int8_t{}, [](std::int8_t v) { return static_cast<float>(v); });
    default:
      refuse(
          name_, entry.name,
          "has dtype " + printable(entry.dtype_text, 100) + ", expected F32, F16, BF16, F64 or I8");
  }
}

std::vector<std::uint64_t> Safetensors::read_integers(std::string_view tensor) const {
  const SafetensorsEntry& entry = at(tensor);
  if (entry.dtype != DType::u64 && entry.dtype != DType::i64) {
    refuse(name_, tensor,
           "has dtype " + printable(entry.dtype_text, 100) + ", expected U64 or I64");
  }
  std::vector<std::uint64_t> values(entry.count());
  read_bytes(entry, std::as_writable_bytes(std::span(values)));
  return values;
}

}  // namespace sdmt::io

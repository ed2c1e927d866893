// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/safetensors.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "sdmt/io/half.h"

static_assert(std::endian::native == std::endian::little,
              "the values of safetensors files are little-endian and read as they are");

namespace sdmt::io {

namespace {

using nlohmann::json;

constexpr std::size_t kLengthBytes = 8;
constexpr std::uint64_t kMaxHeader = 100'000'000;  // as the format's own reader

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

std::optional<DType> find_dtype(std::string_view name) {
  for (std::size_t i = 0; i < kDTypes.size(); ++i) {
    if (kDTypes[i].name == name) return static_cast<DType>(i);
  }
  return std::nullopt;
}

// A text of the file, fit to be shown in one line.
std::string shown(std::string_view text) {
  constexpr std::size_t kLongest = 100;
  std::string line(text.substr(0, kLongest));
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  if (text.size() > kLongest) line += "...";
  return line;
}

[[noreturn]] void refuse(const std::string& file, const std::string& what) {
  throw std::invalid_argument(file + ": " + what);
}

[[noreturn]] void refuse(const std::string& file, std::string_view tensor,
                         const std::string& what) {
  refuse(file, "tensor " + shown(tensor) + " " + what);
}

// Parses the header; the parser itself would silently keep the last of two equal keys.
json parse_header(std::string_view text, const std::string& file) {
  std::vector<std::set<std::string>> keys;  // of the objects that are open
  const auto check = [&](int, json::parse_event_t event, json& value) {
    if (event == json::parse_event_t::object_start) {
      keys.emplace_back();
    } else if (event == json::parse_event_t::object_end) {
      keys.pop_back();
    } else if (event == json::parse_event_t::key) {
      const auto& key = value.get_ref<const std::string&>();
      if (!keys.back().insert(key).second) refuse(file, "header has key " + shown(key) + " twice");
    }
    return true;
  };
  try {
    json header = json::parse(text, check);
    if (!header.is_object()) refuse(file, "header is not a JSON object");
    return header;
  } catch (const json::parse_error& error) {
    refuse(file, "header is not valid JSON (at byte " + std::to_string(error.byte) + ")");
  } catch (const json::exception&) {
    refuse(file, "header holds a number that is out of range");
  }
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
                             std::span<const std::byte> data, const std::string& file) {
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
  const auto known = find_dtype(dtype.get_ref<const std::string&>());
  if (!known) fail("has unknown dtype " + shown(dtype.get_ref<const std::string&>()));
  entry.dtype = *known;

  const json& shape = field("shape");
  if (!shape.is_array()) fail("has a shape that is not a list");
  std::uint64_t size = dtype_size(entry.dtype);
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
  if (end > data.size()) {
    fail("has data_offsets " + range + " beyond the " + std::to_string(data.size()) +
         " bytes of data in the file");
  }
  if (end - begin != size) {
    fail("has data_offsets " + range + ", but " + std::string(dtype_name(entry.dtype)) + " " +
         entry.shape_str() + " takes " + std::to_string(size) + " bytes");
  }
  entry.bytes = data.subspan(begin, size);
  return entry;
}

}  // namespace

std::string_view dtype_name(DType dtype) {
  return kDTypes.at(static_cast<std::size_t>(dtype)).name;
}
std::size_t dtype_size(DType dtype) { return kDTypes.at(static_cast<std::size_t>(dtype)).size; }

std::string SafetensorsEntry::shape_str() const {
  std::string text = "[";
  for (const std::uint64_t extent : shape) {
    if (text.size() > 1) text += ",";
    text += std::to_string(extent);
  }
  return text + "]";
}

// A file mapped read-only for the life of the object.
class Safetensors::Mapping {
 public:
  explicit Mapping(const std::string& path) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) refuse(path, std::string("cannot be opened: ") + std::strerror(errno));
    struct stat status {};
    const bool regular = ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
    size_ = regular ? static_cast<std::size_t>(status.st_size) : 0;
    if (size_ > 0) address_ = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, descriptor, 0);
    const int cause = errno;
    ::close(descriptor);
    if (!regular) refuse(path, "is not a regular file");
    if (size_ == 0) refuse(path, "is empty, expected a safetensors file");
    if (address_ == MAP_FAILED) {
      throw std::runtime_error(path + ": cannot be mapped into memory: " + std::strerror(cause));
    }
  }
  ~Mapping() { ::munmap(address_, size_); }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;

  std::span<const std::byte> bytes() const {
    return {static_cast<const std::byte*>(address_), size_};
  }

 private:
  void* address_ = nullptr;
  std::size_t size_ = 0;
};

Safetensors::Safetensors(const std::filesystem::path& path)
    : name_(path.string()), mapping_(std::make_unique<Mapping>(name_)) {
  parse(mapping_->bytes());
}

Safetensors::Safetensors(std::span<const std::byte> file, std::string name)
    : name_(std::move(name)) {
  parse(file);
}

Safetensors::~Safetensors() = default;
Safetensors::Safetensors(Safetensors&&) noexcept = default;
Safetensors& Safetensors::operator=(Safetensors&&) noexcept = default;

void Safetensors::parse(std::span<const std::byte> file) {
  if (file.size() < kLengthBytes) {
    refuse(name_,
           "is " + std::to_string(file.size()) + " bytes long, too short for a safetensors file");
  }
  std::uint64_t length = 0;
  std::memcpy(&length, file.data(), kLengthBytes);
  file = file.subspan(kLengthBytes);
  if (length > kMaxHeader) {
    refuse(name_, "header length is " + std::to_string(length) + ", expected at most " +
                      std::to_string(kMaxHeader) + " (not a safetensors file?)");
  }
  if (length > file.size()) {
    refuse(name_, "header length is " + std::to_string(length) + ", but only " +
                      std::to_string(file.size()) + " bytes follow");
  }
  const std::string_view text(reinterpret_cast<const char*>(file.data()), length);
  const std::span<const std::byte> data = file.subspan(length);

  const json header = parse_header(text, name_);
  for (const auto& [key, value] : header.items()) {
    if (key == "__metadata__") {
      metadata_ = parse_metadata(value, name_);
    } else {
      tensors_.push_back(parse_entry(key, value, data, name_));
    }
  }

  const auto begin = [&](const SafetensorsEntry& entry) {
    return entry.bytes.data() - data.data();
  };
  // Empty tensors come before the one that starts where they lie.
  std::stable_sort(tensors_.begin(), tensors_.end(), [&](const auto& a, const auto& b) {
    return std::pair(begin(a), a.bytes.size()) < std::pair(begin(b), b.bytes.size());
  });
  std::ptrdiff_t covered = 0;
  for (const SafetensorsEntry& entry : tensors_) {
    if (begin(entry) != covered) {
      refuse(name_, entry.name,
             "starts at byte " + std::to_string(begin(entry)) + " of the data, expected " +
                 std::to_string(covered) +
                 (begin(entry) < covered ? " (it overlaps the tensor before it)"
                                         : " (there is a hole before it)"));
    }
    covered += static_cast<std::ptrdiff_t>(entry.bytes.size());
    index_.emplace(entry.name, index_.size());
  }
  if (static_cast<std::size_t>(covered) != data.size()) {
    refuse(name_, "holds " + std::to_string(data.size()) +
                      " bytes of data, but its tensors end at " + std::to_string(covered));
  }
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
           "has shape " + shown(entry.shape_str()) + ", expected " + expected.shape_str());
  }
  return entry;
}

namespace {

// Values may lie at any byte, so they are copied out one by one (which compiles to plain loads).
template <typename T, typename Convert>
void convert(const std::byte* bytes, std::span<float> out, Convert to_float) {
  for (std::size_t i = 0; i < out.size(); ++i) {
    T value;
    std::memcpy(&value, bytes + i * sizeof(T), sizeof(T));
    out[i] = to_float(value);
  }
}

}  // namespace

void Safetensors::read_floats(const SafetensorsEntry& entry, std::span<float> out,
                              std::uint64_t first) const {
  if (first > entry.count() || out.size() > entry.count() - first) {
    refuse(name_, entry.name,
           "has " + std::to_string(entry.count()) + " values, asked for " +
               std::to_string(out.size()) + " from " + std::to_string(first));
  }
  const std::byte* bytes = entry.bytes.data() + first * dtype_size(entry.dtype);
  switch (entry.dtype) {
    case DType::f32:
      if (!out.empty()) std::memcpy(out.data(), bytes, out.size_bytes());
      return;
    case DType::f16:
      return convert<std::uint16_t>(bytes, out, half_to_float);
    case DType::bf16:
      return convert<std::uint16_t>(bytes, out, bfloat16_to_float);
    case DType::f64:
      return convert<double>(bytes, out, [](double v) { return static_cast<float>(v); });
    case DType::i8:
      return convert<std::int8_t>(bytes, out, [](std::int8_t v) { return static_cast<float>(v); });
    default:
      refuse(name_, entry.name,
             "has dtype " + std::string(dtype_name(entry.dtype)) +
                 ", expected F32, F16, BF16, F64 or I8");
  }
}

std::vector<std::uint64_t> Safetensors::read_integers(std::string_view tensor) const {
  const SafetensorsEntry& entry = at(tensor);
  if (entry.dtype != DType::u64 && entry.dtype != DType::i64) {
    refuse(name_, tensor,
           "has dtype " + std::string(dtype_name(entry.dtype)) + ", expected U64 or I64");
  }
  std::vector<std::uint64_t> values(entry.count());
  if (!values.empty()) std::memcpy(values.data(), entry.bytes.data(), entry.bytes.size());
  return values;
}

}  // namespace sdmt::io

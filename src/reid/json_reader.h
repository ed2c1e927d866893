// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <cstdint>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "sdmt/io/checked_value.h"

namespace sdmt::reid {

// A JSON object being read; knows where it stands for messages.
class JsonReader {
 public:
  JsonReader(const nlohmann::json& object, std::string where)
      : object_(object), where_(std::move(where)) {
    if (!object.is_object()) fail("", "is not a JSON object");
  }

  bool has(const char* key) const { return object_.contains(key); }
  JsonReader object(const char* key) const { return {value(key), where_ + key + "."}; }

  template <typename T>
  T get(const char* key) const {
    return convert<T>(key, value(key));
  }
  template <typename T>
  T get(const char* key, T fallback) const {
    return has(key) ? get<T>(key) : std::move(fallback);
  }
  template <typename T, std::size_t size>
  std::array<T, size> get_list(const char* key) const {
    const nlohmann::json& list = value(key);
    if (!list.is_array() || list.size() != size) {
      fail(key, "is not a list of " + std::to_string(size) + " numbers");
    }
    std::array<T, size> numbers{};
    for (std::size_t i = 0; i < size; ++i) numbers[i] = convert<T>(key, list[i]);
    return numbers;
  }
  std::vector<std::string> get_texts(const char* key) const {
    if (!value(key).is_array()) fail(key, "is not a list of texts");
    std::vector<std::string> texts;
    for (const nlohmann::json& text : value(key)) texts.push_back(convert<std::string>(key, text));
    return texts;
  }
  std::map<std::string, double> get_numbers(const char* key) const {
    if (!value(key).is_object()) fail(key, "is not an object of numbers");
    std::map<std::string, double> numbers;
    for (const auto& [name, number] : value(key).items()) {
      numbers.emplace(name, convert<double>(key, number));
    }
    return numbers;
  }

  [[noreturn]] void fail(const char* key, const std::string& what) const {
    throw std::invalid_argument(where_ + key + " " + io::printable(what, 200));
  }

 private:
  const nlohmann::json& value(const char* key) const {
    if (!has(key)) fail(key, "is missing");
    return object_.at(key);
  }
  template <typename T>
  T convert(const char* key, const nlohmann::json& value) const {
    if constexpr (std::is_same_v<T, std::string>) {
      if (!value.is_string()) fail(key, "is " + value.dump() + ", expected a text");
      return value.get<std::string>();
    } else if constexpr (std::is_same_v<T, bool>) {
      if (!value.is_boolean()) fail(key, "is " + value.dump() + ", expected true or false");
      return value.get<bool>();
    } else if constexpr (std::is_integral_v<T>) {
      const bool fits = value.is_number_integer() && std::in_range<T>(value.get<std::int64_t>()) &&
                        !(value.is_number_unsigned() &&
                          value.get<std::uint64_t>() > std::numeric_limits<std::int64_t>::max());
      if (!fits) fail(key, "is " + value.dump() + ", expected a whole number");
      return value.get<T>();
    } else {
      if (!value.is_number()) fail(key, "is " + value.dump() + ", expected a number");
      return value.get<T>();
    }
  }

  const nlohmann::json& object_;
  std::string where_;  // "model.safetensors: metadata preprocessing."
};

// The double that prints as shortly as the float: 0.229, not 0.2290000021457672. Reads back as the
// same float.
inline double shortest(float value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  double result = 0;
  std::from_chars(text.data(), end, result);
  return result;
}

}  // namespace sdmt::reid

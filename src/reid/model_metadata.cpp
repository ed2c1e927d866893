// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/model_metadata.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "sdmt/io/checked_value.h"
#include "sdmt/io/json_text.h"

namespace sdmt::reid {

namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::string_view kFlattenOrder = "CHW";

// A JSON object being read; knows where it stands for messages.
class Reader {
 public:
  Reader(const json& object, std::string where) : object_(object), where_(std::move(where)) {
    if (!object.is_object()) fail("", "is not a JSON object");
  }

  bool has(const char* key) const { return object_.contains(key); }
  Reader object(const char* key) const { return {value(key), where_ + key + "."}; }

  template <typename T>
  T get(const char* key) const {
    return convert<T>(key, value(key));
  }
  template <typename T>
  T get(const char* key, T fallback) const {
    return has(key) ? get<T>(key) : std::move(fallback);
  }
  std::array<float, 3> get_channels(const char* key) const {
    const json& list = value(key);
    if (!list.is_array() || list.size() != 3) fail(key, "is not a list of 3 numbers");
    std::array<float, 3> channels{};
    for (std::size_t i = 0; i < 3; ++i) channels[i] = convert<float>(key, list[i]);
    return channels;
  }
  std::vector<std::string> get_texts(const char* key) const {
    if (!value(key).is_array()) fail(key, "is not a list of texts");
    std::vector<std::string> texts;
    for (const json& text : value(key)) texts.push_back(convert<std::string>(key, text));
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
  const json& value(const char* key) const {
    if (!has(key)) fail(key, "is missing");
    return object_.at(key);
  }
  template <typename T>
  T convert(const char* key, const json& value) const {
    if constexpr (std::is_same_v<T, std::string>) {
      if (!value.is_string()) fail(key, "is " + value.dump() + ", expected a text");
      return value.get<std::string>();
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

  const json& object_;
  std::string where_;  // "model.safetensors: metadata preprocessing."
};

// The double that prints as shortly as the float: 0.229, not 0.2290000021457672. Reads back as the
// same float.
double shortest(float value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  double result = 0;
  std::from_chars(text.data(), end, result);
  return result;
}

ordered_json channels(const std::array<float, 3>& values) {
  return {shortest(values[0]), shortest(values[1]), shortest(values[2])};
}

image::Preprocessing read_preprocessing(const Reader& reader) {
  image::Preprocessing preprocessing;
  preprocessing.height = reader.get<int>("height");
  preprocessing.width = reader.get<int>("width");
  const auto order = reader.get<std::string>("channel_order");
  if (order != "rgb" && order != "bgr") {
    reader.fail("channel_order", "is \"" + order + "\", expected \"rgb\" or \"bgr\"");
  }
  preprocessing.order = order == "rgb" ? image::ChannelOrder::rgb : image::ChannelOrder::bgr;
  preprocessing.mean = reader.get_channels("mean");
  preprocessing.std = reader.get_channels("std");
  return preprocessing;
}

AffinityThreshold read_threshold(const Reader& reader) {
  AffinityThreshold threshold;
  threshold.value = reader.get<double>("value");
  threshold.criterion = reader.get<std::string>("criterion", "manual");
  if (reader.has("false_positive_rate")) {
    threshold.false_positive_rate = reader.get<double>("false_positive_rate");
  }
  return threshold;
}

TrainingSummary read_training(const Reader& reader) {
  TrainingSummary training;
  if (reader.has("datasets")) training.datasets = reader.get_texts("datasets");
  training.iterations = reader.get<std::int64_t>("iterations", 0);
  training.loss = reader.get<std::string>("loss", "");
  if (reader.has("scores")) training.scores = reader.get_numbers("scores");
  return training;
}

[[noreturn]] void refuse(const std::string& field, const std::string& value,
                         const std::string& expected) {
  throw std::invalid_argument("metadata " + field + " is " + value + ", expected " + expected);
}

}  // namespace

void ModelMetadata::validate() const {
  if (format_version < 1 || format_version > kFormatVersion) {
    refuse("format_version", std::to_string(format_version),
           "1 to " + std::to_string(kFormatVersion) + " (a newer sdmt can read it)");
  }
  if (architecture != kArchitecture) {
    refuse("architecture", "\"" + architecture + "\"", "\"" + std::string(kArchitecture) + "\"");
  }
  preprocessing.validate();
  if (flatten_order != kFlattenOrder) {
    refuse("flatten_order", "\"" + flatten_order + "\"", "\"" + std::string(kFlattenOrder) + "\"");
  }
  if (!(margin > 0) || !std::isfinite(margin)) refuse("margin", std::to_string(margin), "> 0");
  if (tau_a) {
    if (!(tau_a->value >= -1 && tau_a->value <= 1)) {
      refuse("tau_a.value", std::to_string(tau_a->value), "-1 to 1");
    }
    const auto fpr = tau_a->false_positive_rate;
    if (fpr && !(*fpr >= 0 && *fpr <= 1)) {
      refuse("tau_a.false_positive_rate", std::to_string(*fpr), "0 to 1");
    }
  }
  if (training) {
    if (training->iterations < 0) {
      refuse("training.iterations", std::to_string(training->iterations), ">= 0");
    }
    for (const auto& [name, score] : training->scores) {
      if (!std::isfinite(score)) {
        refuse("training.scores." + name, std::to_string(score), "a finite number");
      }
    }
  }
}

std::string to_json(const ModelMetadata& metadata) {
  const image::Preprocessing& p = metadata.preprocessing;
  ordered_json object;
  object["format_version"] = metadata.format_version;
  object["architecture"] = metadata.architecture;
  object["preprocessing"] = {{"height", p.height},
                             {"width", p.width},
                             {"channel_order", p.order == image::ChannelOrder::rgb ? "rgb" : "bgr"},
                             {"mean", channels(p.mean)},
                             {"std", channels(p.std)}};
  object["flatten_order"] = metadata.flatten_order;
  object["margin"] = metadata.margin;
  if (metadata.tau_a) {
    auto& tau_a = object["tau_a"];
    tau_a = {{"value", metadata.tau_a->value}, {"criterion", metadata.tau_a->criterion}};
    if (metadata.tau_a->false_positive_rate) {
      tau_a["false_positive_rate"] = *metadata.tau_a->false_positive_rate;
    }
  }
  if (metadata.training) {
    object["training"] = {{"datasets", metadata.training->datasets},
                          {"iterations", metadata.training->iterations},
                          {"loss", metadata.training->loss},
                          {"scores", metadata.training->scores}};
  }
  object["provenance"] = metadata.provenance;
  // Texts that are no UTF-8 (a dataset's folder name) must not make saving fail.
  return object.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

ModelMetadata parse_model_metadata(std::string_view text, const std::string& source) {
  io::check_json(text, source + ": metadata");
  const json object = json::parse(text);
  const Reader reader(object, source + ": metadata ");

  ModelMetadata metadata;
  metadata.format_version = reader.get<int>("format_version");
  metadata.architecture = reader.get<std::string>("architecture");
  metadata.preprocessing = read_preprocessing(reader.object("preprocessing"));
  metadata.flatten_order = reader.get<std::string>("flatten_order", metadata.flatten_order);
  metadata.margin = reader.get<double>("margin", metadata.margin);
  if (reader.has("tau_a")) metadata.tau_a = read_threshold(reader.object("tau_a"));
  if (reader.has("training")) metadata.training = read_training(reader.object("training"));
  metadata.provenance = reader.get<std::string>("provenance", "");
  try {
    metadata.validate();
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(source + ": " + error.what());
  }
  return metadata;
}

}  // namespace sdmt::reid

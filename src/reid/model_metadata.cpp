// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/model_metadata.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "json_reader.h"
#include "network_description_json.h"
#include "sdmt/io/json_text.h"
#include "sdmt/reid/architectures.h"

namespace sdmt::reid {

namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::string_view kFlattenOrder = "CHW";

ordered_json channels(const std::array<float, 3>& values) {
  return {shortest(values[0]), shortest(values[1]), shortest(values[2])};
}

image::Preprocessing read_preprocessing(const JsonReader& reader) {
  image::Preprocessing preprocessing;
  preprocessing.height = reader.get<int>("height");
  preprocessing.width = reader.get<int>("width");
  const auto order = reader.get<std::string>("channel_order");
  if (order != "rgb" && order != "bgr") {
    reader.fail("channel_order", "is \"" + order + "\", expected \"rgb\" or \"bgr\"");
  }
  preprocessing.order = order == "rgb" ? image::ChannelOrder::rgb : image::ChannelOrder::bgr;
  preprocessing.mean = reader.get_list<float, 3>("mean");
  preprocessing.std = reader.get_list<float, 3>("std");
  return preprocessing;
}

AffinityThreshold read_threshold(const JsonReader& reader) {
  AffinityThreshold threshold;
  threshold.value = reader.get<double>("value");
  threshold.criterion = reader.get<std::string>("criterion", "manual");
  if (reader.has("false_positive_rate")) {
    threshold.false_positive_rate = reader.get<double>("false_positive_rate");
  }
  return threshold;
}

TrainingSummary read_training(const JsonReader& reader) {
  TrainingSummary training;
  if (reader.has("datasets")) training.datasets = reader.get_texts("datasets");
  training.iterations = reader.get<std::int64_t>("iterations", 0);
  training.loss = reader.get<std::string>("loss", "");
  if (reader.has("scores")) training.scores = reader.get_numbers("scores");
  return training;
}

AdaptationSummary read_adaptation(const JsonReader& reader) {
  AdaptationSummary adaptation;
  adaptation.start = reader.get<std::string>("start", "");
  if (reader.has("scenes")) adaptation.scenes = reader.get_texts("scenes");
  adaptation.date = reader.get<std::string>("date", "");
  adaptation.iterations = reader.get<std::int64_t>("iterations", 0);
  if (reader.has("before")) adaptation.before = reader.get_numbers("before");
  if (reader.has("after")) adaptation.after = reader.get_numbers("after");
  return adaptation;
}

[[noreturn]] void refuse(const std::string& field, const std::string& value,
                         const std::string& expected) {
  throw std::invalid_argument("metadata " + field + " is " + value + ", expected " + expected);
}

// Files of the first architecture say its name alone.
std::vector<LayerDescription> layers_of(const std::string& architecture, const json& object,
                                        const JsonReader& reader, const std::string& where) {
  if (reader.has("layers")) return read_layers(object.at("layers"), where);
  NetworkDescription first = vgg16();
  if (architecture != first.name) {
    reader.fail("architecture", "is \"" + architecture + "\" without layers, expected \"" +
                                    first.name + "\" or layers beside it");
  }
  return std::move(first.layers);
}

}  // namespace

ModelMetadata::ModelMetadata() : ModelMetadata(vgg16()) {}

ModelMetadata::ModelMetadata(NetworkDescription network)
    : architecture(std::move(network.name)), layers(std::move(network.layers)) {
  preprocessing.height = network.height;
  preprocessing.width = network.width;
}

NetworkDescription ModelMetadata::network() const {
  return {architecture, preprocessing.height, preprocessing.width, layers};
}

void ModelMetadata::validate() const {
  if (format_version < 1 || format_version > kFormatVersion) {
    refuse("format_version", std::to_string(format_version),
           "1 to " + std::to_string(kFormatVersion) + " (a newer sdmt can read it)");
  }
  preprocessing.validate();
  network().validate();
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
  const auto check_steps = [](const std::string& field, std::int64_t iterations) {
    if (iterations < 0) refuse(field, std::to_string(iterations), ">= 0");
  };
  const auto check_scores = [](const std::string& field,
                               const std::map<std::string, double>& scores) {
    for (const auto& [name, score] : scores) {
      if (!std::isfinite(score)) refuse(field + name, std::to_string(score), "a finite number");
    }
  };
  if (training) {
    check_steps("training.iterations", training->iterations);
    check_scores("training.scores.", training->scores);
  }
  if (adaptation) {
    check_steps("adaptation.iterations", adaptation->iterations);
    check_scores("adaptation.before.", adaptation->before);
    check_scores("adaptation.after.", adaptation->after);
  }
}

std::string to_json(const ModelMetadata& metadata) {
  const image::Preprocessing& p = metadata.preprocessing;
  ordered_json object;
  object["format_version"] = metadata.format_version;
  object["architecture"] = metadata.architecture;
  const NetworkDescription first = vgg16();
  if (metadata.architecture != first.name || metadata.layers != first.layers) {
    object["layers"] = layers_json(metadata.layers);
  }
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
  if (metadata.adaptation) {
    object["adaptation"] = {
        {"start", metadata.adaptation->start},   {"scenes", metadata.adaptation->scenes},
        {"date", metadata.adaptation->date},     {"iterations", metadata.adaptation->iterations},
        {"before", metadata.adaptation->before}, {"after", metadata.adaptation->after}};
  }
  object["provenance"] = metadata.provenance;
  // Texts that are no UTF-8 (a dataset's folder name) must not make saving fail.
  return object.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

ModelMetadata parse_model_metadata(std::string_view text, const std::string& source) {
  io::check_json(text, source + ": metadata");
  const json object = json::parse(text);
  const JsonReader reader(object, source + ": metadata ");

  ModelMetadata metadata;
  metadata.format_version = reader.get<int>("format_version");
  metadata.architecture = reader.get<std::string>("architecture");
  metadata.layers = layers_of(metadata.architecture, object, reader, source + ": metadata ");
  metadata.preprocessing = read_preprocessing(reader.object("preprocessing"));
  metadata.flatten_order = reader.get<std::string>("flatten_order", metadata.flatten_order);
  metadata.margin = reader.get<double>("margin", metadata.margin);
  if (reader.has("tau_a")) metadata.tau_a = read_threshold(reader.object("tau_a"));
  if (reader.has("training")) metadata.training = read_training(reader.object("training"));
  if (reader.has("adaptation")) metadata.adaptation = read_adaptation(reader.object("adaptation"));
  metadata.provenance = reader.get<std::string>("provenance", "");
  try {
    metadata.validate();
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(source + ": " + error.what());
  }
  return metadata;
}

}  // namespace sdmt::reid

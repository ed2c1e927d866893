// SPDX-License-Identifier: Apache-2.0
#include "network_description_json.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <stdexcept>
#include <string>

#include "json_reader.h"
#include "sdmt/io/json_text.h"
#include "sdmt/reid/network_description.h"

namespace sdmt::reid {

namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::array kTypes = {
    LayerType::conv2d, LayerType::batch_norm2d, LayerType::instance_norm2d,
    LayerType::relu,   LayerType::max_pool2d,   LayerType::avg_pool2d,
    LayerType::linear, LayerType::batch_norm1d, LayerType::l2_normalize};
constexpr int kPool = 2;  // kernel and stride of MaxPool2d

LayerType read_type(const JsonReader& reader) {
  const auto name = reader.get<std::string>("type");
  std::string known;
  for (const LayerType type : kTypes) {
    if (name == layer_type_name(type)) return type;
    known += (known.empty() ? "" : ", ") + std::string(layer_type_name(type));
  }
  reader.fail("type", "is \"" + name + "\", expected one of " + known);
}

// A key that nobody reads would be a wish not granted.
void refuse_other_keys(const JsonReader& reader, const json& object,
                       std::initializer_list<const char*> known) {
  for (const auto& [key, value] : object.items()) {
    const bool common = key == "name" || key == "type" || key == "stored_as";
    const bool found = std::any_of(known.begin(), known.end(),
                                   [&key = key](const char* name) { return key == name; });
    if (!common && !found) {
      reader.fail(key.c_str(), "is not known for a layer of this type (" +
                                   object.value("type", std::string()) + ")");
    }
  }
}

LayerDescription read_layer(const json& object, const std::string& where) {
  const JsonReader reader(object, where);
  LayerDescription layer;
  layer.type = read_type(reader);
  layer.name = reader.get<std::string>("name");
  layer.stored_as = reader.get<std::string>("stored_as", "");
  switch (layer.type) {
    case LayerType::conv2d:
      refuse_other_keys(reader, object,
                        {"out_channels", "kernel_size", "stride", "padding", "bias"});
      layer.out_channels = reader.get<int>("out_channels");
      layer.kernel_size = reader.get<int>("kernel_size");
      layer.stride = reader.get<int>("stride", layer.stride);
      layer.padding = reader.get<int>("padding", layer.padding);
      layer.bias = reader.get<bool>("bias", layer.bias);
      break;
    case LayerType::linear:
      refuse_other_keys(reader, object, {"out_features", "bias"});
      layer.out_features = reader.get<int>("out_features");
      layer.bias = reader.get<bool>("bias", layer.bias);
      break;
    case LayerType::batch_norm1d:
    case LayerType::batch_norm2d:
    case LayerType::instance_norm2d:
      refuse_other_keys(reader, object, {"initial_gamma", "initial_beta"});
      layer.initial_gamma = reader.get<float>("initial_gamma", layer.initial_gamma);
      layer.initial_beta = reader.get<float>("initial_beta", layer.initial_beta);
      break;
    case LayerType::max_pool2d:
      refuse_other_keys(reader, object, {"kernel_size", "stride"});
      for (const char* key : {"kernel_size", "stride"}) {
        const int value = reader.get<int>(key, kPool);
        if (value != kPool) reader.fail(key, "is " + std::to_string(value) + ", expected 2");
      }
      break;
    case LayerType::avg_pool2d: {
      refuse_other_keys(reader, object, {"kernel_size"});
      const auto [height, width] = reader.get_list<int, 2>("kernel_size");
      layer.block_height = height;
      layer.block_width = width;
      break;
    }
    default:
      refuse_other_keys(reader, object, {});
  }
  return layer;
}

ordered_json layer_json(const LayerDescription& layer) {
  ordered_json object{{"name", layer.name}, {"type", layer_type_name(layer.type)}};
  if (!layer.stored_as.empty()) object["stored_as"] = layer.stored_as;
  switch (layer.type) {
    case LayerType::conv2d:
      object["out_channels"] = layer.out_channels;
      object["kernel_size"] = layer.kernel_size;
      object["stride"] = layer.stride;
      object["padding"] = layer.padding;
      object["bias"] = layer.bias;
      break;
    case LayerType::linear:
      object["out_features"] = layer.out_features;
      object["bias"] = layer.bias;
      break;
    case LayerType::batch_norm1d:
    case LayerType::batch_norm2d:
    case LayerType::instance_norm2d:
      object["initial_gamma"] = shortest(layer.initial_gamma);
      object["initial_beta"] = shortest(layer.initial_beta);
      break;
    case LayerType::avg_pool2d:
      object["kernel_size"] = {layer.block_height, layer.block_width};
      break;
    default:
      break;
  }
  return object;
}

}  // namespace

ordered_json layers_json(const std::vector<LayerDescription>& layers) {
  ordered_json list = ordered_json::array();
  for (const LayerDescription& layer : layers) list.push_back(layer_json(layer));
  return list;
}

std::vector<LayerDescription> read_layers(const json& list, const std::string& where) {
  if (!list.is_array()) throw std::invalid_argument(where + "layers is not a list");
  std::vector<LayerDescription> layers;
  for (const json& object : list) {
    layers.push_back(read_layer(object, where + "layers[" + std::to_string(layers.size()) + "]."));
  }
  return layers;
}

std::string to_json(const NetworkDescription& network) {
  std::string text = "{\"name\": " + json(network.name).dump() +
                     ", \"input\": {\"height\": " + std::to_string(network.height) +
                     ", \"width\": " + std::to_string(network.width) + "}, \"layers\": [";
  const char* separator = "\n  ";
  for (const LayerDescription& layer : network.layers) {
    text += separator + layer_json(layer).dump();
    separator = ",\n  ";
  }
  return text + "]}\n";
}

NetworkDescription parse_network_description(std::string_view text, const std::string& source) {
  io::check_json(text, source + ":");
  const json object = json::parse(text);
  const JsonReader reader(object, source + ": ");
  NetworkDescription network;
  network.name = reader.get<std::string>("name");
  const JsonReader input = reader.object("input");
  network.height = input.get<int>("height");
  network.width = input.get<int>("width");
  if (!reader.has("layers")) reader.fail("layers", "is missing");
  network.layers = read_layers(object.at("layers"), source + ": ");
  try {
    network.validate();
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(source + ": " + error.what());
  }
  return network;
}

}  // namespace sdmt::reid

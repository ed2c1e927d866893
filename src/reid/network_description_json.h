// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sdmt/reid/network_description.h"

namespace sdmt::reid {

// The list "layers" of a network's description and of a model file's metadata. read_layers()
// throws std::invalid_argument beginning with `where`; it does not validate() the network.
nlohmann::ordered_json layers_json(const std::vector<LayerDescription>& layers);
std::vector<LayerDescription> read_layers(const nlohmann::json& list, const std::string& where);

}  // namespace sdmt::reid

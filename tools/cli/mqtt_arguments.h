// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "mqtt/publisher.h"

namespace sdmt::tools {

/// Where messages go, as the command line describes it.
struct MqttArguments {
  std::string url;  // empty: nowhere
  std::string authorities, certificate, key;
  std::string password_file;
  std::string folder;
  std::string bound;

  /// What they come to; messages wait in `folder` where nothing else is said. The password is that
  /// of the URL, of the file, or of the environment's SDMT_MQTT_PASSWORD. Throws
  /// std::invalid_argument for anything that is wrong; `warn` takes what is not wise.
  PublisherOptions resolve(const std::string& default_folder,
                           const std::function<void(const std::string&)>& warn) const;
};

/// Adds --mqtt and what belongs to it.
void add_mqtt_arguments(CLI::App& command, MqttArguments& arguments);

}  // namespace sdmt::tools

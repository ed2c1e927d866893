// SPDX-License-Identifier: Apache-2.0
#include "cli/mqtt_arguments.h"

#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "sdmt/io/checked_value.h"
#include "sdmt/pipeline/line_output.h"

namespace sdmt::tools {

namespace {

constexpr const char* kPasswordVariable = "SDMT_MQTT_PASSWORD";

std::string first_line(const std::string& file) {
  std::ifstream stream(file);
  std::string line;
  if (!std::getline(stream, line)) {
    throw std::invalid_argument("--mqtt-password-file: " + io::quoted(file) +
                                " cannot be read, expected a file with the password in a line");
  }
  return line;
}

}  // namespace

PublisherOptions MqttArguments::resolve(const std::string& default_folder,
                                        const std::function<void(const std::string&)>& warn) const {
  PublisherOptions options;
  BrokerAddress& broker = options.broker = BrokerAddress::parse(url);
  if (!password_file.empty()) {
    broker.password = first_line(password_file);
  } else if (const char* const password = std::getenv(kPasswordVariable);
             password != nullptr && broker.password.empty()) {
    broker.password = password;
  }
  if (!broker.password.empty() && broker.user.empty()) {
    throw std::invalid_argument("--mqtt: there is a password, expected its user in the URL");
  }
  if (!broker.encrypted && !(authorities + certificate + key).empty()) {
    throw std::invalid_argument("--mqtt: there are certificates, expected a mqtts:// URL");
  }
  if (certificate.empty() != key.empty()) {
    throw std::invalid_argument("--mqtt-certificate and --mqtt-key go together, expected both");
  }
  if (!broker.encrypted && !broker.password.empty() && !broker.is_loopback()) {
    warn("--mqtt: the password goes over the network as it is; mqtts:// encrypts");
  }
  options.authorities = authorities;
  options.certificate = certificate;
  options.key = key;
  options.folder = folder.empty() ? default_folder : folder;
  if (!bound.empty()) {
    options.bound = pipeline::Rotation::parse(bound, "--mqtt-queue-size").bytes;
    if (options.bound < 1'000'000) {
      io::refuse_value("--mqtt-queue-size", bound, "a size from 1MB");
    }
  }
  return options;
}

void add_mqtt_arguments(CLI::App& command, MqttArguments& arguments) {
  CLI::Option* const url =
      command
          .add_option("--mqtt", arguments.url,
                      "Send finished frames, events and health to this broker: "
                      "mqtt://HOST or mqtts://, with USER:PASSWORD@, :PORT and /TOPIC where wanted "
                      "(docs/mqtt.md)")
          ->type_name("URL");
  const auto add = [&](const char* name, std::string& value, const char* type, const char* help) {
    command.add_option(name, value, help)->type_name(type)->needs(url);
  };
  add("--mqtt-ca", arguments.authorities, "FILE",
      "Certificates that are trusted, PEM [the system's]");
  add("--mqtt-certificate", arguments.certificate, "FILE", "Our own certificate, PEM");
  add("--mqtt-key", arguments.key, "FILE", "Its key, PEM");
  add("--mqtt-password-file", arguments.password_file, "FILE",
      "The password, in a line [environment SDMT_MQTT_PASSWORD]");
  add("--mqtt-queue", arguments.folder, "DIR",
      "Where messages wait while the broker is away [mqtt-queue, in --output-dir or here]");
  add("--mqtt-queue-size", arguments.bound, "SIZE",
      "How much may wait; then the oldest go [100MB]");
}

}  // namespace sdmt::tools

// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "mqtt/publisher.h"

namespace sdmt::tools {

struct Publisher::Client {};

Publisher::Publisher(PublisherOptions, std::vector<const CameraView*>,
                     std::function<void(const std::string&)>) {
  throw std::invalid_argument(
      "--mqtt: this sdmt was built without MQTT; expected one built where libmosquitto-dev is "
      "installed");
}
Publisher::~Publisher() = default;
void Publisher::send_frame(const std::string&, std::string_view) {}
void Publisher::send_event(const std::string&, std::string_view) {}

}  // namespace sdmt::tools

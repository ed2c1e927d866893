// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "sdmt/io/checked_value.h"
#include "serve/status_server.h"

namespace sdmt::tools {

ServeAddress ServeAddress::parse(const std::string& text) {
  ServeAddress address;
  const auto colon = text.rfind(':');
  std::string port = text;
  if (colon != std::string::npos) {
    port = text.substr(colon + 1);
    address.host = text.substr(0, colon);
    if (address.host.starts_with('[') && address.host.ends_with(']')) {
      address.host = address.host.substr(1, address.host.size() - 2);
    }
  }
  const auto number = io::parse_number<int>(port);
  if (!number || *number < 0 || *number > 65535 || address.host.empty()) {
    throw std::invalid_argument("--serve is " + io::quoted(text) +
                                ", expected PORT (this machine alone) or ADDRESS:PORT");
  }
  address.port = *number;
  return address;
}

}  // namespace sdmt::tools

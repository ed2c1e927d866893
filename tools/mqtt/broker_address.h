// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace sdmt::tools {

/// What --mqtt names: mqtt[s]://[USER[:PASSWORD]@]HOST[:PORT][/TOPIC...].
struct BrokerAddress {
  std::string name;  ///< for messages: without user and password
  bool encrypted = false;
  std::string host;
  int port = 1883;             ///< 8883 where encrypted
  std::string user, password;  ///< "%XX" stands for a byte
  std::string topic = "sdmt";  ///< under which everything is published

  bool is_loopback() const { return host == "localhost" || host == "127.0.0.1" || host == "::1"; }
  /// Throws std::invalid_argument for anything else; the message holds no password.
  static BrokerAddress parse(const std::string& url);
};

}  // namespace sdmt::tools

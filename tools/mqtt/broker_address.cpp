// SPDX-License-Identifier: Apache-2.0
#include "mqtt/broker_address.h"

#include <charconv>
#include <stdexcept>
#include <string_view>

#include "sdmt/io/checked_value.h"
#include "sdmt/pipeline/frame_source.h"

namespace sdmt::tools {

namespace {

std::string without_escapes(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned byte = 0;
    const char* const digits = text.data() + i + 1;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2) {
      plain += static_cast<char>(byte);
      i += 2;
    } else {
      plain += text[i];
    }
  }
  return plain;
}

}  // namespace

BrokerAddress BrokerAddress::parse(const std::string& url) {
  BrokerAddress address;
  address.name = pipeline::display_name(url);
  const auto refuse = [&](const char* expected) {
    throw std::invalid_argument("--mqtt is " + io::quoted(address.name) + ", expected " + expected);
  };
  std::string_view rest = url;
  address.encrypted = rest.starts_with("mqtts://");
  if (!address.encrypted && !rest.starts_with("mqtt://")) {
    refuse("mqtt://HOST or mqtts://HOST, with [USER[:PASSWORD]@]HOST[:PORT][/TOPIC]");
  }
  rest.remove_prefix(rest.find("://") + 3);
  // A password may hold any character, so the last @ ends it.
  if (const auto at = rest.rfind('@'); at != std::string_view::npos) {
    const auto user = rest.substr(0, at);
    const auto colon = user.find(':');
    address.user = without_escapes(user.substr(0, colon));
    if (colon != std::string_view::npos) {
      address.password = without_escapes(user.substr(colon + 1));
    }
    rest.remove_prefix(at + 1);
  }
  if (const auto slash = rest.find('/'); slash != std::string_view::npos) {
    if (slash + 1 < rest.size()) address.topic = rest.substr(slash + 1);
    while (address.topic.ends_with('/')) address.topic.pop_back();
    rest = rest.substr(0, slash);
  }
  const bool bad_topic = address.topic.find_first_of("+#\t\n") != std::string::npos;
  if (address.topic.empty() || address.topic.size() > 1000 || bad_topic) {
    refuse("a topic without + and #");
  }
  address.port = address.encrypted ? 8883 : 1883;
  const auto colon = rest.rfind(':');
  if (colon != std::string_view::npos && rest.find(']', colon) == std::string_view::npos) {
    const auto port = io::parse_number<int>(rest.substr(colon + 1));
    if (!port || *port < 1 || *port > 65535) refuse("a port in 1..65535");
    address.port = *port;
    rest = rest.substr(0, colon);
  }
  if (rest.starts_with('[') && rest.ends_with(']')) rest = rest.substr(1, rest.size() - 2);
  if (rest.empty()) refuse("a host");
  address.host = rest;
  return address;
}

}  // namespace sdmt::tools

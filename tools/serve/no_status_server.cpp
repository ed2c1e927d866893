// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "serve/status_server.h"

namespace sdmt::tools {

struct StatusServer::Server {};

StatusServer::StatusServer(const ServeAddress&, std::string, std::vector<CameraView*>) {
  throw std::invalid_argument(
      "--serve: this sdmt was built without a web server; expected one built where "
      "libcpp-httplib-dev is installed");
}
StatusServer::~StatusServer() = default;
std::string StatusServer::url() const { return {}; }

}  // namespace sdmt::tools

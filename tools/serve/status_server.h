// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "serve/camera_view.h"

namespace sdmt::tools {

/// Where --serve listens: "8080" (this machine alone), "ADDRESS:PORT", "[IPv6]:PORT".
struct ServeAddress {
  std::string host = "127.0.0.1";
  int port = 0;

  bool is_loopback() const { return host == "127.0.0.1" || host == "::1" || host == "localhost"; }
  /// Throws std::invalid_argument for anything else.
  static ServeAddress parse(const std::string& text);
};

/// A web server for whoever watches cameras:
///   /            a page with all cameras
///   /picture/NAME  the next picture of one, JPEG
///   /video/NAME  the pictures of one, Motion JPEG
///   /state       the state of all, JSON
///   /events      the same once a second, server-sent events
///   /metrics     for Prometheus
///   /healthz     200 while all cameras run, else 503
/// Each viewer of pictures or events has a thread of its own, at most kViewers; further ones get
/// 503. One that takes nothing for kPatience seconds is let go.
class StatusServer {
 public:
  static constexpr int kViewers = 50;
  static constexpr int kPatience = 5;

  /// Listens from now on. `token`: what a request must bring along as `Authorization: Bearer TOKEN`
  /// or `?token=TOKEN`; empty: nothing. The views must outlive it. Throws std::runtime_error when
  /// it cannot listen there, or this program was built without cpp-httplib.
  StatusServer(const ServeAddress& address, std::string token, std::vector<CameraView*> cameras);
  ~StatusServer();
  StatusServer(const StatusServer&) = delete;
  StatusServer& operator=(const StatusServer&) = delete;

  /// Where it listens; of port 0, which one was free.
  std::string url() const;

 private:
  struct Server;
  std::unique_ptr<Server> server_;
};

}  // namespace sdmt::tools

// SPDX-License-Identifier: Apache-2.0
#include "serve/status_server.h"

#include <fmt/core.h>
#include <httplib.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>

#include "cli/broken_pipes.h"
#include "cli/peak_memory.h"
#include "serve/status_page.h"

namespace sdmt::tools {

namespace {

// As long for a wrong token as for the right one.
bool same(std::string_view a, std::string_view b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    difference |= static_cast<unsigned>(a[i] ^ b[i]);
  }
  return difference == 0;
}

}  // namespace

struct StatusServer::Server {
  httplib::Server http;
  std::string host;
  int port = 0;
  std::string token;
  std::vector<CameraView*> cameras;
  std::atomic<int> viewers = 0;
  std::atomic<bool> closing = false;
  std::atomic<bool> ended = false;  // it listens no more, whyever
  std::thread thread;

  bool may_come_in(const httplib::Request& request) const {
    if (token.empty()) return true;
    if (same(request.get_param_value("token"), token)) return true;
    return same(request.get_header_value("Authorization"), "Bearer " + token);
  }
  bool take_place(httplib::Response& response) {
    if (++viewers <= kViewers) return true;
    --viewers;
    response.status = 503;
    response.set_content("too many viewers\n", "text/plain");
    return false;
  }
  std::string state() const {
    std::string text = "{\"version\":1,\"cameras\":[";
    for (const CameraView* camera : cameras) {
      if (camera != cameras.front()) text += ",";
      text += camera->state();
    }
    return text + "]}";
  }
  std::string metrics() const {
    std::string text = fmt::format("sdmt_peak_memory_bytes {:.0f}\nsdmt_viewers {}\n",
                                   peak_rss_mib() * 1024 * 1024, viewers.load());
    for (const CameraView* camera : cameras) text += camera->metrics();
    return text;
  }
  CameraView* find(const std::string& name) const {
    const auto found = std::find_if(cameras.begin(), cameras.end(),
                                    [&](const auto* camera) { return camera->name() == name; });
    return found == cameras.end() ? nullptr : *found;
  }
  void add_routes();
  void show_pictures(CameraView& camera, httplib::Response& response);
  void show_picture(CameraView& camera, httplib::Response& response);
  void show_events(httplib::Response& response);
};

void StatusServer::Server::show_pictures(CameraView& camera, httplib::Response& response) {
  if (!take_place(response)) return;
  camera.viewer_came();
  response.set_header("Cache-Control", "no-store");
  response.set_content_provider(
      "multipart/x-mixed-replace; boundary=frame",
      [this, &camera, after = std::int64_t{0}](std::size_t, httplib::DataSink& sink) mutable {
        if (closing || !camera.is_running()) return false;
        const auto jpeg = camera.picture(after);
        if (jpeg.empty()) return true;
        const std::string head = fmt::format(
            "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n\r\n", jpeg.size());
        return sink.write(head.data(), head.size()) &&
               sink.write(reinterpret_cast<const char*>(jpeg.data()), jpeg.size()) &&
               sink.write("\r\n", 2);
      },
      [this, &camera](bool) {
        camera.viewer_left();
        --viewers;
      });
}

// For pages with many cameras: browsers open few connections to one server.
void StatusServer::Server::show_picture(CameraView& camera, httplib::Response& response) {
  if (!take_place(response)) return;
  camera.viewer_came();
  const auto jpeg = camera.next_picture();
  camera.viewer_left();
  --viewers;
  response.set_header("Cache-Control", "no-store");
  if (!jpeg.empty()) {
    response.set_content(reinterpret_cast<const char*>(jpeg.data()), jpeg.size(), "image/jpeg");
  } else {
    response.status = 404;
    response.set_content("there is no picture\n", "text/plain");
  }
}

void StatusServer::Server::show_events(httplib::Response& response) {
  if (!take_place(response)) return;
  response.set_header("Cache-Control", "no-store");
  response.set_content_provider(
      "text/event-stream",
      [this](std::size_t, httplib::DataSink& sink) {
        const std::string event = "data: " + state() + "\n\n";
        if (!sink.write(event.data(), event.size())) return false;
        for (int i = 0; i < 10 && !closing; ++i) {
          std::this_thread::sleep_for(std::chrono::milliseconds(100));
        }
        return !closing;
      },
      [this](bool) { --viewers; });
}

void StatusServer::Server::add_routes() {
  using httplib::Request, httplib::Response;
  // Health needs no token: it says nothing of anybody.
  http.set_pre_routing_handler([this](const Request& request, Response& response) {
    response.set_header("X-Content-Type-Options", "nosniff");
    if (request.path == "/healthz" || may_come_in(request)) {
      return httplib::Server::HandlerResponse::Unhandled;
    }
    response.status = 401;
    response.set_header("WWW-Authenticate", "Bearer");
    response.set_content("a token is needed\n", "text/plain");
    return httplib::Server::HandlerResponse::Handled;
  });
  http.Get("/", [](const Request&, Response& response) {
    response.set_content(kStatusPage, "text/html; charset=utf-8");
  });
  http.Get("/state", [this](const Request&, Response& response) {
    response.set_content(state(), "application/json");
  });
  http.Get("/metrics", [this](const Request&, Response& response) {
    response.set_content(metrics(), "text/plain; version=0.0.4");
  });
  http.Get("/healthz", [this](const Request&, Response& response) {
    const bool well = std::all_of(cameras.begin(), cameras.end(),
                                  [](const auto* camera) { return camera->is_running(); });
    response.status = well ? 200 : 503;
    response.set_content(well ? "ok\n" : "a camera has ended\n", "text/plain");
  });
  http.Get("/events", [this](const Request&, Response& response) { show_events(response); });
  http.Get(R"(/picture/([^/]+))", [this](const Request& request, Response& response) {
    CameraView* const camera = find(request.matches[1]);
    if (camera != nullptr && camera->has_pictures()) return show_picture(*camera, response);
    response.status = 404;
    response.set_content("there are no pictures of such a camera\n", "text/plain");
  });
  http.Get(R"(/video/([^/]+))", [this](const Request& request, Response& response) {
    CameraView* const camera = find(request.matches[1]);
    if (camera != nullptr && camera->has_pictures()) return show_pictures(*camera, response);
    response.status = 404;
    response.set_content("there are no pictures of such a camera\n", "text/plain");
  });
}

StatusServer::StatusServer(const ServeAddress& address, std::string token,
                           std::vector<CameraView*> cameras)
    : server_(std::make_unique<Server>()) {
  server_->host = address.host;
  server_->token = std::move(token);
  server_->cameras = std::move(cameras);
  server_->add_routes();
  httplib::Server& http = server_->http;
  constexpr int kOthers = 8;  // threads for those who ask and go
  http.new_task_queue = [] { return new httplib::ThreadPool(kViewers + kOthers); };
  http.set_read_timeout(kPatience);
  http.set_write_timeout(kPatience);
  http.set_keep_alive_timeout(1);
  http.set_payload_max_length(1 << 16);
  const bool bound = address.port != 0 && http.bind_to_port(address.host, address.port);
  server_->port = bound               ? address.port
                  : address.port == 0 ? http.bind_to_any_port(address.host)
                                      : 0;
  if (server_->port <= 0) {
    throw std::runtime_error(
        fmt::format("--serve: cannot listen on {}:{}", address.host, address.port));
  }
  server_->thread = std::thread([server = server_.get()] {
    keep_broken_pipes_quiet();
    server->http.listen_after_bind();
    server->ended = true;
  });
}

StatusServer::~StatusServer() {
  server_->closing = true;
  // stop() does nothing before it listens.
  while (!server_->http.is_running() && !server_->ended) std::this_thread::yield();
  server_->http.stop();
  server_->thread.join();
}

std::string StatusServer::url() const {
  const bool v6 = server_->host.find(':') != std::string::npos;
  return fmt::format("http://{}{}{}:{}/", v6 ? "[" : "", server_->host, v6 ? "]" : "",
                     server_->port);
}

}  // namespace sdmt::tools

// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>
#include <omp.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <thread>

#include "cli/camera_names.h"
#include "cli/console.h"
#include "cli/stop_signal.h"
#include "sdmt/io/checked_value.h"
#include "serve/status_server.h"
#include "tracking/track_run.h"

namespace sdmt::tools {

TrackCommand TrackCommand::of_camera(const std::string& one, const std::string& name) const {
  TrackCommand command = *this;
  command.input = one;
  command.camera = name;
  const auto folder = std::filesystem::path(output_dir) / name;
  for_each_output(command, [&](const char* option, std::string& file) {
    if (file.empty()) return;
    if (file == "-" || std::filesystem::path(file).filename() != file) {
      throw std::invalid_argument(std::string(option) + " is " + io::quoted(file) +
                                  ", expected the name of a file in the folders of --output-dir");
    }
    file = folder / file;
  });
  std::filesystem::create_directories(folder);
  return command;
}

void TrackCommand::run_many(const std::vector<Followers>& followers) const {
  if (output_dir.empty()) {
    throw std::invalid_argument(fmt::format(
        "{} inputs are given, expected --output-dir for what they leave", inputs.size()));
  }
  if (detections.detections == "-") {
    throw std::invalid_argument("--detections - is one stream of boxes, expected one input");
  }
  std::vector<TrackCommand> cameras;
  const auto names = camera_names(inputs);
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    cameras.push_back(of_camera(inputs[i], names[i]));
    if (cameras.back().output.empty() && jsonl.empty()) {
      cameras.back().output = std::filesystem::path(output_dir) / names[i] / "tracks.txt";
    }
  }
  const StopSignal stop;
  const auto appearances = tracker.load_appearances([this](const auto& text) { warn(text); });
  // Fair shares of the processor; results do not depend on them.
  const int share = std::max(1, omp_get_max_threads() / static_cast<int>(cameras.size()));
  std::atomic<int> failed = 0;
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    threads.emplace_back(
        [&one = cameras[i], following = followers[i], &appearances, &stop, &failed, share] {
          omp_set_num_threads(share);
          try {
            one.run_one(
                appearances, [&stop] { return stop.requested(); }, following);
          } catch (const std::exception& error) {  // the others go on
            ++failed;
            if (following.view != nullptr) following.view->end();
            say(stderr, "sdmt track: {}{}\n", one.prefix(), error.what());
          }
        });
  }
  for (std::thread& thread : threads) thread.join();
  if (failed > 0) {
    throw std::runtime_error(fmt::format("{} of {} inputs failed", failed.load(), cameras.size()));
  }
}

void TrackCommand::run() const {
  std::vector<std::unique_ptr<CameraView>> views;
  std::vector<CameraView*> shown;
  std::vector<Followers> followers(inputs.size());
  if (!serve.empty() || !mqtt.url.empty()) {
    for (const std::string& name : camera_names(inputs)) {
      views.push_back(std::make_unique<CameraView>(name));
      followers[shown.size()].view = views.back().get();
      shown.push_back(views.back().get());
    }
  }
  std::optional<StatusServer> server;
  if (!serve.empty()) {
    const auto address = ServeAddress::parse(serve);
    server.emplace(address, serve_token, shown);
    note("{}\n", server->url());
    flush_standard_output();
    if (!address.is_loopback() && serve_token.empty()) {
      warn("--serve: whoever reaches " + server->url() + " sees the pictures; give --serve-token");
    }
  }
  std::optional<Publisher> publisher;
  if (!mqtt.url.empty()) {
    const auto tell = [this](const std::string& text) { warn(text); };
    const auto folder = std::filesystem::path(output_dir) / "mqtt-queue";
    publisher.emplace(mqtt.resolve(folder, tell),
                      std::vector<const CameraView*>(shown.begin(), shown.end()), tell);
    for (Followers& each : followers) each.publisher = &*publisher;
  }
  if (inputs.size() > 1 || !output_dir.empty()) return run_many(followers);
  TrackCommand one = *this;
  one.input = inputs.front();
  one.run_one({}, {}, followers.front());
}

}  // namespace sdmt::tools

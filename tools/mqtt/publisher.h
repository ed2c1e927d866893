// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "mqtt/broker_address.h"
#include "serve/camera_view.h"

namespace sdmt::tools {

struct PublisherOptions {
  BrokerAddress broker;     ///< with the password, from wherever it came
  std::string authorities;  ///< file of certificates that are trusted, PEM; empty: the system's
  std::string certificate, key;       ///< our own, PEM; empty: none
  std::filesystem::path folder;       ///< where messages wait
  std::uint64_t bound = 100'000'000;  ///< bytes of them, at least 1e6; a tenth is for events
};

/// Sends messages to an MQTT broker, by a thread of its own:
///   TOPIC/CAMERA/frames  a finished frame
///   TOPIC/CAMERA/events  what happened in a zone
///   TOPIC/CAMERA/status  retained: the camera's CameraView::state(), every kBetweenStates seconds
///   TOPIC/status         retained: whether we are there, by last will too
/// Frames and events wait on the disk until the broker has acknowledged them (QoS 1), also for the
/// next process. They have "run", which each process draws anew, and "seq", their number within
/// the run and topic: a gap tells of dropped ones, and one that is not larger than the last of its
/// run comes a second time. docs/mqtt.md.
class Publisher {
 public:
  static constexpr int kBetweenStates = 10;
  /// Seconds without an acknowledgement after which the end does not wait any longer.
  static constexpr int kPatience = 2;

  /// The views must outlive it; `tell` takes a line for people, from any thread. Throws as
  /// MessageQueue, std::invalid_argument for certificates that cannot be used, or when this program
  /// was built without libmosquitto.
  Publisher(PublisherOptions options, std::vector<const CameraView*> cameras,
            std::function<void(const std::string&)> tell);
  /// Sends what is there, while the broker takes it.
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  /// A JSON object; never waits for the network. From any thread.
  void send_frame(const std::string& camera, std::string_view object);
  void send_event(const std::string& camera, std::string_view object);

 private:
  struct Client;
  std::unique_ptr<Client> client_;
};

}  // namespace sdmt::tools

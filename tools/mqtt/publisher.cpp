// SPDX-License-Identifier: Apache-2.0
#include "mqtt/publisher.h"

#include <fmt/core.h>
#include <mosquitto.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <fstream>
#include <map>
#include <mutex>
#include <random>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "cli/broken_pipes.h"
#include "cli/stop_signal.h"
#include "mqtt/message_queue.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/pipeline/utc_time.h"

namespace sdmt::tools {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::seconds;

constexpr std::size_t kInFlight = 20;  // messages that may be without an acknowledgement
constexpr int kKeepAlive = 10;         // seconds
constexpr seconds kLongestConnecting{10};
constexpr seconds kLongestPause{30};
constexpr int kAtLeastOnce = 1;  // QoS

std::string now() { return pipeline::utc_text(std::chrono::system_clock::now()); }

std::string draw_run() {
  std::random_device device;
  return fmt::format("{:08x}{:08x}", device(), device());
}

void check_readable(const char* option, const std::string& file) {
  if (!file.empty() && !std::ifstream(file)) {
    throw std::invalid_argument(fmt::format("{}: {} cannot be read", option, io::quoted(file)));
  }
}

}  // namespace

struct Publisher::Client {
  Client(PublisherOptions wanted, std::vector<const CameraView*> seen,
         std::function<void(const std::string&)> listener)
      : options(std::move(wanted)),
        cameras(std::move(seen)),
        tell(std::move(listener)),
        events(options.folder / "events", options.bound / 10),
        frames(options.folder / "frames", options.bound / 10 * 9) {
    mosquitto_lib_init();
    try {
      open();  // what is wrong with certificates is said before the work
      close();
      thread = std::thread([this] { run(); });
    } catch (...) {
      close();
      mosquitto_lib_cleanup();
      throw;
    }
  }
  ~Client() {
    {
      const std::lock_guard lock(mutex);
      closing = true;
    }
    changed.notify_all();
    thread.join();
    mosquitto_lib_cleanup();
    if (const auto left = events.waiting() + frames.waiting(); left > 0) {
      say(fmt::format("{} messages wait in {} for the next run", left, options.folder.string()));
    }
  }

  void send(MessageQueue& queue, const std::string& topic, std::string_view object);
  void run();
  void open();
  void close();
  void hold_session();
  void fill();
  void publish_states();
  void remember_arrived();
  bool publish_state(const std::string& topic, const std::string& payload);
  void leave();
  std::string status(bool online) const;
  bool may_end() const;
  void say(const std::string& text) const { tell(options.broker.name + ": " + text); }

  // What the library calls, within mosquitto_loop().
  static void on_connect(mosquitto*, void* self, int code);
  static void on_publish(mosquitto*, void* self, int id);

  PublisherOptions options;
  std::vector<const CameraView*> cameras;
  std::function<void(const std::string&)> tell;
  const std::string run_name = draw_run();

  std::mutex send_mutex;  // of the numbers, and of the order of messages
  std::map<std::string, std::int64_t> numbers;
  bool full = false;
  MessageQueue events, frames;

  std::mutex mutex;
  std::condition_variable changed;
  std::atomic<bool> closing = false;

  // Of the thread.
  struct Sent {
    int id;
    MessageQueue* queue;  // nullptr: a state, which is not kept
    std::int64_t number;
    bool arrived;
  };
  mosquitto* connection = nullptr;
  bool connected = false;
  bool away_told = false;
  std::string refusal;
  std::deque<Sent> sent;
  Clock::time_point progress, states_sent, closing_since;
  std::thread thread;
};

void Publisher::Client::send(MessageQueue& queue, const std::string& topic,
                             std::string_view object) {
  while (object.ends_with('\n')) object.remove_suffix(1);
  const std::lock_guard lock(send_mutex);
  const auto number = ++numbers[topic];
  const bool kept = queue.add(
      topic, fmt::format("{{\"run\":\"{}\",\"seq\":{},{}", run_name, number, object.substr(1)));
  if (kept == !full) return;
  full = !kept;
  say(full ? fmt::format("messages are left out, {}: {} cannot be written", now(),
                         options.folder.string())
           : fmt::format("messages are kept again, {}; {} have been dropped", now(),
                         events.dropped() + frames.dropped()));
}

void Publisher::Client::run() {
  keep_broken_pipes_quiet();
  seconds pause{1};
  for (;;) {
    std::string why;
    try {
      open();
      hold_session();
    } catch (const std::exception& error) {
      why = error.what();
    }
    if (std::exchange(connected, false)) pause = seconds(1);
    close();
    events.rewind();
    frames.rewind();
    if (!why.empty() && !std::exchange(away_told, true)) {
      say(fmt::format("is away, {}: {}; messages wait in {}", now(), why, options.folder.string()));
    }
    std::unique_lock lock(mutex);
    if (changed.wait_for(lock, pause, [&] { return closing.load(); })) return;
    pause = std::min(2 * pause, kLongestPause);
  }
}

void Publisher::Client::open() {
  const BrokerAddress& broker = options.broker;
  connection = mosquitto_new(nullptr, true, this);
  if (connection == nullptr) throw std::bad_alloc();
  mosquitto_connect_callback_set(connection, on_connect);
  mosquitto_publish_callback_set(connection, on_publish);
  mosquitto_int_option(connection, MOSQ_OPT_TCP_NODELAY, 1);
  const std::string will = status(false);
  mosquitto_will_set(connection, (broker.topic + "/status").c_str(), static_cast<int>(will.size()),
                     will.data(), kAtLeastOnce, true);
  if (!broker.user.empty()) {
    mosquitto_username_pw_set(connection, broker.user.c_str(), broker.password.c_str());
  }
  if (!broker.encrypted) return;
  const auto name = [](const std::string& file) { return file.empty() ? nullptr : file.c_str(); };
  int result = mosquitto_int_option(connection, MOSQ_OPT_TLS_USE_OS_CERTS,
                                    options.authorities.empty() ? 1 : 0);
  if (!options.authorities.empty() || !options.certificate.empty()) {
    const char* const folder = options.authorities.empty() ? "/etc/ssl/certs" : nullptr;
    result = mosquitto_tls_set(connection, name(options.authorities), folder,
                               name(options.certificate), name(options.key), nullptr);
  }
  if (result != MOSQ_ERR_SUCCESS) {
    throw std::invalid_argument(std::string("--mqtt: certificates cannot be used: ") +
                                mosquitto_strerror(result));
  }
}

void Publisher::Client::close() {
  if (connection != nullptr) mosquitto_destroy(std::exchange(connection, nullptr));
  sent.clear();
}

void Publisher::Client::on_connect(mosquitto*, void* self, int code) {
  auto& client = *static_cast<Client*>(self);
  client.connected = code == 0;
  if (code != 0) client.refusal = mosquitto_connack_string(code);
}

void Publisher::Client::on_publish(mosquitto*, void* self, int id) {
  auto& client = *static_cast<Client*>(self);
  auto& sent = client.sent;
  const auto found =
      std::find_if(sent.begin(), sent.end(), [id](const Sent& one) { return one.id == id; });
  if (found == sent.end()) return;
  found->arrived = true;
  client.progress = Clock::now();
  client.remember_arrived();
}

void Publisher::Client::remember_arrived() {
  for (; !sent.empty() && sent.front().arrived; sent.pop_front()) {
    if (sent.front().queue != nullptr) sent.front().queue->done(sent.front().number);
  }
}

// Until the broker is lost, which throws, or all is done at the end.
void Publisher::Client::hold_session() {
  refusal.clear();
  const auto began = Clock::now();
  progress = began;
  states_sent = {};
  int result = mosquitto_connect_async(connection, options.broker.host.c_str(), options.broker.port,
                                       kKeepAlive);
  bool greeted = false;
  while (result == MOSQ_ERR_SUCCESS) {
    constexpr int kMilliseconds = 50;
    result = mosquitto_loop(connection, kMilliseconds, 1);
    if (!refusal.empty()) throw std::runtime_error(refusal);
    if (!connected && Clock::now() - began > kLongestConnecting) {
      throw std::runtime_error(fmt::format("no answer within {} s", kLongestConnecting.count()));
    }
    if (connected && !std::exchange(greeted, true) && std::exchange(away_told, false)) {
      say(fmt::format("is back, {}; {} messages waited, {} have been dropped", now(),
                      events.waiting() + frames.waiting(), events.dropped() + frames.dropped()));
    }
    if (closing && closing_since == Clock::time_point{}) closing_since = progress = Clock::now();
    if (connected && result == MOSQ_ERR_SUCCESS) fill();
    if (closing && may_end()) return leave();
  }
  throw std::runtime_error(result == MOSQ_ERR_ERRNO ? std::strerror(errno)
                                                    : mosquitto_strerror(result));
}

bool Publisher::Client::may_end() const {
  const bool all = connected && sent.empty() && events.waiting() + frames.waiting() == 0;
  const bool asked_to_stop = received_stop_signal() != 0;
  const auto since = asked_to_stop ? closing_since : progress;
  return all || Clock::now() - since > seconds(kPatience) || (asked_to_stop && !connected);
}

void Publisher::Client::fill() {
  if (states_sent == Clock::time_point{} || Clock::now() - states_sent > seconds(kBetweenStates)) {
    states_sent = Clock::now();
    publish_states();
  }
  for (MessageQueue* const queue : {&events, &frames}) {
    while (sent.size() < kInFlight) {
      const auto message = queue->next();
      if (!message) break;
      int id = 0;
      const int result = mosquitto_publish(connection, &id, message->topic.c_str(),
                                           static_cast<int>(message->payload.size()),
                                           message->payload.data(), kAtLeastOnce, false);
      if (result == MOSQ_ERR_NO_CONN || result == MOSQ_ERR_CONN_LOST) return;
      // What no broker takes, such as a line that is none of ours, has been tried.
      sent.push_back({id, queue, message->number, result != MOSQ_ERR_SUCCESS});
    }
  }
  remember_arrived();
}

void Publisher::Client::publish_states() {
  publish_state(options.broker.topic + "/status", status(true));
  for (const CameraView* const camera : cameras) {
    publish_state(options.broker.topic + "/" + camera->name() + "/status", camera->state());
  }
}

bool Publisher::Client::publish_state(const std::string& topic, const std::string& payload) {
  int id = 0;
  const bool published =
      mosquitto_publish(connection, &id, topic.c_str(), static_cast<int>(payload.size()),
                        payload.data(), kAtLeastOnce, true) == MOSQ_ERR_SUCCESS;
  if (published) sent.push_back({id, nullptr, 0, false});
  return published;
}

// The end of a run: the last will is for those who are killed.
void Publisher::Client::leave() {
  if (!connected) return;
  for (const CameraView* const camera : cameras) {
    publish_state(options.broker.topic + "/" + camera->name() + "/status", camera->state());
  }
  publish_state(options.broker.topic + "/status", status(false));
  const auto began = Clock::now();
  while (!sent.empty() && Clock::now() - began < seconds(1)) {
    constexpr int kMilliseconds = 50;
    if (mosquitto_loop(connection, kMilliseconds, 1) != MOSQ_ERR_SUCCESS) return;
  }
  mosquitto_disconnect(connection);
}

std::string Publisher::Client::status(bool online) const {
  std::string text = fmt::format("{{\"version\":1,\"status\":\"{}\",\"run\":\"{}\"",
                                 online ? "online" : "offline", run_name);
  if (online) {
    text += fmt::format(",\"utc\":\"{}\",\"waiting\":{},\"dropped\":{}", now(),
                        events.waiting() + frames.waiting(), events.dropped() + frames.dropped());
  }
  return text + "}";
}

Publisher::Publisher(PublisherOptions options, std::vector<const CameraView*> cameras,
                     std::function<void(const std::string&)> tell) {
  check_readable("--mqtt-ca", options.authorities);
  check_readable("--mqtt-certificate", options.certificate);
  check_readable("--mqtt-key", options.key);
  client_ = std::make_unique<Client>(std::move(options), std::move(cameras), std::move(tell));
}

Publisher::~Publisher() {
  const auto folder = client_->options.folder;
  client_.reset();
  std::error_code not_empty;
  std::filesystem::remove(folder, not_empty);
}

void Publisher::send_frame(const std::string& camera, std::string_view object) {
  client_->send(client_->frames, client_->options.broker.topic + "/" + camera + "/frames", object);
}

void Publisher::send_event(const std::string& camera, std::string_view object) {
  client_->send(client_->events, client_->options.broker.topic + "/" + camera + "/events", object);
}

}  // namespace sdmt::tools

// SPDX-License-Identifier: Apache-2.0
// sdmt track on streams: what is said when they break off or never answer.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <thread>

#include "cli/track_scene.h"

namespace sdmt::tests {
namespace {

using testing::HasSubstr;
using testing::Not;

// A TCP server on this machine for one caller.
class Server {
 public:
  Server() : listening_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* any = reinterpret_cast<sockaddr*>(&address);
    if (::bind(listening_, any, size) != 0 || ::listen(listening_, 1) != 0 ||
        ::getsockname(listening_, any, &size) != 0) {
      throw std::runtime_error("no port to listen on");
    }
    port_ = ntohs(address.sin_port);
  }
  ~Server() {
    if (caller_ >= 0) ::close(caller_);
    ::close(listening_);
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::string url(const std::string& scheme, const std::string& user = "") const {
    return scheme + "://" + user + "127.0.0.1:" + std::to_string(port_) + "/stream";
  }
  void accept() {
    pollfd waiting{listening_, POLLIN, 0};
    constexpr int kMilliseconds = 20000;
    if (::poll(&waiting, 1, kMilliseconds) == 1) {
      caller_ = ::accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC);
    }
  }
  void send(const std::string& bytes) const {
    ::send(caller_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  void receive() const {
    char buffer[4096];
    [[maybe_unused]] const auto count = ::recv(caller_, buffer, sizeof buffer, 0);
  }
  void hang_up() {
    ::shutdown(caller_, SHUT_RDWR);
    ::close(caller_);
    caller_ = -1;
  }

 private:
  int listening_;
  int caller_ = -1;
  int port_ = 0;
};

class TrackStream : public TrackScene {};

TEST_F(TrackStream, ASignalEndsAStreamThatDoesNotAnswerAtOnce) {
  for (const int signal : {SIGINT, SIGTERM}) {
    Server silent;
    Process process(sdmt_words({"track", silent.url("rtsp"), "--no-appearance", "--stats"}));
    silent.accept();
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    const auto start = std::chrono::steady_clock::now();
    process.send_signal(signal);
    EXPECT_EQ(process.wait().exit_code, 128 + signal);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(3));
  }
}

TEST_F(TrackStream, PasswordsAreNotRepeated) {
  std::string url;
  {
    const Server gone;
    url = gone.url("rtsp", "admin:hunter2@");
  }
  const auto result = run_sdmt({"track", url, "--no-appearance", "--stats"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("rtsp://***@127.0.0.1"));
  EXPECT_THAT(result.err + result.out, Not(HasSubstr("hunter2")));
}

TEST_F(TrackStream, AStreamThatBreaksOffIsAFailureThatKeepsWhatCame) {
  constexpr int kFrames = 20;
  Server server;
  std::thread camera([&] {
    server.accept();
    server.receive();
    server.send(
        "HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=frame\r\n\r\n");
    for (int i = 0; i < kFrames; ++i) {
      std::vector<unsigned char> jpeg;
      cv::imencode(".jpg", cv::Mat(120, 160, CV_8UC3, cv::Scalar(10 * i, 90, 40)), jpeg);
      server.send(
          "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: " + std::to_string(jpeg.size()) +
          "\r\n\r\n" + std::string(jpeg.begin(), jpeg.end()) + "\r\n");
    }
    server.hang_up();
  });
  std::string rows;
  for (int i = 1; i <= kFrames; ++i) rows += std::to_string(i) + ",-1,10,10,40,90,0.9\n";
  write_file(folder_ / "det.txt", rows);
  const auto result = track(server.url("http"), {"--no-appearance", "--no-reconnect",
                                                 "--detections", folder_ / "det.txt"});
  camera.join();
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.err, HasSubstr("gives no more frames; the "));
  EXPECT_THAT(tracks(), HasSubstr("\n15,1,"));
}

}  // namespace
}  // namespace sdmt::tests

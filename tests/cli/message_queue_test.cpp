// SPDX-License-Identifier: Apache-2.0
#include "mqtt/message_queue.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <string>

#include "cli/run_command.h"

namespace sdmt::tests {
namespace {

// Files of this process cannot grow beyond `bytes`: what does not fit is written in part.
class SmallFiles {
 public:
  explicit SmallFiles(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallFiles() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  SmallFiles(const SmallFiles&) = delete;
  SmallFiles& operator=(const SmallFiles&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

// The half that was written is read, as far as a buffer goes, before the next messages come.
TEST(MessageQueue, AMessageThatDoesNotFitSpoilsNoOther) {
  const TemporaryFolder folder;
  tools::MessageQueue queue(folder / "queue", 100'000);
  const auto next = [&] {
    const auto message = queue.next();
    return message ? message->topic + " " + message->payload : "nothing";
  };
  {
    const SmallFiles full(60);
    EXPECT_TRUE(queue.add("a", "first"));
    EXPECT_FALSE(queue.add("a", std::string(100, 'x')));
    EXPECT_EQ(next(), "a first");
    EXPECT_EQ(next(), "nothing");
    EXPECT_FALSE(queue.add("a", std::string(100, 'y')));
  }
  EXPECT_TRUE(queue.add("a", "second"));
  EXPECT_EQ(next(), "a second");
  EXPECT_TRUE(queue.add("b", "third"));
  EXPECT_EQ(next(), "b third");
  EXPECT_EQ(next(), "nothing");
  EXPECT_EQ(queue.dropped(), 2);
}

}  // namespace
}  // namespace sdmt::tests

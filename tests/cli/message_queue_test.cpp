// SPDX-License-Identifier: Apache-2.0
#include "mqtt/message_queue.h"

#include <gtest/gtest.h>

#include <string>

#include "cli/run_command.h"
#include "pipeline/file_size_limit.h"

namespace sdmt::tests {
namespace {

// The half that was written is read, as far as a buffer goes, before the next messages come.
TEST(MessageQueue, AMessageThatDoesNotFitSpoilsNoOther) {
  const TemporaryFolder folder;
  tools::MessageQueue queue(folder / "queue", 100'000);
  const auto next = [&] {
    const auto message = queue.next();
    return message ? message->topic + " " + message->payload : "nothing";
  };
  {
    const FileSizeLimit full(60);
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

// SPDX-License-Identifier: Apache-2.0
// What happens in the threads that read images when there is no memory left.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <opencv2/imgcodecs.hpp>

#include "cli/run_command.h"
#include "sdmt/media/image_file.h"

namespace {

constexpr std::size_t kLarge = 10000;  // more than a thread or an exception takes
std::atomic<bool> exhausted = false;

}  // namespace

void* operator new(std::size_t size) {
  if (exhausted && size >= kLarge) throw std::bad_alloc();
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
// GCC does not see that both come from malloc().
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace sdmt::media {
namespace {

TEST(OutOfMemory, LeavesTheThreadsAsAnException) {
  const tests::TemporaryFolder folder;
  std::vector<std::filesystem::path> paths;
  for (int i = 0; i < 8; ++i) {
    paths.push_back(folder / (std::to_string(i) + ".png"));
    ASSERT_TRUE(
        cv::imwrite(paths.back().string(), cv::Mat(100, 100, CV_8UC3, cv::Scalar(1, 2, 3))));
  }
  ASSERT_TRUE(read_images(paths).back().has_value());
  exhausted = true;
  EXPECT_THROW(read_images(paths), std::bad_alloc);
  exhausted = false;
  EXPECT_TRUE(read_images(paths).back().has_value());
}

}  // namespace
}  // namespace sdmt::media

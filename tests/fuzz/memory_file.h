// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace sdmt::fuzz {

/// A file that exists in memory only, so that readers of files can be fed fast.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(memfd_create("fuzz", 0)) {
    if (descriptor_ < 0) std::abort();
    path_ = "/proc/self/fd/" + std::to_string(descriptor_);
  }

  const std::filesystem::path& fill(const std::uint8_t* bytes, std::size_t count) {
    if (ftruncate(descriptor_, 0) != 0) std::abort();
    if (pwrite(descriptor_, bytes, count, 0) != static_cast<ssize_t>(count)) std::abort();
    return path_;
  }

 private:
  int descriptor_;
  std::filesystem::path path_;
};

/// Ends the run when something that must hold does not.
inline void require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace sdmt::fuzz

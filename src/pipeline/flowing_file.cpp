// SPDX-License-Identifier: Apache-2.0
#include "flowing_file.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "sdmt/io/write_all.h"
#include "sdmt/pipeline/utc_time.h"

namespace sdmt::pipeline {

namespace {

std::string now() { return utc_text(std::chrono::system_clock::now()); }

}  // namespace

FlowingFile::FlowingFile(std::string path, Flowing flowing)
    : path_(std::move(path)), flowing_(std::move(flowing)), retention_(path_, flowing_) {
  open();
}

FlowingFile::~FlowingFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void FlowingFile::open() {
  descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (descriptor_ < 0) refuse("cannot be opened for writing");
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    refuse("another program is writing it");
  }
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) refuse("cannot be examined");
  size_ = static_cast<std::uint64_t>(status.st_size);
  begun_ = Clock::now();
  // A line that a power cut left in the middle.
  char last = '\n';
  if (size_ > 0 && ::pread(descriptor_, &last, 1, status.st_size - 1) == 1 && last != '\n') {
    append("\n");
  }
}

void FlowingFile::write(std::string_view lines) {
  const auto count = std::count(lines.begin(), lines.end(), '\n');
  if (full_ && Clock::now() - tried_ < std::chrono::seconds(1)) {
    missing_ += count;
    return;
  }
  retention_.look();
  if (is_old(lines.size())) rotate();
  if (!append(lines)) {
    fail(errno);
    missing_ += count;
  } else if (std::exchange(full_, false)) {
    flowing_.tell(fmt::format("{}: is written again, {}; {} lines are missing", path_, now(),
                              std::exchange(missing_, 0)));
  }
}

void FlowingFile::commit() { ::fsync(descriptor_); }

bool FlowingFile::append(std::string_view lines) {
  const std::size_t written = io::write_all(descriptor_, lines);
  if (written < lines.size()) {
    const int error = errno;
    // What is there stays whole.
    if (written > 0 && ::ftruncate(descriptor_, static_cast<off_t>(size_)) != 0) size_ += written;
    errno = error;
    return false;
  }
  size_ += written;
  return true;
}

bool FlowingFile::is_old(std::size_t more) const {
  const Rotation& rotation = flowing_.rotation;
  if (size_ == 0 || full_) return false;
  return (rotation.bytes > 0 && size_ + more > rotation.bytes) ||
         (rotation.seconds > 0 &&
          Clock::now() - begun_ >= std::chrono::duration<double>(rotation.seconds));
}

void FlowingFile::rotate() {
  const std::string aside = rotated_name(path_);
  if (::rename(path_.c_str(), aside.c_str()) != 0) {
    flowing_.tell(fmt::format("{}: cannot be renamed to {}, and grows on: {}", path_, aside,
                              std::strerror(errno)));
    begun_ = Clock::now();
    return;
  }
  const int old = std::exchange(descriptor_, -1);
  ::fsync(old);
  try {
    open();
    ::close(old);
  } catch (const std::runtime_error& error) {  // lines go on into the old one
    flowing_.tell(error.what());
    descriptor_ = old;
  }
}

void FlowingFile::fail(int error) {
  tried_ = Clock::now();
  if (std::exchange(full_, true)) return;
  flowing_.tell(fmt::format(
      "{}: write failed, {}: {}; what is there is kept, and lines are left out until there is room",
      path_, now(), std::strerror(error)));
}

void FlowingFile::refuse(const char* what) const {
  const int error = errno;
  if (descriptor_ >= 0) ::close(descriptor_);
  throw std::runtime_error(path_ + ": " + what +
                           (error == EWOULDBLOCK ? "" : std::string(": ") + std::strerror(error)));
}

}  // namespace sdmt::pipeline

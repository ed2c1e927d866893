// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/temporary_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <system_error>

#include "sdmt/io/retry.h"
#include "sdmt/io/unfinished_files.h"

namespace sdmt::io {

namespace fs = std::filesystem;

namespace {

constexpr mode_t kReadWrite = 0666;  // less the umask
constexpr mode_t kPermissions = 0777;

bool is_named(int descriptor, const fs::path& path) {
  struct stat opened {};
  struct stat named {};
  return ::fstat(descriptor, &opened) == 0 && ::lstat(path.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

int open_file(const fs::path& path, int flags, mode_t mode = 0) {
  return retry([&] { return ::open(path.c_str(), flags | O_NOFOLLOW | O_CLOEXEC, mode); });
}

// False while another holds it. Where files cannot be locked at all, the name alone must do.
bool lock(int descriptor) {
  return retry([&] { return ::flock(descriptor, LOCK_EX | LOCK_NB); }) == 0 || errno != EWOULDBLOCK;
}

// Those that live; what finds no place here is only not removed by remove_unfinished_files().
constexpr std::size_t kMostAtOnce = 64;
std::array<std::atomic<const TemporaryFile*>, kMostAtOnce> unfinished{};

void exchange_unfinished(const TemporaryFile* from, const TemporaryFile* to) {
  for (auto& place : unfinished) {
    const TemporaryFile* held = from;
    if (place.compare_exchange_strong(held, to)) return;
  }
}

// Where a chain of symbolic links ends, whether or not anything is there.
fs::path resolved(fs::path path) {
  constexpr int kMostLinks = 40;  // as Linux
  std::error_code ignored;
  for (int i = 0; i < kMostLinks && fs::is_symlink(fs::symlink_status(path, ignored)); ++i) {
    path = path.parent_path() / fs::read_symlink(path, ignored);
  }
  return path;
}

}  // namespace

TemporaryFile::TemporaryFile(const fs::path& target, std::string_view extension)
    : shown_(target), target_(resolved(target)) {
  struct stat old {};
  const bool replaces = ::stat(target_.c_str(), &old) == 0;
  if (!replaces && errno != ENOENT && errno != ENOTDIR) fail("cannot be examined");
  if (replaces && !S_ISREG(old.st_mode)) {
    throw std::invalid_argument(shown_.string() + (S_ISDIR(old.st_mode)
                                                       ? ": is a folder, expected a file to write"
                                                       : ": is no regular file"));
  }
  std::error_code ignored;
  const fs::path folder = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ignored)) {
    throw std::invalid_argument(shown_.string() + ": folder " + folder.string() +
                                " does not exist");
  }
  path_ = folder / ("." + target_.filename().string() + ".sdmt-tmp");
  path_ += extension;
  const mode_t mode = replaces ? old.st_mode & kPermissions : kReadWrite;
  create(mode & kReadWrite);
  exchange_unfinished(nullptr, this);
  if (!replaces) return;
  // Only the superuser gives files to others, and some file systems know no permissions; the new
  // file is never open to more people than the old one.
  if (::fchown(descriptor_, old.st_uid, old.st_gid) == 0 || errno == EPERM) {
    if (::fchmod(descriptor_, mode) == 0 || errno == EPERM) return;
  }
  const int cause = errno;
  exchange_unfinished(this, nullptr);
  ::unlink(path_.c_str());
  ::close(descriptor_);
  errno = cause;
  fail("cannot be given the permissions of the file it replaces");
}

void TemporaryFile::create(unsigned mode) {
  constexpr int kAttempts = 100;  // others may come and go in between
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    descriptor_ = open_file(path_, O_RDWR | O_CREAT | O_EXCL, mode);
    if (descriptor_ >= 0) {
      if (lock(descriptor_) && is_named(descriptor_, path_)) return;
      ::close(descriptor_);
      continue;  // another took it for a leftover between the two calls
    }
    if (errno != EEXIST) fail("cannot be opened for writing");

    struct stat found {};
    if (::lstat(path_.c_str(), &found) != 0) continue;
    if (!S_ISREG(found.st_mode)) {
      throw std::runtime_error(shown_.string() + ": cannot be written while " + path_.string() +
                               " is there and no regular file; remove it");
    }
    const int leftover = open_file(path_, O_RDONLY | O_NONBLOCK);
    if (leftover < 0 && errno == ENOENT) continue;
    if (leftover < 0) fail("what an earlier run left of it cannot be opened");
    const bool free = lock(leftover);
    if (free && is_named(leftover, path_)) ::unlink(path_.c_str());
    ::close(leftover);
    if (!free) break;
  }
  errno = EWOULDBLOCK;
  fail("is being written by another program");
}

TemporaryFile::~TemporaryFile() {
  exchange_unfinished(this, nullptr);
  if (!path_.empty()) ::unlink(path_.c_str());  // while the lock makes it ours
  ::close(descriptor_);
}

void TemporaryFile::commit() {
  if (!is_named(descriptor_, path_)) fail("was replaced while it was being written");
  if (retry([&] { return ::fsync(descriptor_); }) != 0) fail("flush to disk failed");
  if (retry([&] { return std::rename(path_.c_str(), target_.c_str()); }) != 0) {
    fail("rename failed");
  }
  path_.clear();
  // Without this the name, though not the content, may be gone after a power cut. A folder that may
  // be written but not read cannot be opened, and some file systems flush no folders.
  const fs::path folder = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
  const int opened = retry([&] { return ::open(folder.c_str(), O_RDONLY | O_CLOEXEC); });
  if (opened < 0) return;
  const bool flushed = retry([&] { return ::fsync(opened); }) == 0 || errno == EINVAL;
  const int cause = errno;
  ::close(opened);
  errno = cause;
  if (!flushed) fail("flush of its folder to disk failed");
}

void remove_unfinished_files() noexcept {
  for (const auto& place : unfinished) {
    const TemporaryFile* const file = place;
    if (file != nullptr && !file->path().empty()) ::unlink(file->path().c_str());
  }
}

void TemporaryFile::fail(const char* what) const {
  throw std::runtime_error(shown_.string() + ": " + what + ": " + std::strerror(errno));
}

}  // namespace sdmt::io

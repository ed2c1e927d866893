// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/output_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace sdmt::io {

namespace {

bool is_named(int descriptor, const std::filesystem::path& path) {
  struct stat opened {};
  struct stat named {};
  return ::fstat(descriptor, &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

// The file `path`, emptied, for one writer at a time; null with errno EWOULDBLOCK while another has
// it. What a killed writer left is taken over: its lock went with it.
std::FILE* open_exclusively(const std::filesystem::path& path) {
  constexpr mode_t kReadWrite = 0666;  // less the umask
  while (true) {
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, kReadWrite);
    if (descriptor < 0) return nullptr;
    if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      ::close(descriptor);
      errno = EWOULDBLOCK;
      return nullptr;
    }
    // A writer that finished between the two calls has renamed or removed what we opened.
    if (!is_named(descriptor, path)) {
      ::close(descriptor);
      continue;
    }
    std::FILE* file = ::ftruncate(descriptor, 0) == 0 ? ::fdopen(descriptor, "wb") : nullptr;
    if (file == nullptr) ::close(descriptor);
    return file;
  }
}

}  // namespace

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
  std::error_code ignored;
  const auto status = std::filesystem::status(path_, ignored);
  if (std::filesystem::is_directory(status)) {
    throw std::invalid_argument(path_.string() + ": is a folder, expected a file to write");
  }
  const bool direct = std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);
  if (!direct) {
    const auto folder = path_.has_parent_path() ? path_.parent_path() : std::filesystem::path(".");
    if (!std::filesystem::is_directory(folder, ignored)) {
      throw std::invalid_argument(path_.string() + ": folder " + folder.string() +
                                  " does not exist");
    }
    temporary_ = path_;
    temporary_ += ".tmp";
  }
  file_ = direct ? std::fopen(path_.c_str(), "wb") : open_exclusively(temporary_);
  if (file_ == nullptr && errno == EWOULDBLOCK) fail("is being written by another program");
  if (file_ == nullptr) fail("cannot be opened for writing");
}

OutputFile::~OutputFile() {
  if (file_ == nullptr) return;
  if (!temporary_.empty()) {
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);  // while it is still ours
  }
  std::fclose(file_);
}

void OutputFile::write(const void* bytes, std::size_t count) {
  if (std::fwrite(bytes, 1, count, file_) != count) fail("write failed");
}

void OutputFile::commit() {
  if (std::fflush(file_) != 0) fail("write failed");
  if (!temporary_.empty() && ::fsync(::fileno(file_)) != 0) fail("flush to disk failed");
  if (!temporary_.empty() && std::rename(temporary_.c_str(), path_.c_str()) != 0) {
    fail("rename failed");
  }
  temporary_.clear();
  // Everything has been flushed, and the lock held until it had its name.
  if (std::fclose(std::exchange(file_, nullptr)) != 0) fail("close failed");
}

void OutputFile::fail(const char* what) const {
  throw std::runtime_error(path_.string() + ": " + what + ": " + std::strerror(errno));
}

void write_text_file(const std::filesystem::path& path, std::string_view text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace sdmt::io

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "sdmt/io/write_all.h"

namespace sdmt::io {

namespace {

constexpr std::size_t kBuffer = 1 << 16;
constexpr const char* kStandardOutput = "standard output";

}  // namespace

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
  buffer_.reserve(kBuffer);
  if (path_ == "-") {
    path_ = kStandardOutput;
    direct_ = ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0);
    if (direct_ < 0) fail("cannot be opened for writing");
    return;
  }
  std::error_code ignored;
  const auto status = std::filesystem::status(path_, ignored);
  if (status.type() == std::filesystem::file_type::none) fail("cannot be examined");
  if (std::filesystem::is_other(status)) {
    direct_ = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
    if (direct_ < 0) fail("cannot be opened for writing");
  } else {
    temporary_.emplace(path_);
  }
}

OutputFile::~OutputFile() {
  if (direct_ >= 0) ::close(direct_);
}

void OutputFile::write(const void* bytes, std::size_t count) {
  const std::string_view text(static_cast<const char*>(bytes), count);
  if (buffer_.size() + count < kBuffer) {
    buffer_.append(text);
    return;
  }
  flush();
  if (write_all(descriptor(), text) < count) fail("write failed");
}

void OutputFile::flush() {
  if (write_all(descriptor(), buffer_) < buffer_.size()) fail("write failed");
  buffer_.clear();
}

void OutputFile::commit() {
  flush();
  if (temporary_) temporary_->commit();
  temporary_.reset();
}

void OutputFile::fail(const char* what) const {
  const int cause = errno;
  const auto message = path_.string() + ": " + what + ": " + std::strerror(cause);
  if (cause == EPIPE && path_ == kStandardOutput) throw ReaderLeft(message);
  throw std::runtime_error(message);
}

void write_text_file(const std::filesystem::path& path, std::string_view text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace sdmt::io

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/output_file.h"

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace sdmt::nn {

namespace {

// Distinguishes temporary files of several writers in one process.
std::atomic<unsigned> serial{0};

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
    temporary_ += "." + std::to_string(::getpid()) + "-" + std::to_string(++serial) + ".tmp";
  }
  file_ = std::fopen((direct ? path_ : temporary_).c_str(), "wb");
  if (file_ == nullptr) fail("cannot be opened for writing");
}

OutputFile::~OutputFile() {
  if (file_ != nullptr) std::fclose(file_);
  if (!temporary_.empty()) {
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);
  }
}

void OutputFile::write(const void* bytes, std::size_t count) {
  if (std::fwrite(bytes, 1, count, file_) != count) fail("write failed");
}

void OutputFile::commit() {
  if (std::fflush(file_) != 0) fail("write failed");
  if (!temporary_.empty() && ::fsync(::fileno(file_)) != 0) fail("flush to disk failed");
  if (std::fclose(std::exchange(file_, nullptr)) != 0) fail("close failed");
  if (temporary_.empty()) return;
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) fail("rename failed");
  temporary_.clear();
}

void OutputFile::fail(const char* what) const {
  throw std::runtime_error(path_.string() + ": " + what + ": " + std::strerror(errno));
}

void write_text_file(const std::filesystem::path& path, std::string_view text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace sdmt::nn

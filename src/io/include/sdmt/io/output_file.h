// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "sdmt/io/temporary_file.h"

namespace sdmt::io {

/// A file that appears whole or not at all: bytes go to a TemporaryFile, which commit() flushes to
/// the disk and renames. Destruction without commit() leaves an older file of that name as it was.
/// A path that exists and is not a regular file (a device, a pipe) is written directly, and so is
/// standard output, whose path is "-".
class OutputFile {
 public:
  /// Throws as TemporaryFile does.
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Throws std::runtime_error naming the path and the cause (disk full, ...), ReaderLeft when
  /// nobody reads standard output any more.
  void write(const void* bytes, std::size_t count);
  void write(std::string_view text) { write(text.data(), text.size()); }

  /// Hands on what write() has gathered, for those who read a pipe as it comes.
  void flush();
  /// Makes the file visible under its name. Throws as write(). Nothing may be written afterwards.
  void commit();

 private:
  int descriptor() const { return temporary_ ? temporary_->descriptor() : direct_; }
  [[noreturn]] void fail(const char* what) const;

  std::filesystem::path path_;
  std::optional<TemporaryFile> temporary_;  // none when path_ is written directly
  int direct_ = -1;
  std::string buffer_;
};

/// Who read our standard output has left, as `head` does: no failure worth a word.
class ReaderLeft : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Writes `text` as the whole of the file `path`. Throws as OutputFile.
void write_text_file(const std::filesystem::path& path, std::string_view text);

}  // namespace sdmt::io

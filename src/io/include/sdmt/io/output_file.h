// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

namespace sdmt::io {

/// A file that appears whole or not at all: bytes go to `path`.tmp, which commit() flushes to the
/// disk and renames to `path`. Destruction without commit() removes it and leaves an older file of
/// that name as it was; what a killed program left of it, the next writer takes over. A path that
/// exists and is not a regular file (a device, a pipe) is written directly.
class OutputFile {
 public:
  /// Throws std::invalid_argument when the folder does not exist, std::runtime_error when the
  /// temporary file cannot be made or another OutputFile, of any program, is writing `path`. Both
  /// name the path.
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Throws std::runtime_error naming the path and the cause (disk full, ...).
  void write(const void* bytes, std::size_t count);
  void write(std::string_view text) { write(text.data(), text.size()); }

  /// Makes the file visible under its name. Throws as write(). Nothing may be written afterwards.
  void commit();

 private:
  [[noreturn]] void fail(const char* what) const;

  std::filesystem::path path_;
  std::filesystem::path temporary_;  // empty when path_ is written directly
  std::FILE* file_ = nullptr;
};

/// Writes `text` as the whole of the file `path`. Throws as OutputFile.
void write_text_file(const std::filesystem::path& path, std::string_view text);

}  // namespace sdmt::io

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

namespace sdmt::io {

/// The place of a file that is not whole yet: a new, empty file `.NAME.sdmt-tmp` in the folder of
/// `target`, held by a lock for one writer at a time. commit() gives it the target's name;
/// destruction without commit() removes it and leaves the target as it was.
///
/// The name cannot be aimed at another file: what lies there already is never written to. A file of
/// that name that nobody holds is what a killed program left, and gives way; anything but a regular
/// file is refused. A target that is a symbolic link keeps it: the file that the link leads to is
/// replaced. An existing target's permissions, and where possible its owner, pass on to the new
/// file; other hard links to it keep the old content.
class TemporaryFile {
 public:
  /// `extension` ends the temporary name, for writers that judge by it: ".mp4". Throws
  /// std::invalid_argument when the target is no regular file or its folder does not exist,
  /// std::runtime_error when the file cannot be made or another program is writing the target. Both
  /// name the target.
  explicit TemporaryFile(const std::filesystem::path& target, std::string_view extension = "");
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// Where to write; also open for writing as descriptor().
  const std::filesystem::path& path() const { return path_; }
  int descriptor() const { return descriptor_; }

  /// Flushes the file to the disk, renames it, and flushes the folder. Throws std::runtime_error
  /// naming the target and the cause.
  void commit();

 private:
  void create(unsigned mode);
  [[noreturn]] void fail(const char* what) const;

  std::filesystem::path shown_;   // the target as it was given
  std::filesystem::path target_;  // links resolved
  std::filesystem::path path_;    // empty once committed
  int descriptor_ = -1;
};

}  // namespace sdmt::io

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace sdmt::tests {

/// Whether the binary has the sanitizers, which need threads and stacks of their own and report by
/// standard error.
#ifdef SDMT_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

struct CommandResult {
  int exit_code = -1;  ///< 128 + signal when a signal ended it
  std::string out;
  std::string err;
};

/// A folder that is removed with all it holds when it goes.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  /// Names of everything in it, sorted; hidden files too.
  std::vector<std::string> listing() const;

 private:
  std::filesystem::path path_;
};

void write_file(const std::filesystem::path& path, const std::string& text);
std::string read_file(const std::filesystem::path& path);

/// A running program. What it prints to standard output stands in a pipe until it is read here.
class Process {
 public:
  /// `environment` is added to ours.
  explicit Process(const std::vector<std::string>& words,
                   const std::map<std::string, std::string>& environment = {});
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Waits for a whole line of standard output; returns it without its newline.
  std::string read_line();
  void send_signal(int signal) const;
  /// Reads the rest and waits for the end.
  CommandResult wait();

 private:
  TemporaryFolder folder_;  // standard error
  pid_t pid_ = -1;
  int out_ = -1;
  std::string unread_;
};

CommandResult run_command(const std::vector<std::string>& words,
                          const std::map<std::string, std::string>& environment = {});

/// The binary of this build: run_sdmt({"track", "--help"}).
CommandResult run_sdmt(std::vector<std::string> arguments,
                       const std::map<std::string, std::string>& environment = {});
std::vector<std::string> sdmt_words(std::vector<std::string> arguments);

}  // namespace sdmt::tests

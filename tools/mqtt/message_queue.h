// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <optional>
#include <string>

namespace sdmt::tools {

/// Messages on their way to somebody who may be away: first in, first out, in the files of a
/// folder, where they outlive this process, also when it is killed (not when the machine loses
/// power).
///
/// FIRST.messages holds messages from number FIRST on, a line "TOPIC<tab>PAYLOAD" each; `done` is
/// the number up to which they have arrived. A file goes when all of it has. Functions may be
/// called from any thread.
class MessageQueue {
 public:
  struct Message {
    std::int64_t number = 0;
    std::string topic, payload;
  };

  /// Goes on with what the folder holds; makes it where there is none. More than about `bound`
  /// bytes (at least 1e5) are not kept: the oldest file is dropped. Throws std::runtime_error when
  /// the folder cannot be used, or another program uses it.
  MessageQueue(std::filesystem::path folder, std::uint64_t bound);
  /// A folder without messages goes, too.
  ~MessageQueue();
  MessageQueue(const MessageQueue&) = delete;
  MessageQueue& operator=(const MessageQueue&) = delete;

  /// Neither may hold a line end, the topic no tab. False when it could not be written, as on a
  /// full disk; it is then counted as dropped.
  bool add(const std::string& topic, const std::string& payload);
  /// The first message that was not given out yet; nothing when there is none. Throws
  /// std::runtime_error when it cannot be read.
  std::optional<Message> next();
  /// This one and all before it have arrived.
  void done(std::int64_t number);
  /// What was given out and has not arrived is given out again.
  void rewind();

  /// Messages that have not arrived.
  std::int64_t waiting() const;
  /// Messages that never will, since construction. Where a whole file gave way, those of it count
  /// that had been given out a moment before and may have arrived all the same.
  std::int64_t dropped() const;

 private:
  struct File {
    std::filesystem::path path;
    std::int64_t first = 0;
    std::int64_t count = 0;
    std::uint64_t bytes = 0;
  };

  void open_folder();
  void read_file(const std::filesystem::path& path, std::int64_t first);
  bool cut_half();
  bool open_new_file();
  void drop_first_file();
  void remove_done_files();
  void remember_done();
  std::int64_t end() const;  // the number of the next message to come

  std::filesystem::path folder_;
  std::uint64_t bound_, file_bytes_;
  mutable std::mutex mutex_;
  int lock_ = -1, done_file_ = -1, last_file_ = -1;
  std::deque<File> files_;  // the last one grows
  bool half_ = false;       // it ends with a message that is not whole
  std::int64_t done_ = 0;   // the last that has arrived
  std::int64_t dropped_ = 0;
  std::int64_t next_ = 1;       // the next to be given out
  std::ifstream reader_;        // at `next_`, where it is open
  std::int64_t read_file_ = 0;  // the first number of the file that it reads
};

}  // namespace sdmt::tools

// SPDX-License-Identifier: Apache-2.0
#include "mqtt/message_queue.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <map>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "sdmt/io/checked_value.h"
#include "sdmt/io/delimited_text.h"
#include "sdmt/io/retry.h"
#include "sdmt/io/write_all.h"

namespace sdmt::tools {

namespace {

namespace fs = std::filesystem;

constexpr const char* kExtension = ".messages";
constexpr int kDigits = 19;

[[noreturn]] void fail(const fs::path& path, const char* what) {
  throw std::runtime_error(path.string() + ": " + what + ": " + std::strerror(errno));
}

int open_or_fail(const fs::path& path, int flags) {
  const int descriptor =
      io::retry([&] { return ::open(path.c_str(), flags | O_CREAT | O_CLOEXEC, 0600); });
  if (descriptor < 0) fail(path, "cannot be opened");
  return descriptor;
}

}  // namespace

MessageQueue::MessageQueue(fs::path folder, std::uint64_t bound)
    : folder_(std::move(folder)),
      bound_(bound),
      file_bytes_(std::clamp<std::uint64_t>(bound / 8, 10'000, 4'000'000)) {
  try {
    open_folder();
  } catch (...) {
    for (const int descriptor : {lock_, done_file_, last_file_}) {
      if (descriptor >= 0) ::close(descriptor);
    }
    throw;
  }
}

void MessageQueue::open_folder() {
  std::error_code failed;
  fs::create_directories(folder_, failed);
  if (failed) {
    throw std::runtime_error(folder_.string() + ": cannot be made: " + failed.message());
  }
  lock_ = open_or_fail(folder_ / "lock", O_RDWR);
  if (io::retry([&] { return ::flock(lock_, LOCK_EX | LOCK_NB); }) != 0) {
    if (errno != EWOULDBLOCK) fail(folder_ / "lock", "cannot be locked");
    throw std::runtime_error(folder_.string() + ": another program keeps its messages there");
  }
  done_file_ = open_or_fail(folder_ / "done", O_RDWR);
  std::string text(kDigits, ' ');
  const auto count = io::retry([&] { return ::pread(done_file_, text.data(), text.size(), 0); });
  if (count < 0) fail(folder_ / "done", "cannot be read");
  text.resize(static_cast<std::size_t>(count));
  done_ = io::parse_number<std::int64_t>(text).value_or(0);
  std::map<std::int64_t, fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder_)) {
    const auto first = io::parse_number<std::int64_t>(entry.path().stem().string());
    if (first && entry.path().extension() == kExtension) found[*first] = entry.path();
  }
  for (const auto& [first, path] : found) read_file(path, first);
  if (!files_.empty()) {
    done_ = std::max(done_, files_.front().first - 1);
    last_file_ = open_or_fail(files_.back().path, O_WRONLY | O_APPEND);
    // Of a write that never ended.
    if (::ftruncate(last_file_, static_cast<off_t>(files_.back().bytes)) != 0) {
      fail(files_.back().path, "cannot be cut");
    }
  }
  remove_done_files();
  next_ = done_ + 1;
}

// Counts its messages; what stands behind the last line end is none. Throws rather than take what
// cannot be read for what is not there.
void MessageQueue::read_file(const fs::path& path, std::int64_t first) {
  const std::string text = io::read_text(path);
  files_.push_back({path, first, std::count(text.begin(), text.end(), '\n'),
                    text.rfind('\n') + 1});  // npos + 1 is 0
}

MessageQueue::~MessageQueue() {
  reader_.close();
  std::error_code ignored;
  if (waiting() == 0) {
    for (const File& file : files_) fs::remove(file.path, ignored);
    fs::remove(folder_ / "done", ignored);
    fs::remove(folder_ / "lock", ignored);
    fs::remove(folder_, ignored);
  }
  for (const int descriptor : {last_file_, done_file_, lock_}) {
    if (descriptor >= 0) ::close(descriptor);
  }
}

std::int64_t MessageQueue::end() const {
  return files_.empty() ? done_ + 1 : files_.back().first + files_.back().count;
}

std::int64_t MessageQueue::waiting() const {
  const std::lock_guard lock(mutex_);
  return end() - 1 - done_;
}

std::int64_t MessageQueue::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

bool MessageQueue::add(const std::string& topic, const std::string& payload) {
  const std::string line = topic + '\t' + payload + '\n';
  const std::lock_guard lock(mutex_);
  std::uint64_t bytes = line.size();
  for (const File& file : files_) bytes += file.bytes;
  if (bytes > bound_ && files_.size() > 1) drop_first_file();
  const bool full = !files_.empty() && files_.back().bytes + line.size() > file_bytes_;
  if ((files_.empty() || full) && !open_new_file()) {
    ++dropped_;
    return false;
  }
  File& file = files_.back();
  if (!cut_half() || io::write_all(last_file_, line) < line.size()) {
    half_ = true;
    cut_half();
    ++dropped_;
    return false;
  }
  file.bytes += line.size();
  ++file.count;
  return true;
}

// The half of a message that did not fit; the reader may hold it, too. Where it cannot be cut off,
// nothing can follow.
bool MessageQueue::cut_half() {
  if (!half_) return true;
  reader_.close();
  half_ = ::ftruncate(last_file_, static_cast<off_t>(files_.back().bytes)) != 0;
  return !half_;
}

bool MessageQueue::open_new_file() {
  const std::int64_t first = end();
  const fs::path path = folder_ / fmt::format("{:0{}}{}", first, kDigits, kExtension);
  const int descriptor = io::retry([&] {
    return ::open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  });
  if (descriptor < 0) return false;
  half_ = false;
  if (last_file_ >= 0) ::close(last_file_);
  last_file_ = descriptor;
  files_.push_back({path, first, 0, 0});
  return true;
}

void MessageQueue::drop_first_file() {
  const File& file = files_.front();
  const std::int64_t last = file.first + file.count - 1;
  dropped_ += std::max<std::int64_t>(0, last - std::max(done_, file.first - 1));
  done_ = std::max(done_, last);
  remember_done();
  next_ = std::max(next_, done_ + 1);
  remove_done_files();
}

std::optional<MessageQueue::Message> MessageQueue::next() {
  const std::lock_guard lock(mutex_);
  if (next_ >= end()) return std::nullopt;
  const auto file = std::find_if(files_.begin(), files_.end(),
                                 [&](const File& each) { return next_ < each.first + each.count; });
  std::string line;
  if (!reader_.is_open() || read_file_ != file->first) {
    reader_ = std::ifstream(file->path, std::ios::binary);
    read_file_ = file->first;
    for (auto n = file->first; n < next_; ++n) {
      reader_.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
    }
  }
  if (!reader_.bad()) reader_.clear();  // it may have been at the end, which has moved on since
  if (!std::getline(reader_, line)) fail(file->path, "cannot be read");
  const auto tab = line.find('\t');
  Message message{next_++, line.substr(0, tab), {}};
  if (tab != std::string::npos) message.payload = line.substr(tab + 1);
  return message;
}

void MessageQueue::done(std::int64_t number) {
  const std::lock_guard lock(mutex_);
  if (number <= done_) return;
  done_ = number;
  remember_done();
  remove_done_files();
}

void MessageQueue::rewind() {
  const std::lock_guard lock(mutex_);
  next_ = done_ + 1;
  reader_.close();
}

void MessageQueue::remember_done() {
  const std::string text = fmt::format("{:0{}}", done_, kDigits);
  // Where it fails, some messages arrive twice after a restart, with their old numbers.
  [[maybe_unused]] const auto written = ::pwrite(done_file_, text.data(), text.size(), 0);
}

// All but the last, which is written.
void MessageQueue::remove_done_files() {
  while (files_.size() > 1 && files_[1].first <= done_ + 1) {
    std::error_code ignored;
    fs::remove(files_.front().path, ignored);
    files_.pop_front();
  }
}

}  // namespace sdmt::tools

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/run_state.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "sdmt/io/checked_value.h"
#include "sdmt/io/delimited_text.h"
#include "sdmt/io/hash.h"
#include "sdmt/io/output_file.h"
#include "sdmt/io/retry.h"
#include "sdmt/io/write_all.h"

namespace sdmt::pipeline {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTitle = "sdmt track state 2";

[[noreturn]] void refuse(const fs::path& path, const std::string& wrong) {
  throw std::invalid_argument(path.string() + ": " + wrong +
                              "; remove it and begin anew, or name another --state");
}

[[noreturn]] void fail(const fs::path& path, const char* what) {
  throw std::runtime_error(path.string() + ": " + what + ": " + std::strerror(errno));
}

// Numbers as they read back to the last bit.
std::string line_of(const track::FinishedFrame& frame) {
  std::string line = io::number_text(frame.frame) + " " + io::number_text(frame.boxes.size()) +
                     " " + io::number_text(frame.merges.size());
  const auto add = [&line](auto number) { line += " " + io::number_text(number); };
  for (const track::TrackedBox& box : frame.boxes) {
    add(box.id), add(static_cast<int>(box.source));
    add(box.box.left), add(box.box.top), add(box.box.width), add(box.box.height), add(box.score);
  }
  for (const track::IdMerge& merge : frame.merges) add(merge.from), add(merge.to);
  return line;
}

class LineReader {
 public:
  LineReader(std::string_view line, const fs::path& path) : left_(line), path_(path) {}

  template <typename Number>
  Number next() {
    const std::size_t end = std::min(left_.find(' '), left_.size());
    const auto number = io::parse_number<Number>(left_.substr(0, end));
    if (!number) wrong();
    left_.remove_prefix(std::min(end + 1, left_.size()));
    return *number;
  }
  [[noreturn]] void wrong() const { refuse(path_, "holds a line that is no finished frame"); }
  bool empty() const { return left_.empty(); }

 private:
  std::string_view left_;
  const fs::path& path_;
};

track::FinishedFrame frame_of(std::string_view line, const fs::path& path) {
  LineReader reader(line, path);
  track::FinishedFrame frame;
  frame.frame = reader.next<int>();
  const auto boxes = reader.next<std::size_t>(), merges = reader.next<std::size_t>();
  for (std::size_t i = 0; i < boxes; ++i) {
    track::TrackedBox box;
    box.id = reader.next<int>();
    const int source = reader.next<int>();
    if (source < 0 || source > static_cast<int>(track::BoxSource::interpolated)) reader.wrong();
    box.source = static_cast<track::BoxSource>(source);
    for (double* value : {&box.box.left, &box.box.top, &box.box.width, &box.box.height, &box.score})
      *value = reader.next<double>();
    frame.boxes.push_back(box);
  }
  for (std::size_t i = 0; i < merges; ++i) {
    const int from = reader.next<int>();
    frame.merges.push_back({from, reader.next<int>()});
  }
  if (!reader.empty()) reader.wrong();
  return frame;
}

}  // namespace

RunState::RunState(fs::path path, std::string run, int interval)
    : path_(std::move(path)), run_(std::move(run)), interval_(interval) {
  io::require_in("state_every", interval, 1, 1'000'000);
  const auto status = fs::status(path_);
  if (status.type() == fs::file_type::not_found) return;
  if (!fs::is_regular_file(status)) refuse(path_, "is no regular file");
  std::istringstream file(io::read_text(path_));
  std::string title, count, hash, size;
  std::getline(file, title);
  if (title != kTitle) refuse(path_, "is no state of a run of this version");
  std::getline(file, count);
  std::getline(file, hash);
  std::getline(file, size);
  const auto finished = io::parse_number<int>(count);
  const auto lines = io::parse_number<std::uint64_t>(hash);
  const auto length = io::parse_number<std::size_t>(size);
  const std::string rest{std::istreambuf_iterator<char>(file), {}};
  if (!finished || *finished < 0 || !lines || !length || *length > rest.size()) {
    refuse(path_, "is damaged");
  }
  const std::string there = rest.substr(0, *length);
  if (there != run_) {
    refuse(path_, "belongs to another run: " + io::printable(there, 200));
  }
  finished_ = *finished;
  hash_ = *lines;
  snapshot_ = rest.substr(*length);
}

RunState::~RunState() {
  if (frames_ >= 0) ::close(frames_);
}

fs::path RunState::frames_path() const { return path_.string() + ".frames"; }

int RunState::resume(track::Tracker& tracker,
                     const std::function<void(const track::FinishedFrame&)>& finished) {
  std::uintmax_t length = 0;
  if (!snapshot_.empty()) {
    try {
      tracker.restore(std::as_bytes(std::span(snapshot_)));
    } catch (const std::invalid_argument& error) {
      refuse(path_, error.what());
    }
    std::ifstream file(frames_path(), std::ios::binary);
    if (!file && errno != ENOENT) fail(frames_path(), "cannot be opened");
    std::string line;
    std::uint64_t hash = io::kEmptyHash;
    for (int frame = 1; frame <= finished_; ++frame) {
      if (!std::getline(file, line) || file.eof()) {
        if (file.bad()) fail(frames_path(), "cannot be read");
        refuse(frames_path(), "ends before frame " + io::number_text(frame));
      }
      const auto read = frame_of(line, frames_path());
      if (read.frame != frame) refuse(frames_path(), "holds frames out of order");
      finished(read);
      io::hash(hash, line);
      length += line.size() + 1;
    }
    if (hash != hash_) refuse(frames_path(), "is damaged");
    snapshot_ = {};
  }
  frames_ = ::open(frames_path().c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (frames_ < 0) fail(frames_path(), "cannot be opened for writing");
  if (::ftruncate(frames_, static_cast<off_t>(length)) != 0 || ::lseek(frames_, 0, SEEK_END) < 0) {
    fail(frames_path(), "cannot be cut to its length");
  }
  return static_cast<int>(tracker.stats().frames);
}

void RunState::add(const track::FinishedFrame& frame) {
  const std::string line = line_of(frame);
  io::hash(hash_, line);
  pending_ += line + "\n";
  ++finished_;
}

void RunState::frame_done(const track::Tracker& tracker) {
  if (++since_ >= interval_) save(tracker);
}

void RunState::save(const track::Tracker& tracker) {
  since_ = 0;
  if (io::write_all(frames_, pending_) < pending_.size()) fail(frames_path(), "write failed");
  pending_.clear();
  if (io::retry([&] { return ::fsync(frames_); }) != 0) fail(frames_path(), "flush to disk failed");
  const auto snapshot = tracker.save();
  io::OutputFile file(path_);
  std::ostringstream head;
  head << kTitle << "\n" << finished_ << "\n" << hash_ << "\n" << run_.size() << "\n" << run_;
  file.write(head.str());
  file.write(snapshot.data(), snapshot.size());
  file.commit();
}

void RunState::remove() {
  fs::remove(path_);  // first: alone it would be a run that cannot go on
  fs::remove(frames_path());
}

}  // namespace sdmt::pipeline

// SPDX-License-Identifier: Apache-2.0
#include "cli/progress.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "cli/console.h"

namespace sdmt::tools {

namespace {

constexpr int kBarWidth = 24;

// A line that the terminal would wrap could not be redrawn in place. Text of others may be cut in
// the middle of a character.
std::string cut(std::string line, std::size_t columns) {
  if (line.size() > columns) {
    line.resize(columns);
    constexpr unsigned char kContinues = 0x80, kBits = 0xC0, kFirst = 0xC0;
    while (!line.empty() && (static_cast<unsigned char>(line.back()) & kBits) == kContinues) {
      line.pop_back();
    }
    if (!line.empty() && (static_cast<unsigned char>(line.back()) & kBits) == kFirst) {
      line.pop_back();
    }
  }
  return line;
}

std::string clock_text(double seconds) {
  const std::int64_t whole = std::llround(seconds);
  if (whole >= 3600) {
    return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
  }
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

}  // namespace

Progress::Progress(std::string label, std::int64_t total, std::string unit)
    : label_(std::move(label)),
      unit_(std::move(unit)),
      total_(total),
      terminal_(is_terminal()),
      start_(Clock::now()),
      shown_(start_) {}

Progress::~Progress() {
  if (terminal_ && width_ > 0) write_console(stderr, "\n");
}

void Progress::update(std::int64_t done, std::string_view note) {
  if (verbosity() == Verbosity::quiet) return;
  if (first_ < 0) first_ = done > 1 ? done - 1 : 0;
  const auto now = Clock::now();
  const double since_shown = std::chrono::duration<double>(now - shown_).count();
  const bool last = total_ > 0 && done >= total_;
  if (terminal_) {
    if (since_shown < 0.1 && width_ > 0 && !last) return;
  } else {
    const std::int64_t tenth = total_ > 0 ? done * 10 / total_ : 0;
    if (!last && since_shown < (tenth > shown_tenth_ ? 1.0 : 30.0)) return;
    if (last && shown_tenth_ >= 10) return;
    shown_tenth_ = tenth;
  }
  shown_ = now;
  const double seconds = std::chrono::duration<double>(now - start_).count();
  std::string line = text(done, seconds, note, terminal_);
  if (terminal_) {
    constexpr int kUsual = 80;
    const auto room = static_cast<std::size_t>(console_width(stderr).value_or(kUsual) - 1);
    if (line.size() > room) line = cut(text(done, seconds, note, false), room);
    const std::size_t old = std::exchange(width_, line.size());
    say(stderr, "\r{}{:{}}", line, "", old > line.size() ? old - line.size() : 0);
  } else {
    say(stderr, "{}\n", line);
  }
  std::fflush(stderr);
}

std::string Progress::text(std::int64_t done, double seconds, std::string_view note,
                           bool bar) const {
  const double rate = seconds > 0 ? static_cast<double>(done - first_) / seconds : 0;
  std::string line = label_ + " ";
  if (total_ > 0) {
    const double part = std::clamp(static_cast<double>(done) / static_cast<double>(total_), 0., 1.);
    if (bar) {
      const int full = static_cast<int>(part * kBarWidth);
      line += fmt::format("[{:=<{}}{:{}}] ", "", full, "", kBarWidth - full);
    }
    line += fmt::format("{:3.0f} % {}/{} {}", part * 100, done, total_, unit_);
  } else {
    line += fmt::format("{} {}", done, unit_);
  }
  line += fmt::format(", {:.1f} {}/s", rate, unit_);
  if (total_ > done && rate > 0) {
    line += fmt::format(", {} left", clock_text(static_cast<double>(total_ - done) / rate));
  } else {
    line += fmt::format(", {}", clock_text(seconds));
  }
  if (!note.empty()) line += fmt::format(", {}", note);
  return line;
}

}  // namespace sdmt::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "retention.h"
#include "sdmt/pipeline/line_output.h"

namespace sdmt::pipeline {

/// A file that lines are appended to as they come, as open_line_output() says.
class FlowingFile : public LineOutput {
 public:
  FlowingFile(std::string path, Flowing flowing);
  ~FlowingFile() override;
  FlowingFile(const FlowingFile&) = delete;
  FlowingFile& operator=(const FlowingFile&) = delete;

  void write(std::string_view lines) override;
  void commit() override;

 private:
  using Clock = std::chrono::steady_clock;

  void open();
  // Writes all of it, or nothing and returns false with errno.
  bool append(std::string_view lines);
  bool is_old(std::size_t more) const;
  void rotate();
  void fail(int error);
  [[noreturn]] void refuse(const char* what) const;

  std::string path_;
  Flowing flowing_;
  Retention retention_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
  Clock::time_point begun_;
  bool full_ = false;        // the last attempt failed
  Clock::time_point tried_;  // when
  long missing_ = 0;         // lines since then
};

}  // namespace sdmt::pipeline

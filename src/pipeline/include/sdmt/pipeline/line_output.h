// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace sdmt::pipeline {

/// When a file that grows for ever gives way to a new one; 0: not by that.
struct Rotation {
  std::uint64_t bytes = 0;
  double seconds = 0;

  /// "100MB" (kB, MB, GB: 1000 bytes and so on), "1h" (s, min, h, d), or empty: never. Throws
  /// std::invalid_argument, saying that `name` is that, for anything else, less than 1 kB or less
  /// than a second.
  static Rotation parse(const std::string& text, const std::string& name = "rotation");
};

/// How the outputs of an input without an end are kept.
struct Flowing {
  Rotation rotation;
  std::function<void(const std::string&)> tell;  ///< takes one line: the disk is full, and so on
  double keep = 0;  ///< seconds after which what was put aside is removed; 0: never
};

/// Lines of text on their way to a file.
class LineOutput {
 public:
  virtual ~LineOutput() = default;

  /// Whole lines, with their newlines.
  virtual void write(std::string_view lines) = 0;
  /// Makes a file visible that has to be whole.
  virtual void commit() = 0;
};

/// "-" is standard output: each line at once, and none any more once its reader has left. Without
/// `flowing` a file appears whole or not at all: an io::OutputFile, and throws as that.
///
/// With it, lines are appended to the file as they come, and are there even if the program is
/// killed. When the file is to give way it is renamed from NAME.jsonl to NAME.TIME.jsonl with the
/// time in UTC (20260301T140509Z), and removed once it is as old as `keep`. A write that fails
/// (full disk) ends in nothing: the file is cut back to its last whole line, that is told, lines
/// are left out until one can be written again, at most one attempt a second, and then it is told
/// how many are missing. Throws std::runtime_error when the file cannot be opened, or another
/// program is writing it.
std::unique_ptr<LineOutput> open_line_output(const std::string& path,
                                             const std::optional<Flowing>& flowing = {});

/// NAME.TIME.EXTENSION for a file that has given way at this moment; with a number behind the time
/// where there is such a file already.
std::string rotated_name(const std::string& path);

}  // namespace sdmt::pipeline

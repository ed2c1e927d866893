// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdmt/mot/box.h"
#include "sdmt/mot/detection.h"

namespace sdmt::mot {

// The text files of MOTChallenge: one box a line, columns separated by commas (blanks are allowed),
// frames and pixel positions counted from 1. Lines may end in LF or CRLF; empty lines and a UTF-8
// byte order mark at the start are skipped. Frames may come in any order: rows are returned sorted
// by frame, otherwise in file order.
//
// Every reader throws std::invalid_argument naming file, line, column, value and what was expected
// (`det.txt:17: width is -3, expected > 0`) for a missing file, a column that is missing or no
// number, NaN or infinity, a frame below 1, and a size <= 0 (detections) or < 0 (the others), or a
// detection beyond kFarthest pixels.

/// A ground-truth row: frame,id,left,top,width,height,flag[,class,visibility]. MOT15 has no
/// classes; it fills the columns from the eighth on with world coordinates or -1.
struct GroundTruthRow {
  int frame = 1;
  int id = 1;
  Tlwh box;
  bool keep = true;       ///< the seventh column is a keep flag, not a score: false where it is 0
  int category = 0;       ///< 1 pedestrian ... 13 crowd; 0 where the file has no class column
  double visibility = 1;  ///< 0..1 in MOT16 and later
};

/// A result row: frame,id,left,top,width,height,confidence,-1,-1,-1.
struct ResultRow {
  int frame = 1;
  int id = 1;
  Tlwh box;
  double confidence = 1;
  int category = -1;  ///< the eighth column, whole part; -1 where the file has none
};

class ClassFilter;

/// A detection of a frame, with its vector where it came with one.
struct DetectionRow {
  int frame = 1;
  Detection detection;
  std::vector<float> embedding;
};

/// Rows frame,id,left,top,width,height,score[,...]: what a detector found in a sequence. Takes
/// memory by rows, whatever the frame numbers.
class DetectionFile {
 public:
  DetectionFile() = default;
  /// Columns may also be separated by blanks or tabs. `frame_offset` is added to every frame;
  /// `classes`: by the eighth column, only where it is given.
  static DetectionFile read(const std::filesystem::path& path, int frame_offset = 0,
                            const ClassFilter* classes = nullptr);
  /// Rows in any order of frames; all have an embedding of one length, or none has. Throws
  /// std::invalid_argument, beginning with `name`, for more than 10 million frames between two.
  static DetectionFile from_rows(std::vector<DetectionRow> rows, const std::string& name);

  /// Boxes of one frame in file order; empty where the file has none. Any `frame` is allowed.
  std::span<const Detection> frame(int frame) const;
  /// Their vectors, dimension() values each, in the same order; empty without.
  std::span<const float> embeddings(int frame) const;
  /// Values of an embedding; 0 where boxes came without.
  int dimension() const { return dimension_; }
  /// When the frame was taken, in seconds, where the file says so.
  std::optional<double> time(int frame) const;
  void set_times(std::map<int, double> times) { times_ = std::move(times); }
  /// All boxes by frame.
  std::span<const Detection> detections() const { return detections_; }
  /// Largest frame number, 0 when the file is empty.
  int last_frame() const { return frames_.empty() ? 0 : frames_.back(); }
  std::size_t size() const { return detections_.size(); }
  /// False when all boxes have the same score, as in files written with -1 or 1 throughout: then
  /// the score says nothing and track::InputOptions::use_scores should be off.
  bool has_scores() const;

  /// MOTChallenge's format ends with three world coordinates.
  static constexpr int kMostColumns = 10;
  /// Of the line that has most.
  int columns() const { return columns_; }
  /// Boxes by the value of the eighth column where all lines have a whole number in 0..999 there,
  /// as those have to which a detector wrote its classes; else empty.
  const std::map<int, std::size_t>& classes() const { return classes_; }

 private:
  // Where a frame's detections are: first and number.
  std::pair<std::size_t, std::size_t> range(int frame) const;

  std::vector<Detection> detections_;
  std::vector<float> embeddings_;  // [detections, dimension]
  int dimension_ = 0;
  std::vector<int> frames_;         // those that have detections, ascending
  std::vector<std::size_t> first_;  // index of the first detection of each of them
  std::map<int, double> times_;     // by frame
  int columns_ = 0;
  std::map<int, std::size_t> classes_;
};

std::vector<GroundTruthRow> read_ground_truth(const std::filesystem::path& path);
/// What to do with result rows of a frame below 1: the MATLAB devkit passed over them.
enum class RowsBeforeFrame1 { refuse, drop };
std::vector<ResultRow> read_results(const std::filesystem::path& path,
                                    RowsBeforeFrame1 early = RowsBeforeFrame1::refuse);

/// One row as text with its newline: positions with 2 decimals, confidence with up to 6 digits.
std::string format_result(const ResultRow& row);
/// Writes rows in the order given; the file appears whole or not at all. Throws as io::OutputFile.
void write_results(const std::filesystem::path& path, std::span<const ResultRow> rows);

}  // namespace sdmt::mot

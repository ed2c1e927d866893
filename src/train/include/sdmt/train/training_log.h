// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "sdmt/train/trainer.h"

namespace sdmt::train {

/// A CSV file with one row an iteration, readable while the training runs: iteration, loss,
/// mean_distance, hardest_positive, hardest_negative, active_negatives, spread, learning_rate,
/// gradient_norm, images_per_second, validation_auc (empty when not validated), and
/// with a teacher teacher_loss.
/// As a log it grows row by row, unlike the project's other files.
class TrainingLog {
 public:
  /// Begins a new file; for a training that goes on after `iteration` steps (> 0) an older file of
  /// that name keeps its rows up to there, whatever happens while it is rewritten. Throws
  /// std::runtime_error naming the file when it cannot be written, and as io::OutputFile.
  explicit TrainingLog(std::filesystem::path path, std::int64_t iteration = 0,
                       bool has_teacher = false);
  /// `validation` may be null. Throws std::runtime_error naming the file.
  void add(const TrainingStep& step, const Validation* validation, double images_per_second);

 private:
  void write(const std::string& line);

  std::filesystem::path path_;
  bool has_teacher_;
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace sdmt::train

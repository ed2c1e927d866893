// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/training_log.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sdmt/io/delimited_text.h"
#include "sdmt/io/output_file.h"
#include "sdmt/train/configuration.h"

namespace sdmt::train {

namespace {

constexpr const char* kHeader =
    "iteration,loss,mean_distance,hardest_positive,hardest_negative,active_negatives,spread,"
    "learning_rate,gradient_norm,images_per_second,validation_auc";

std::vector<std::string> rows_up_to(const std::filesystem::path& path, std::int64_t iteration) {
  std::vector<std::string> rows;
  if (iteration == 0 || !std::filesystem::exists(path)) return rows;
  io::for_each_line(io::read_text(path), [&](std::size_t, std::string_view text) {
    std::string line(text);
    const auto number = std::strtoll(line.c_str(), nullptr, 10);  // 0 for the header
    if (number >= 1 && number <= iteration) rows.push_back(std::move(line));
  });
  return rows;
}

}  // namespace

TrainingLog::TrainingLog(std::filesystem::path path, std::int64_t iteration, bool has_teacher)
    : path_(std::move(path)), has_teacher_(has_teacher) {
  const std::string header = std::string(kHeader) + (has_teacher_ ? ",teacher_loss" : "");
  const auto kept = rows_up_to(path_, iteration);
  if (!kept.empty()) {  // whole or not at all, so that none is lost
    std::string text = header + "\n";
    for (const auto& row : kept) text += row + "\n";
    io::write_text_file(path_, text);
  }
  file_.reset(std::fopen(path_.c_str(), kept.empty() ? "w" : "a"));
  if (!file_) {
    throw std::runtime_error(path_.string() +
                             ": cannot be opened for writing: " + std::strerror(errno));
  }
  if (kept.empty()) write(header);
}

void TrainingLog::add(const TrainingStep& step, const Validation* validation,
                      double images_per_second) {
  std::string line = std::to_string(step.iteration);
  for (const double value :
       {step.loss, step.mining.mean_distance, step.mining.hardest_positive,
        step.mining.hardest_negative, step.mining.active_negatives, step.mining.spread,
        step.learning_rate, step.gradient_norm, images_per_second}) {
    line += "," + to_text(value);
  }
  line += ",";
  if (validation != nullptr && !validation->auc.empty()) line += to_text(validation->mean_auc);
  if (has_teacher_) line += "," + to_text(step.teacher_loss.value_or(0));
  write(line);
}

void TrainingLog::write(const std::string& line) {
  if (std::fprintf(file_.get(), "%s\n", line.c_str()) < 0 || std::fflush(file_.get()) != 0) {
    throw std::runtime_error(path_.string() + ": write failed: " + std::strerror(errno));
  }
}

}  // namespace sdmt::train

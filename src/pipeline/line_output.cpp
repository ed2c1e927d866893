// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/line_output.h"

#include <fmt/core.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <stdexcept>

#include "flowing_file.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/io/output_file.h"
#include "sdmt/pipeline/utc_time.h"

namespace sdmt::pipeline {

namespace {

// Standard output ("-") is to be seen at once.
class WholeFile : public LineOutput {
 public:
  explicit WholeFile(const std::string& path) : file_(path), live_(path == "-") {}

  void write(std::string_view lines) override {
    if (deserted_) return;
    try {
      file_.write(lines);
      if (live_) file_.flush();
    } catch (const io::ReaderLeft&) {
      // SIGPIPE came with it and ends the run; the other outputs must still become whole.
      deserted_ = true;
    }
  }
  void commit() override {
    if (!deserted_) file_.commit();
  }

 private:
  io::OutputFile file_;
  bool live_;
  bool deserted_ = false;
};

}  // namespace

Rotation Rotation::parse(const std::string& text, const std::string& name) {
  if (text.empty()) return {};
  struct Unit {
    std::string_view name;
    double factor;
    bool size;
  };
  constexpr std::array kUnits{
      Unit{"kB", 1e3, true},  Unit{"MB", 1e6, true},  Unit{"GB", 1e9, true},  Unit{"s", 1, false},
      Unit{"min", 60, false}, Unit{"h", 3600, false}, Unit{"d", 86400, false}};
  const auto end = text.find_first_not_of("0123456789.");
  const auto number = io::parse_number<double>(text.substr(0, end));
  for (const Unit& unit : kUnits) {
    if (!number || end == std::string::npos || text.substr(end) != unit.name) continue;
    const double value = *number * unit.factor;
    if (unit.size && value >= 1e3 && value <= 1e15) {
      return {.bytes = static_cast<std::uint64_t>(value)};
    }
    if (!unit.size && value >= 1 && value <= 1e9) return {.seconds = value};
  }
  throw std::invalid_argument(name + " is " + io::quoted(text) +
                              ", expected a size from 1kB (kB, MB, GB) or a time from 1s (s, min, "
                              "h, d)");
}

std::unique_ptr<LineOutput> open_line_output(const std::string& path,
                                             const std::optional<Flowing>& flowing) {
  std::error_code ignored;
  if (!flowing || path == "-" || std::filesystem::is_other(path, ignored)) {
    return std::make_unique<WholeFile>(path);
  }
  return std::make_unique<FlowingFile>(path, *flowing);
}

std::string rotated_name(const std::string& path) {
  const std::filesystem::path whole(path);
  // 20260301T140509Z, from 2026-03-01T14:05:09.250Z
  std::string time = utc_text(std::chrono::system_clock::now()).substr(0, 19) + "Z";
  std::erase_if(time, [](char c) { return c == '-' || c == ':'; });
  std::string name;
  for (int n = 1; n == 1 || std::filesystem::exists(name); ++n) {
    const auto file = whole.stem().string() + "." + time + (n > 1 ? "-" + std::to_string(n) : "") +
                      whole.extension().string();
    name = whole.parent_path() / file;
  }
  return name;
}

}  // namespace sdmt::pipeline

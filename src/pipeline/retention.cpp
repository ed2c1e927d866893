// SPDX-License-Identifier: Apache-2.0
#include "retention.h"

#include <algorithm>
#include <string_view>
#include <system_error>

namespace sdmt::pipeline {

namespace {

namespace fs = std::filesystem;

// ".20260301T140509Z" or ".20260301T140509Z-2", as rotated_name() puts it between stem and
// extension.
bool is_time(std::string_view text) {
  constexpr std::string_view kForm = ".00000000T000000Z";
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  if (text.size() < kForm.size()) return false;
  for (std::size_t i = 0; i < kForm.size(); ++i) {
    if (kForm[i] == '0' ? !digit(text[i]) : text[i] != kForm[i]) return false;
  }
  text.remove_prefix(kForm.size());
  if (text.empty()) return true;
  return text.size() > 1 && text.front() == '-' && std::all_of(text.begin() + 1, text.end(), digit);
}

bool is_put_aside(const std::string& name, const fs::path& path) {
  const std::string stem = path.stem(), extension = path.extension();
  return name.size() > stem.size() + extension.size() && name.starts_with(stem) &&
         name.ends_with(extension) &&
         is_time(std::string_view(name).substr(stem.size(),
                                               name.size() - stem.size() - extension.size()));
}

}  // namespace

void Retention::look() {
  if (!(keep_ > 0)) return;
  const auto now = Clock::now();
  if (looked_ != Clock::time_point{} && now - looked_ < std::chrono::minutes(1)) return;
  looked_ = now;
  std::error_code failed;
  const auto folder = path_.has_parent_path() ? path_.parent_path() : fs::path(".");
  const auto oldest =
      fs::file_time_type::clock::now() - std::chrono::duration_cast<fs::file_time_type::duration>(
                                             std::chrono::duration<double>(keep_));
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    std::error_code ignored;
    const fs::path& file = entry->path();
    if (!is_put_aside(file.filename(), path_) || fs::is_symlink(entry->symlink_status(ignored)) ||
        !entry->is_regular_file(ignored)) {
      continue;
    }
    const auto written = entry->last_write_time(ignored);
    if (ignored || written > oldest) continue;
    std::error_code kept;
    fs::remove(file, kept);
    if (kept && (told_ == Clock::time_point{} || now - told_ > std::chrono::hours(1))) {
      told_ = now;
      tell_(file.string() + ": is old enough, but cannot be removed: " + kept.message());
    }
  }
}

}  // namespace sdmt::pipeline

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/ground_truth.h"

#include <algorithm>
#include <stdexcept>

#include "sdmt/mot/sequence.h"

namespace sdmt::eval {

namespace fs = std::filesystem;

namespace {

fs::path ground_truth_file(const fs::path& folder) {
  const fs::path flat = folder / "gt.txt";
  return fs::is_regular_file(flat) ? flat : folder / "gt" / "gt.txt";
}

}  // namespace

std::string sequence_name(const fs::path& folder) {
  const fs::path named = fs::absolute(folder).lexically_normal();
  return (named.has_filename() ? named : named.parent_path()).filename().string();
}

GroundTruth read_sequence_ground_truth(const fs::path& folder) {
  GroundTruth gt;
  gt.file = ground_truth_file(folder);
  gt.rows = mot::read_ground_truth(gt.file);
  if (mot::Sequence::is_sequence(folder)) gt.num_frames = mot::Sequence::read(folder).length;
  gt.has_length = gt.num_frames > 0;
  if (!gt.has_length && !gt.rows.empty()) gt.num_frames = gt.rows.back().frame;
  gt.name = sequence_name(folder);
  return gt;
}

std::vector<fs::path> find_sequences(const fs::path& path) {
  if (!fs::is_directory(path)) {
    throw std::invalid_argument(
        path.string() + (fs::exists(path) ? ": is a file, expected the folder of the sequence, "
                                            "which holds gt/gt.txt, or one of such folders"
                                          : ": no such folder"));
  }
  if (fs::is_regular_file(ground_truth_file(path))) return {path};
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(path)) {
    if (!entry.is_directory()) continue;
    if (fs::is_regular_file(ground_truth_file(entry.path()))) {
      folders.push_back(entry.path());
    } else if (mot::Sequence::is_sequence(entry.path())) {
      throw std::invalid_argument(entry.path().string() +
                                  ": has a seqinfo.ini but no ground truth, expected gt/gt.txt");
    }
  }
  if (folders.empty()) {
    throw std::invalid_argument(path.string() +
                                ": neither gt/gt.txt nor subfolders with gt/gt.txt");
  }
  std::sort(folders.begin(), folders.end());
  return folders;
}

}  // namespace sdmt::eval

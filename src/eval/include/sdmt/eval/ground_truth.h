// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "sdmt/mot/mot_file.h"

namespace sdmt::eval {

/// The annotation of one sequence.
struct GroundTruth {
  std::string name;            ///< sequence_name()
  std::filesystem::path file;  ///< for messages
  int num_frames = 0;          ///< seqLength of seqinfo.ini; without one, the last annotated frame
  bool has_length = false;     ///< num_frames comes from seqinfo.ini
  std::vector<mot::GroundTruthRow> rows;  ///< by frame
};

/// The name of the sequence in `folder`: the folder's own. Result files are named after it, and
/// seqinfo.ini's name is not always the same (MOT17-02 in the folder MOT17-02-FRCNN).
std::string sequence_name(const std::filesystem::path& folder);

/// Reads FOLDER/gt/gt.txt (or FOLDER/gt.txt) and FOLDER/seqinfo.ini where it exists. Throws
/// std::invalid_argument naming the file for a missing file or a malformed row.
GroundTruth read_sequence_ground_truth(const std::filesystem::path& folder);

/// Sequence folders found at `path`: itself when it holds ground truth, else its subfolders that
/// do, by name. Throws std::invalid_argument when there is none, or when a sequence among them
/// (with seqinfo.ini) has no ground truth: a score must not leave it out unnoticed.
std::vector<std::filesystem::path> find_sequences(const std::filesystem::path& path);

}  // namespace sdmt::eval

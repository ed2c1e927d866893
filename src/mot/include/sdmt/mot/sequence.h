// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace sdmt::mot {

/// A MOTChallenge sequence folder: seqinfo.ini and, where they exist, img1/%06d.jpg, det/det.txt
/// and gt/gt.txt.
struct Sequence {
  std::filesystem::path folder;
  std::string name;                      ///< default: the folder's name
  std::string image_folder = "img1";     ///< imDir
  std::string image_extension = ".jpg";  ///< imExt
  double frame_rate = 30;                ///< frames per second
  int length = 0;                        ///< frames; 0 when not stated
  int width = 0;                         ///< pixels; 0 when not stated
  int height = 0;                        ///< pixels; 0 when not stated

  /// True when `path` is a folder that holds a seqinfo.ini.
  static bool is_sequence(const std::filesystem::path& path);
  /// Reads folder/seqinfo.ini. Throws std::invalid_argument naming file, line and key for a missing
  /// file or a value that is no number or out of range; unknown keys are ignored.
  static Sequence read(const std::filesystem::path& folder);

  /// Path of frame `frame`, counted from 1.
  std::filesystem::path image(int frame) const;
  std::filesystem::path detections() const { return folder / "det" / "det.txt"; }
  std::filesystem::path ground_truth() const { return folder / "gt" / "gt.txt"; }
  /// True when the image folder holds any image of the extension.
  bool has_images() const;
};

}  // namespace sdmt::mot

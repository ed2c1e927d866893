// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace sdmt::mot {

/// Whether the name's extension is one of images, in upper or lower case: .jpg, .jpeg, .png, .bmp,
/// .ppm, .tif, .tiff, .webp.
bool is_image_name(const std::filesystem::path& path);

/// A MOTChallenge sequence folder: seqinfo.ini and, where they exist, img1/%06d.jpg, det/det.txt
/// and gt/gt.txt. How the images are numbered is read from their names: with any number of digits,
/// with text in front, from 0 or from elsewhere instead of 1.
struct Sequence {
  std::filesystem::path folder;
  std::string name;                      ///< default: the folder's name
  std::string image_folder = "img1";     ///< imDir
  std::string image_extension = ".jpg";  ///< imExt, or that of the numbered images there are
  std::string image_prefix;              ///< what their names have in front of the number
  int image_digits = 6;                  ///< digits of the number, zeros in front
  int first_image = 1;                   ///< the number that belongs to frame 1
  int last_image_frame = 0;              ///< the last frame that has an image; 0 without images
  double frame_rate = 30;                ///< frames per second
  int length = 0;                        ///< frames; 0 when not stated
  int width = 0;                         ///< pixels; 0 when not stated
  int height = 0;                        ///< pixels; 0 when not stated

  /// True when `path` is a folder that holds a seqinfo.ini. Throws std::runtime_error when that
  /// cannot be found out.
  static bool is_sequence(const std::filesystem::path& path);
  /// Reads folder/seqinfo.ini and the names of the images. Images are numbered from frame 1 on,
  /// unless there is a number 0, or the numbers reach beyond `length` but are no more than
  /// `length`: then the smallest belongs to frame 1. Hidden files (names beginning with a dot) are
  /// no images. Throws std::invalid_argument naming file, line and key for a missing file or a
  /// value that is no number or out of range, std::runtime_error for a folder of images that is
  /// there but cannot be listed; unknown keys are ignored.
  static Sequence read(const std::filesystem::path& folder);

  /// Path of the image of frame `frame`, counted from 1.
  std::filesystem::path image(int frame) const;
  std::filesystem::path detections() const { return folder / "det" / "det.txt"; }
  std::filesystem::path ground_truth() const { return folder / "gt" / "gt.txt"; }
  /// True when the image folder holds any image of the extension. Throws std::runtime_error as
  /// read().
  bool has_images() const;
};

}  // namespace sdmt::mot

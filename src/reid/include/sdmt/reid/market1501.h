// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

namespace sdmt::reid {

/// The pid of background and false alarms of the person detector: they match nobody.
constexpr int kDistractorPid = 0;

/// One cropped pedestrian of a re-identification set.
struct ReidImage {
  std::filesystem::path path;
  int pid = 0;    ///< identity, >= 0; kDistractorPid is no identity
  int camid = 0;  ///< camera, >= 0, as in the file name
};

/// The three folders of Market-1501 (Zheng et al., ICCV 2015): bounding_box_train, query and
/// bounding_box_test (the gallery, which holds the distractors).
enum class Split { train, query, gallery };

/// What a folder holds beside the images that are taken from it.
struct LeftOut {
  std::size_t background = 0;   ///< images of pid 0000, where people are asked for
  std::size_t junk = 0;         ///< images of pid -1
  std::size_t other_files = 0;  ///< of other kinds (.bmp, Thumbs.db); hidden ones are not counted

  LeftOut& operator+=(const LeftOut& other);
  /// "6 of the background (pid 0000), 3 neither .jpg nor .png"; empty where nothing is left out.
  std::string text() const;
};

/// All .jpg, .jpeg and .png files directly in `folder`, sorted by file name, so that the order does
/// not depend on the file system. The names are those of Market-1501: PID_cCAM..., as in
/// 0002_c1s1_000451_03.jpg; what follows the camera is free. Junk (pid -1: bad boxes, which the
/// protocol neither rewards nor punishes) is dropped, distractors (0000) are kept.
/// Files of other kinds (Thumbs.db) and hidden ones (._0002_c1.jpg) are passed over. Images are not
/// opened; a link that leads nowhere is an image that cannot be read. What is left out is added to
/// `left_out` unless it is null.
/// Throws std::invalid_argument when the folder does not exist, has no such image, or a name does
/// not parse; the message names the folder or file.
std::vector<ReidImage> list_reid_images(const std::filesystem::path& folder,
                                        LeftOut* left_out = nullptr);

/// The files of such a folder whatever their names; pid and camid are 0. Throws as
/// list_reid_images() but for names.
std::vector<ReidImage> list_nameless_images(const std::filesystem::path& folder,
                                            LeftOut* left_out = nullptr);

/// Where the images of `split` lie for a data set at `root`: its subfolder of Market-1501's name
/// or, for Split::train only and when there is no such subfolder, `root` itself. Throws
/// std::invalid_argument when there is neither.
std::filesystem::path split_folder(const std::filesystem::path& root, Split split);

/// True when `root` has the subfolder of `split`.
bool has_split(const std::filesystem::path& root, Split split);

/// The people to validate on in a data set at `root`: query and gallery together when it has them
/// (sorted by file name within each, query first), else the images of its train split; distractors
/// dropped. Throws as list_reid_images().
std::vector<ReidImage> list_validation_images(const std::filesystem::path& root);

}  // namespace sdmt::reid

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sdmt/io/hash.h"
#include "sdmt/media/image_file.h"
#include "sdmt/nn/process_group.h"
#include "sdmt/nn/tensor.h"
#include "sdmt/reid/market1501.h"

namespace sdmt::train {

/// A person to train on.
struct Identity {
  int source = 0;           ///< folder the person is from, counted from 0
  int pid = 0;              ///< in that folder
  std::vector<int> images;  ///< indices into TrainingSet::images
};

/// People never trained on, for choosing among models. All decoded.
struct ValidationSet {
  std::string name;
  std::vector<image::Image> images;
  std::vector<std::filesystem::path> files;  ///< as TrainingSet::files
  std::vector<int> labels;                   ///< equal: the same person
};

/// The images that a training sees. Everything is decoded once, by all threads, ahead of the
/// training, and kept in memory (3 bytes a pixel: 290 MB for Market-1501); processes of a group
/// decode a share each, and others when they need them.
struct TrainingSet {
  std::vector<image::Image> images;          ///< 0 x 0 pixels: not decoded yet
  std::vector<std::filesystem::path> files;  ///< of the images; empty: all are decoded
  std::vector<Identity> identities;
  std::vector<int> unlabelled;       ///< indices into images: those that nobody has named
  nn::Tensor teacher;                ///< a vector for each image [images,1,1,d]; empty: no teacher
  std::vector<std::string> sources;  ///< names of the folders
  std::vector<ValidationSet> validation;
  std::vector<std::filesystem::path> unreadable;  ///< left out, also links that lead nowhere
  reid::LeftOut left_out;                         ///< of the folders trained on, other reasons
  /// Hashes of the file names in order, which tell one choice of data from another.
  std::uint64_t fingerprint = io::kEmptyHash;
  std::uint64_t validation_fingerprint = io::kEmptyHash;
};

struct TrainingSetOptions {
  /// Data sets in Market-1501's layout (their train split) or folders of images. Their people are
  /// taken to be different: pid 5 of one folder is not pid 5 of another. At least one.
  std::vector<std::filesystem::path> folders;
  /// Folders of images without identities, whatever the files' names, or data sets whose names are
  /// not to be used (their train split). They learn from the teacher only, so there must be one.
  std::vector<std::filesystem::path> unlabelled_folders;
  /// Files of a teacher's vectors (reid::EmbeddingFile), together one for each image. An image is
  /// known to them by the name of its folder and what follows,
  /// "cuhk03/bounding_box_train/NAME.jpg": a name in a file may have more before that, but no two
  /// images may share it.
  std::vector<std::filesystem::path> teachers;
  /// People of every folder kept out of the training, drawn by the seed, as one validation set a
  /// folder; >= 0.
  int holdout_identities = 0;
  /// Data sets to validate on: see list_validation_images().
  std::vector<std::filesystem::path> validation_folders;
  /// Images of a validation set at most, taken as whole people evenly spread over the folder, as
  /// the number of pairs grows with its square; >= 2.
  int max_validation_images = 2000;
  std::uint64_t seed = 0;

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// Lists and decodes the images. Those of the background (pid 0000) show nobody and are left out.
/// Throws std::invalid_argument as the readers of the folders do; when fewer than two people
/// remain, when nobody has two images, when a validation set has no two images of one person or
/// not two people; when more than 1 % of the images cannot be read or one has fewer than 2x2
/// pixels; and when the teacher has no vector of an image, or two. All processes of a group see the
/// same files, and leave out an image that one of them cannot read.
TrainingSet load_training_set(const TrainingSetOptions& options,
                              nn::ProcessGroup& group = nn::ProcessGroup::alone());

}  // namespace sdmt::train

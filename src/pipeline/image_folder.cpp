// SPDX-License-Identifier: Apache-2.0
#include "image_folder.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "folder_listing.h"
#include "sdmt/media/image_file.h"
#include "sdmt/mot/sequence.h"

namespace sdmt::pipeline {

namespace {

namespace fs = std::filesystem;

// Reads an image of a folder; says in the frame why it could not.
void read_frame(const fs::path& file, bool decode, Frame& frame) {
  frame.problem.clear();
  frame.image = {};
  if (!decode) return;
  try {
    frame.image = media::read_image(file);
  } catch (const std::invalid_argument& error) {
    frame.problem = error.what();
  } catch (const std::runtime_error& error) {
    frame.problem = error.what();
  }
}

// The last number in a name without its extension; -1 where there is none.
long last_number(const fs::path& file) {
  const std::string stem = file.stem().string();
  const auto end = stem.find_last_of("0123456789");
  if (end == std::string::npos) return -1;
  const auto begin = stem.find_last_not_of("0123456789", end) + 1;
  return end - begin < 18 ? std::stol(stem.substr(begin, end - begin + 1)) : -1;
}

class ImageFolder : public FrameSource {
 public:
  explicit ImageFolder(const std::string& folder) : folder_(folder), listing_(list_images(folder)) {
    if (!listing_.images.empty()) return;
    const std::string there = listing_.left_out.empty() ? "it is empty" : listing_.left_out;
    throw std::invalid_argument(
        folder + ": holds neither seqinfo.ini nor images (.jpg, .png, ...): " + there);
  }

  bool next(Frame& frame, bool decode) override {
    if (next_ == listing_.images.size()) return false;
    read_frame(listing_.images[next_], decode, frame);
    frame.number = static_cast<int>(++next_);
    return true;
  }
  int frame_count() const override { return static_cast<int>(listing_.images.size()); }
  double frame_rate() const override { return 0; }
  std::vector<std::string> notes() const override {
    if (listing_.left_out.empty()) return {};
    return {folder_ + ": " + listing_.left_out};
  }
  std::string numbering() const override {
    const auto& images = listing_.images;
    for (std::size_t i = 0; i < images.size(); ++i) {
      const long number = last_number(images[i]);
      if (number == static_cast<long>(i) + 1) continue;
      if (number < 0) return {};  // these names number nothing
      return fmt::format(
          "{}: frames are counted in the order of the names, whatever number these hold: frame {} "
          "is {}, frame {} is {}",
          folder_, i + 1, images[i].filename().string(), images.size(),
          images.back().filename().string());
    }
    return {};
  }

 private:
  std::string folder_;
  ImageListing listing_;
  std::size_t next_ = 0;
};

class MotSequence : public FrameSource {
 public:
  explicit MotSequence(const std::string& folder)
      : sequence_(mot::Sequence::read(folder)), has_images_(sequence_.has_images()) {
    if (sequence_.length == 0) sequence_.length = sequence_.last_image_frame;
    if (sequence_.length == 0) {
      throw std::invalid_argument((fs::path(folder) / "seqinfo.ini").string() +
                                  ": seqLength is missing and there are no frames to count");
    }
  }

  bool next(Frame& frame, bool decode) override {
    if (last_ == sequence_.length) return false;
    frame.number = ++last_;
    if (sequence_.frame_rate > 0) frame.when.time = (last_ - 1) / sequence_.frame_rate;
    read_frame(sequence_.image(last_), decode && has_images_, frame);
    return true;
  }
  int frame_count() const override { return sequence_.length; }
  double frame_rate() const override { return sequence_.frame_rate; }
  bool has_images() const override { return has_images_; }
  std::vector<std::string> notes() const override {
    std::vector<std::string> notes;
    const auto images = (sequence_.folder / sequence_.image_folder).string();
    if (sequence_.first_image != 1) {
      notes.push_back(fmt::format("{}: images are numbered from {}: {} is taken as frame 1", images,
                                  sequence_.first_image, sequence_.image(1).filename().string()));
    }
    if (sequence_.last_image_frame > sequence_.length) {
      notes.push_back(
          fmt::format("{}: holds images up to frame {}, but seqLength is {}; the rest "
                      "is ignored",
                      images, sequence_.last_image_frame, sequence_.length));
    }
    return notes;
  }

 private:
  mot::Sequence sequence_;
  bool has_images_;
  int last_ = 0;
};

}  // namespace

std::unique_ptr<FrameSource> open_image_folder(const std::string& folder) {
  return std::make_unique<ImageFolder>(folder);
}

std::unique_ptr<FrameSource> open_mot_sequence(const std::string& folder) {
  return std::make_unique<MotSequence>(folder);
}

}  // namespace sdmt::pipeline

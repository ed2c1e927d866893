// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/video_output_file.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <map>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "ffmpeg_capture.h"
#include "frame_rates.h"
#include "mat_view.h"

namespace sdmt::pipeline {

namespace {

namespace fs = std::filesystem;

std::string lower_case_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

// Encoders to try, best first, by what the container can hold.
const std::vector<int>& encoders(const fs::path& path) {
  static const int kH264 = cv::VideoWriter::fourcc('a', 'v', 'c', '1');
  static const int kMpeg4 = cv::VideoWriter::fourcc('m', 'p', '4', 'v');
  static const int kMotionJpeg = cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
  static const std::map<std::string, std::vector<int>> kByExtension{{".mp4", {kH264, kMpeg4}},
                                                                    {".mov", {kH264, kMpeg4}},
                                                                    {".mkv", {kH264, kMpeg4}},
                                                                    {".avi", {kMotionJpeg}}};
  const auto found = kByExtension.find(lower_case_extension(path));
  if (found == kByExtension.end()) {
    throw std::invalid_argument(path.string() + ": unknown kind of video, expected the extension " +
                                ".mp4, .mov, .mkv or .avi");
  }
  return found->second;
}

[[noreturn]] void fail(const fs::path& path, const char* what) {
  throw std::runtime_error(fmt::format("{}: {}: {}", path.string(), what, std::strerror(errno)));
}

// The file that a link names, or will name.
fs::path resolved(const fs::path& path) {
  std::error_code failed;
  if (!fs::is_symlink(path, failed)) return path;
  auto target = fs::weakly_canonical(path, failed);
  if (failed || fs::is_symlink(target, failed)) {
    const auto link = fs::read_symlink(path, failed);
    target = link.is_absolute() ? link : path.parent_path() / link;
  }
  return target;
}

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

void flush_to_disk(const fs::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor < 0) fail(path, "cannot be opened to flush it to disk");
  const bool flushed = ::fsync(descriptor) == 0 || errno == EINVAL;  // some file systems cannot
  ::close(descriptor);
  if (!flushed) fail(path, "flush to disk failed");
}

}  // namespace

// OpenCV opens the file that it writes by its name, and the container is chosen by the name's end:
// a folder of our own keeps others, and links, from that name.
class VideoOutputFile::TemporaryFolder {
 public:
  explicit TemporaryFolder(const fs::path& path)
      : folder_(folder_of(path) / ("." + path.filename().string() + ".tmp")),
        video_(folder_ / ("video" + lower_case_extension(path))) {
    constexpr mode_t kOnlyUs = 0700;
    if (::mkdir(folder_.c_str(), kOnlyUs) != 0 && errno != EEXIST) {
      fail(path, "cannot be opened for writing");
    }
    descriptor_ = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    struct stat status {};
    if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0 || status.st_uid != ::geteuid()) {
      if (descriptor_ >= 0) ::close(descriptor_);
      throw std::runtime_error(fmt::format("{}: is in the way of writing {}, expected no such file",
                                           folder_.string(), path.string()));
    }
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
      ::close(descriptor_);
      throw std::runtime_error(path.string() + ": is being written by another program");
    }
    std::error_code ignored;
    fs::remove(video_, ignored);  // of a killed program
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove(video_, ignored);
    fs::remove(folder_, ignored);
    ::close(descriptor_);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const fs::path& video() const { return video_; }

 private:
  fs::path folder_;
  fs::path video_;
  int descriptor_ = -1;
};

struct VideoOutputFile::Encoder {
  cv::VideoWriter writer;
  cv::Size size;
};

VideoOutputFile::VideoOutputFile(const fs::path& path, double frame_rate)
    : path_(resolved(path)), frame_rate_(frame_rate) {
  encoders(path_);
  if (!(frame_rate >= kLowestFrameRate && frame_rate <= kHighestFrameRate)) {
    throw std::invalid_argument(fmt::format("{}: frame rate is {}, expected {} to {} a second",
                                            path_.string(), frame_rate, kLowestFrameRate,
                                            kHighestFrameRate));
  }
  std::error_code ignored;
  if (!fs::is_directory(folder_of(path_), ignored)) {
    throw std::invalid_argument(
        fmt::format("{}: folder {} does not exist", path_.string(), folder_of(path_).string()));
  }
  if (fs::exists(path_, ignored) && !fs::is_regular_file(path_, ignored)) {
    throw std::invalid_argument(path_.string() + ": is not a regular file");
  }
  folder_ = std::make_unique<TemporaryFolder>(path_);
}

VideoOutputFile::~VideoOutputFile() = default;

void VideoOutputFile::open(int width, int height) {
  auto encoder = std::make_unique<Encoder>();
  encoder->size = {width & ~1, height & ~1};
  if (encoder->size.empty()) {
    throw std::invalid_argument(fmt::format("{}: frames of {} x {} pixels cannot be encoded",
                                            path_.string(), width, height));
  }
  for (const int kind : encoders(path_)) {
    if (encoder->writer.open(folder_->video().string(), cv::CAP_FFMPEG, kind, frame_rate_,
                             encoder->size)) {
      encoder_ = std::move(encoder);
      return;
    }
  }
  throw std::runtime_error(path_.string() +
                           ": cannot be opened for writing, or OpenCV has no encoder for it");
}

void VideoOutputFile::write(const image::Image& image) {
  if (encoder_ == nullptr) open(image.width, image.height);
  const cv::Size size = encoder_->size;
  const cv::Mat view = mat_view(image);
  if (view.cols >= size.width && view.rows >= size.height) {
    encoder_->writer.write(view(cv::Rect({0, 0}, size)));
  } else {
    cv::Mat resized;
    cv::resize(view, resized, size);
    encoder_->writer.write(resized);
  }
  ++frames_;
}

void VideoOutputFile::commit() {
  if (frames_ == 0) throw std::runtime_error(path_.string() + ": there are no frames to write");
  encoder_->writer.release();
  const fs::path& video = folder_->video();
  // The encoder does not say when the disk is full, and a container only estimates its length.
  int readable = 0;
  auto written = open_with_ffmpeg(video.string());
  while (written.isOpened() && readable < frames_ && written.grab()) ++readable;
  written.release();
  if (readable < frames_) {
    throw std::runtime_error(
        fmt::format("{}: writing failed, {} of {} frames can be read back (is the disk full?)",
                    path_.string(), readable, frames_));
  }
  struct stat old {};
  if (::stat(path_.c_str(), &old) == 0) ::chmod(video.c_str(), old.st_mode & 07777);
  flush_to_disk(video, O_RDWR);
  if (std::rename(video.c_str(), path_.c_str()) != 0) fail(path_, "rename failed");
  flush_to_disk(folder_of(path_), O_RDONLY | O_DIRECTORY);
  folder_.reset();
}

}  // namespace sdmt::pipeline

// SPDX-License-Identifier: Apache-2.0
// The binary's own media::decode_pixels() and so on. They stand in for those of the module's
// libraries, which are then not linked.
#include <dlfcn.h>

#include <exception>
#include <string>
#include <string_view>
#include <utility>

#include "codecs/codecs.h"

namespace sdmt::tools {

namespace {

constexpr const char* kLibrary = "sdmt-codecs.so";

// No std::runtime_error: those of an image mean that it is left out.
class CodecsMissing : public std::exception {
 public:
  explicit CodecsMissing(const std::string& why)
      : message_(std::string(kLibrary) + ", by which images and videos are read and written, " +
                 why + "; is sdmt installed as a whole?") {}
  const char* what() const noexcept override { return message_.c_str(); }

 private:
  std::string message_;
};

// It is found by the binary's RUNPATH.
const Codecs* load() {
  void* library = dlopen(kLibrary, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) throw CodecsMissing(std::string("cannot be loaded: ") + dlerror());
  const auto table = reinterpret_cast<decltype(&sdmt_codecs)>(dlsym(library, "sdmt_codecs"));
  if (table == nullptr || table()->version != std::string_view(SDMT_VERSION)) {
    throw CodecsMissing("is of another version");
  }
  return table();
}

const Codecs& codecs() {
  static const Codecs* loaded = load();
  return *loaded;
}

}  // namespace

}  // namespace sdmt::tools

namespace sdmt::media {

std::optional<image::Image> decode_pixels(std::span<const std::uint8_t> bytes) {
  return tools::codecs().decode_pixels(bytes);
}
std::vector<std::uint8_t> encode_pixels(const std::string& extension, const image::Image& image,
                                        const std::vector<int>& settings) {
  return tools::codecs().encode_pixels(extension, image, settings);
}

}  // namespace sdmt::media

namespace sdmt::pipeline {

std::unique_ptr<cv::VideoCapture> capture_with_ffmpeg(const std::string& name) {
  return tools::codecs().capture_with_ffmpeg(name);
}
std::unique_ptr<cv::VideoCapture> capture_camera(int number) {
  return tools::codecs().capture_camera(number);
}
std::unique_ptr<cv::VideoWriter> write_with_ffmpeg(const std::string& file, int codec,
                                                   double frame_rate, cv::Size size) {
  return tools::codecs().write_with_ffmpeg(file, codec, frame_rate, size);
}
std::unique_ptr<FrameSource> open_live_stream(const std::string& url, double timeout,
                                              std::function<bool()> stopped) {
  return tools::codecs().open_live_stream(url, timeout, std::move(stopped));
}
std::unique_ptr<FrameSource> open_piped_stream(std::function<bool()> stopped) {
  return tools::codecs().open_piped_stream(std::move(stopped));
}

}  // namespace sdmt::pipeline

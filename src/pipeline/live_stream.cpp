// SPDX-License-Identifier: Apache-2.0
#include "live_stream.h"

#include <fmt/core.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libswscale/swscale.h>
}

#include "frame_rates.h"

namespace sdmt::pipeline {

namespace {

using Clock = std::chrono::steady_clock;

std::string error_text(int error) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(error, text.data(), text.size());
  return text.data();
}

class LiveStream : public FrameSource {
 public:
  // Without a URL: standard input.
  LiveStream(const std::string& url, double timeout, std::function<bool()> stopped)
      : piped_(url.empty()),
        name_(piped_ ? "standard input" : display_name(url)),
        timeout_(timeout),
        stopped_(std::move(stopped)) {
    try {
      open(url);
    } catch (...) {
      close();
      throw;
    }
  }
  ~LiveStream() override { close(); }
  LiveStream(const LiveStream&) = delete;
  LiveStream& operator=(const LiveStream&) = delete;

  bool next(Frame& frame, bool decode) override {
    waits_since_ = Clock::now();
    int result = 0;
    while ((result = avcodec_receive_frame(decoder_, picture_)) != 0 || is_garbled()) {
      if (result == AVERROR_EOF) return false;
      if (result != AVERROR(EAGAIN)) ++garbled_;
      if (result == AVERROR(EAGAIN) && !feed()) return false;
    }
    frame.number = ++number_;
    frame.problem.clear();
    tell_time(frame.when);
    frame.image = {};
    size_ = {picture_->width, picture_->height};
    if (decode) convert(frame.image);
    return true;
  }
  int frame_count() const override { return 0; }
  double frame_rate() const override {
    // Motion JPEG over HTTP knows no times.
    if (format_->iformat->name == std::string_view("mpjpeg")) return 0;
    const double rate = av_q2d(stream().avg_frame_rate);
    return rate >= kLowestFrameRate && rate <= kHighestFrameRate ? rate : 0;
  }
  image::PictureSize picture() const override { return size_; }
  bool endless() const override {
    if (piped_) return false;
    return stream().nb_frames == 0 && format_->duration == AV_NOPTS_VALUE;
  }
  bool repeatable() const override { return false; }
  std::int64_t garbled() const override { return garbled_; }
  std::string why_it_ended() const override { return why_; }

 private:
  const AVStream& stream() const { return *format_->streams[video_]; }
  bool late() const {
    return std::chrono::duration<double>(Clock::now() - waits_since_).count() > timeout_;
  }
  static int interrupts(void* self) {
    const auto& live = *static_cast<const LiveStream*>(self);
    return live.stopped_() || live.late() ? 1 : 0;
  }

  // FFmpeg's own reading of a pipe cannot be interrupted.
  static int read_pipe(void* self, std::uint8_t* bytes, int size) {
    constexpr int kMilliseconds = 50;
    for (pollfd input{STDIN_FILENO, POLLIN, 0}; ::poll(&input, 1, kMilliseconds) <= 0;) {
      if (interrupts(self) != 0) return AVERROR_EXIT;
    }
    const ssize_t count = ::read(STDIN_FILENO, bytes, static_cast<std::size_t>(size));
    return count > 0 ? static_cast<int>(count) : count == 0 ? AVERROR_EOF : AVERROR(errno);
  }

  void open_pipe() {
    constexpr int kBytes = 65536;
    auto* const buffer = static_cast<std::uint8_t*>(av_malloc(kBytes));
    if (buffer == nullptr) throw std::bad_alloc();
    pipe_ = avio_alloc_context(buffer, kBytes, 0, this, read_pipe, nullptr, nullptr);
    if (pipe_ == nullptr) {
      av_free(buffer);
      throw std::bad_alloc();
    }
    format_->pb = pipe_;
  }

  void open(const std::string& url) {
    waits_since_ = Clock::now();
    packet_ = av_packet_alloc();
    picture_ = av_frame_alloc();
    format_ = avformat_alloc_context();
    if (packet_ == nullptr || picture_ == nullptr || format_ == nullptr) throw std::bad_alloc();
    format_->interrupt_callback = {interrupts, this};
    if (piped_) open_pipe();
    format_->max_analyze_duration = AV_TIME_BASE;  // a second, of a camera's frames
    format_->fps_probe_size = 0;
    AVDictionary* settings = nullptr;
    av_dict_set(&settings, "rtsp_transport", "tcp", 0);
    int result = avformat_open_input(&format_, url.c_str(), nullptr, &settings);
    av_dict_free(&settings);
    if (result == 0) result = avformat_find_stream_info(format_, nullptr);
    if (result < 0) fail("cannot be opened", result);
    const AVCodec* codec = nullptr;
    video_ = av_find_best_stream(format_, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
    if (video_ < 0) fail("holds no video that can be decoded", video_);
    decoder_ = avcodec_alloc_context3(codec);
    if (decoder_ == nullptr) throw std::bad_alloc();
    avcodec_parameters_to_context(decoder_, stream().codecpar);
    decoder_->flags |= AV_CODEC_FLAG_LOW_DELAY;
    // Otherwise half a picture passes for a whole one.
    if (codec->id == AV_CODEC_ID_MJPEG) decoder_->err_recognition = AV_EF_EXPLODE;
    if (result = avcodec_open2(decoder_, codec, nullptr); result < 0) {
      fail("cannot be decoded", result);
    }
    size_ = {decoder_->width, decoder_->height};
  }

  void close() {
    sws_freeContext(scaler_);
    avcodec_free_context(&decoder_);
    avformat_close_input(&format_);
    if (pipe_ != nullptr) av_freep(&pipe_->buffer);
    avio_context_free(&pipe_);
    av_frame_free(&picture_);
    av_packet_free(&packet_);
  }

  [[noreturn]] void fail(const char* what, int error) const {
    throw std::runtime_error(
        fmt::format("{}: {}: {}", name_, what,
                    late() ? fmt::format("no answer within {:g} s", timeout_) : error_text(error)));
  }

  // Gives the decoder the next piece of the video; false at the end.
  bool feed() {
    do {
      av_packet_unref(packet_);
      const int result = av_read_frame(format_, packet_);
      if (result == AVERROR_EOF && piped_ && !std::exchange(drained_, true)) {
        avcodec_send_packet(decoder_, nullptr);  // the frames that it holds back come now
        return true;
      }
      if (result < 0 || late()) {
        why_ = late() ? fmt::format("no frame for {:g} s", timeout_)
               // FFmpeg's word for a connection that has gone.
               : result == AVERROR_EOF || result == AVERROR(EIO) ? "the sender has ended it"
                                                                 : error_text(result);
        return false;
      }
    } while (packet_->stream_index != video_);
    if (avcodec_send_packet(decoder_, packet_) < 0) ++garbled_;
    return true;
  }

  // Whether the frame that was received shows what never came.
  bool is_garbled() {
    if (picture_->decode_error_flags == 0 && (picture_->flags & AV_FRAME_FLAG_CORRUPT) == 0) {
      return false;
    }
    ++garbled_;
    return true;
  }

  // Where the stream tells it; whoever takes frames of a camera knows better.
  void tell_time(FrameTime& when) {
    when = {};
    const std::int64_t stamp = picture_->best_effort_timestamp;
    if (stamp == AV_NOPTS_VALUE) return;
    const double seconds = static_cast<double>(stamp) * av_q2d(stream().time_base);
    if (!begin_) begin_ = seconds;
    time_ = std::max(time_, seconds - *begin_);
    when.time = time_;
  }

  void convert(image::Image& image) {
    const int width = picture_->width, height = picture_->height;
    scaler_ = sws_getCachedContext(scaler_, width, height,
                                   static_cast<AVPixelFormat>(picture_->format), width, height,
                                   AV_PIX_FMT_BGR24, SWS_BICUBIC, nullptr, nullptr, nullptr);
    if (scaler_ == nullptr) throw std::runtime_error("its pixels are of an unknown format");
    image = image::Image(width, height);
    std::array<std::uint8_t*, 4> planes{image.bgr.data()};
    const std::array<int, 4> strides{3 * width};
    sws_scale(scaler_, picture_->data, picture_->linesize, 0, height, planes.data(),
              strides.data());
  }

  bool piped_;
  std::string name_;
  double timeout_;
  std::function<bool()> stopped_;
  AVIOContext* pipe_ = nullptr;
  AVFormatContext* format_ = nullptr;
  AVCodecContext* decoder_ = nullptr;
  AVPacket* packet_ = nullptr;
  AVFrame* picture_ = nullptr;
  SwsContext* scaler_ = nullptr;
  int video_ = -1;
  image::PictureSize size_;
  int number_ = 0;
  bool drained_ = false;
  std::optional<double> begin_;  // the stream's time of the first frame
  double time_ = 0;
  std::int64_t garbled_ = 0;
  std::string why_ = "it gives no more frames";
  Clock::time_point waits_since_;
};

}  // namespace

std::unique_ptr<FrameSource> open_live_stream(const std::string& url, double timeout,
                                              std::function<bool()> stopped) {
  return std::make_unique<LiveStream>(url, timeout, std::move(stopped));
}

std::unique_ptr<FrameSource> open_piped_stream(std::function<bool()> stopped) {
  return std::make_unique<LiveStream>("", std::numeric_limits<double>::infinity(),
                                      std::move(stopped));
}

}  // namespace sdmt::pipeline

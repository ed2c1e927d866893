// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/live_source.h"

#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "live_stream.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/pipeline/utc_time.h"
#include "video_source.h"

namespace sdmt::pipeline {

namespace {

constexpr std::chrono::milliseconds kBetweenLooks{50};
constexpr std::size_t kWaitingFrames = 8;  // where none may be lost

double seconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace

void LiveOptions::validate() const {
  io::require(timeout >= 0.1 && timeout <= 3600, "timeout", timeout, "0.1..3600 seconds");
  io::require(first_pause >= 0.001 && first_pause <= kLongestPause, "first pause", first_pause,
              "0.001..30 seconds");
}

LiveSource::LiveSource(std::string name, std::unique_ptr<FrameSource> first, Open open,
                       Closing closing, LiveOptions options)
    : name_(std::move(name)),
      open_(std::move(open)),
      options_(std::move(options)),
      frame_rate_(first->frame_rate()),
      first_(std::move(first)),
      closing_(std::move(closing)),
      picture_(first_->picture()) {
  options_.validate();
}

LiveSource::~LiveSource() {
  {
    const std::lock_guard lock(mutex_);
    *closing_ = true;
  }
  changed_.notify_all();
  if (reader_.joinable()) reader_.join();
}

bool LiveSource::next(Frame& frame, bool decode) {
  using WallClock = std::chrono::system_clock;
  if (first_ != nullptr) {
    reader_ = std::thread(&LiveSource::read, this, std::move(first_), decode);
  } else if (number_ > 0) {
    const std::lock_guard lock(mutex_);
    counts_.lag = std::chrono::duration<double>(WallClock::now() - taken_).count();
    counts_.longest_lag = std::max(counts_.longest_lag, counts_.lag);
  }
  for (;;) {
    tell_news();
    if (options_.stop && options_.stop()) return false;
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kBetweenLooks,
                      [&] { return !frames_.empty() || ended_ || !news_.empty(); });
    if (!news_.empty()) continue;
    if (!frames_.empty()) {
      frame = std::move(frames_.front());
      frames_.pop_front();
      break;
    }
    if (ended_) return false;
  }
  changed_.notify_all();
  frame.number = ++number_;
  taken_ = *frame.when.wall_clock;
  return true;
}

std::optional<LiveCounts> LiveSource::live() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

image::PictureSize LiveSource::picture() const {
  const std::lock_guard lock(mutex_);
  return picture_;
}

void LiveSource::read(std::unique_ptr<FrameSource> source, bool decode) {
  while (source != nullptr) {
    Frame frame;
    try {
      while (!*closing_ && source->next(frame, decode)) {
        if (!hand_over(std::move(frame), *source)) break;
        frame = {};
      }
    } catch (const std::exception& error) {  // of one frame: it is opened anew
      say(fmt::format("{}: {}", name_, error.what()));
    }
    if (*closing_ || (options_.stop && options_.stop())) break;
    garbled_before_ += source->garbled();
    std::int64_t received = 0;
    {
      const std::lock_guard lock(mutex_);
      counts_.garbled = garbled_before_;
      ++counts_.losses;
      received = counts_.received;
    }
    say(fmt::format("{}: lost after {} frames, {}: {}{}", name_, received,
                    utc_text(std::chrono::system_clock::now()), source->why_it_ended(),
                    options_.reconnect ? "; it is opened again until it answers" : ""));
    source = nullptr;
    if (options_.reconnect) source = reopen();
  }
  const std::lock_guard lock(mutex_);
  ended_ = true;
  changed_.notify_all();
}

bool LiveSource::hand_over(Frame frame, const FrameSource& source) {
  const auto now = Clock::now();
  if (!std::exchange(begun_, true)) began_ = now;
  frame.when.time = seconds(now - began_);
  frame.when.wall_clock = std::chrono::system_clock::now();
  std::unique_lock lock(mutex_);
  ++counts_.received;
  counts_.garbled = garbled_before_ + source.garbled();
  picture_ = source.picture();
  if (options_.newest_only) {
    if (!frames_.empty()) ++counts_.dropped;
    frames_.clear();
  } else {
    changed_.wait(lock, [&] { return frames_.size() < kWaitingFrames || *closing_; });
  }
  if (*closing_) return false;
  frames_.push_back(std::move(frame));
  changed_.notify_all();
  return true;
}

std::unique_ptr<FrameSource> LiveSource::reopen() {
  const auto lost = Clock::now();
  for (double pause = options_.first_pause;;
       pause = std::min(2 * pause, LiveOptions::kLongestPause)) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, std::chrono::duration<double>(pause),
                        [&] { return closing_->load(); });
    }
    if (*closing_) return nullptr;
    try {
      auto source = open_();
      say(fmt::format("{}: is back, {}, after {:.1f} s", name_,
                      utc_text(std::chrono::system_clock::now()), seconds(Clock::now() - lost)));
      return source;
    } catch (const std::exception&) {  // still away, which has been said
    }
  }
}

void LiveSource::say(std::string text) {
  const std::lock_guard lock(mutex_);
  news_.push_back(std::move(text));
  changed_.notify_all();
}

void LiveSource::tell_news() {
  std::vector<std::string> news;
  {
    const std::lock_guard lock(mutex_);
    news.swap(news_);
  }
  if (!options_.tell) return;
  for (const std::string& text : news) options_.tell(text);
}

std::unique_ptr<FrameSource> open_live_source(const std::string& input,
                                              const LiveOptions& options) {
  options.validate();
  if (input == "-") {
    return open_piped_stream([stop = options.stop] { return stop && stop(); });
  }
  if (!is_live(input)) return open_frame_source(input);
  const auto closing = std::make_shared<std::atomic<bool>>(false);
  const LiveSource::Open open = [input, closing, timeout = options.timeout, stop = options.stop] {
    if (input.starts_with("camera:")) return open_camera(input);
    return open_live_stream(input, timeout,
                            [closing, stop] { return closing->load() || (stop && stop()); });
  };
  auto first = open();
  if (!first->endless()) return open_stream(input);
  return std::make_unique<LiveSource>(display_name(input), std::move(first), open, closing,
                                      options);
}

}  // namespace sdmt::pipeline

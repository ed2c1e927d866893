// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace sdmt::pipeline {

/// Items made by a thread of its own, at most kDepth ahead of whoever takes them.
template <typename Item>
class Ahead {
 public:
  static constexpr std::size_t kDepth = 2;

  /// `make` fills the next item, or returns false after the last one.
  explicit Ahead(std::function<bool(Item&)> make)
      : make_(std::move(make)), maker_([this] { work(); }) {}
  /// Waits for the item that is being made.
  ~Ahead() {
    {
      const std::lock_guard lock(mutex_);
      closing_ = true;
    }
    changed_.notify_all();
    maker_.join();
  }
  Ahead(const Ahead&) = delete;
  Ahead& operator=(const Ahead&) = delete;

  /// The next item; false after the last one. Throws what `make` threw, in its place.
  bool next(Item& item) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !items_.empty() || ended_; });
    if (items_.empty()) {
      if (failure_ != nullptr) std::rethrow_exception(std::exchange(failure_, nullptr));
      return false;
    }
    item = std::move(items_.front());
    items_.pop_front();
    changed_.notify_all();
    return true;
  }

 private:
  void work() {
    std::exception_ptr failure;
    try {
      for (Item item; make_(item); item = Item()) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return items_.size() < kDepth || closing_; });
        if (closing_) break;
        items_.push_back(std::move(item));
        changed_.notify_all();
      }
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    failure_ = failure;
    ended_ = true;
    changed_.notify_all();
  }

  std::function<bool(Item&)> make_;
  std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::deque<Item> items_;
  std::exception_ptr failure_;
  bool closing_ = false, ended_ = false;
  std::thread maker_;
};

}  // namespace sdmt::pipeline

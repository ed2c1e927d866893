// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <omp.h>

#include <mutex>
#include <opencv2/core/utility.hpp>

namespace sdmt::pipeline {

/// While it lives, OpenCV has as many threads as OpenMP, which the embedder uses before and after;
/// for the rest it keeps what it had. One lives at a time: another thread waits for it.
class OpenCvThreads {
 public:
  OpenCvThreads() : alone_(mutex()), before_(cv::getNumThreads()) {
    cv::setNumThreads(omp_get_max_threads());
  }
  ~OpenCvThreads() { cv::setNumThreads(before_); }
  OpenCvThreads(const OpenCvThreads&) = delete;
  OpenCvThreads& operator=(const OpenCvThreads&) = delete;

 private:
  static std::mutex& mutex() {
    static std::mutex only;
    return only;
  }

  std::lock_guard<std::mutex> alone_;
  int before_;
};

}  // namespace sdmt::pipeline

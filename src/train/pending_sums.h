// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/process_group.h"

namespace sdmt::train {

// Waits for the sums that a backward pass starts, whatever happens: the layers must stay as long as
// they are under way.
class PendingSums {
 public:
  explicit PendingSums(nn::ProcessGroup& group) : group_(group) {}
  ~PendingSums() {
    if (done_) return;
    try {
      group_.wait();
    } catch (...) {  // what came first is told
      return;
    }
  }
  PendingSums(const PendingSums&) = delete;
  PendingSums& operator=(const PendingSums&) = delete;

  void wait() {
    done_ = true;
    group_.wait();
  }

 private:
  nn::ProcessGroup& group_;
  bool done_ = false;
};

}  // namespace sdmt::train

// SPDX-License-Identifier: Apache-2.0
#include "cli/peak_memory.h"

#include <sys/resource.h>

namespace sdmt::tools {

double peak_rss_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;  // Linux counts KiB
}

}  // namespace sdmt::tools

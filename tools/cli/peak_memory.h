// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace sdmt::tools {

/// Largest resident memory of this process so far, MiB.
double peak_rss_mib();

}  // namespace sdmt::tools

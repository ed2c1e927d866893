// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace sdmt::tools {

/// Starts the threads of OpenMP while nothing is at stake: GCC's run-time ends the process when it
/// cannot start one later, and leaves half-written files behind. Where the system allows fewer than
/// wanted, they are made do with, and that is said.
void start_threads();

}  // namespace sdmt::tools

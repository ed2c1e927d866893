// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace sdmt::io {

/// Removes what lies in place of files that are not whole yet (TemporaryFile), for a program that
/// must end at once, without its destructors: when memory runs out where nothing may be thrown, or
/// a library ends it. Allocates nothing.
void remove_unfinished_files() noexcept;

}  // namespace sdmt::io

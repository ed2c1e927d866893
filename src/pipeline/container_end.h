// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace sdmt::pipeline {

/// Whether the outermost parts of an MP4, MOV, Matroska or AVI file, whose lengths a writer fills
/// in when it is done, end exactly where the file does. They do not when the disk was full at the
/// end.
bool ends_with_its_container(const std::filesystem::path& video);

}  // namespace sdmt::pipeline

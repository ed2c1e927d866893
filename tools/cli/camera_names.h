// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace sdmt::tools {

/// A name for each input that a folder can have, no two the same: the last part of a path without
/// its extension, host and path of a URL ("camera.example-554-front"), "camera-0". Users, passwords
/// and queries of URLs are not in it.
std::vector<std::string> camera_names(const std::vector<std::string>& inputs);

}  // namespace sdmt::tools

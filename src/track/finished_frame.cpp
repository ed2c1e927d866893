// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/finished_frame.h"

namespace sdmt::track {

const char* to_string(BoxSource source) {
  switch (source) {
    case BoxSource::detected:
      return "detected";
    case BoxSource::boosted:
      return "boosted";
    case BoxSource::interpolated:
      return "interpolated";
  }
  return "unknown";
}

}  // namespace sdmt::track

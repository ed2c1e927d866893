// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/association_decision.h"

namespace sdmt::track {

const char* to_string(AssociationVerdict verdict) {
  switch (verdict) {
    case AssociationVerdict::merged:
      return "merged";
    case AssociationVerdict::too_far:
      return "too far from the prediction";
    case AssociationVerdict::appearance:
      return "appearance too different";
    case AssociationVerdict::no_feature:
      return "no appearance stored";
    case AssociationVerdict::better_pair:
      return "a better pair was merged";
    case AssociationVerdict::too_late:
      return "too long after";
  }
  return "unknown";
}

}  // namespace sdmt::track

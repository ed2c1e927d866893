// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "sdmt/track/association_decision.h"
#include "sdmt/track/tracker_options.h"
#include "tracklet.h"

namespace sdmt::track {

/// Two tracklets that may be one person's, the older one continued by the newer one.
struct AssociationPair {
  Tracklet* older = nullptr;
  Tracklet* newer = nullptr;
  /// Higher is better: affinity of appearance, or minus the distance of the boxes in heights.
  double score = 0;
};

/// Tracklet association (section III-G, algorithm 2): joins positive tracklets across gaps.
///
/// A newer tracklet can continue an older one that misses its detection when it began after the
/// older one's last box, at most max_misses + horizon frames later, its first box is near the older
/// one's prediction for that frame (`reach`; in the paper: IoU > 0), and the mean (or smallest)
/// distance of their stored appearance leaves an affinity above the threshold. By motion alone they
/// must lead to each other (`motion_reach`).
/// Pairs are merged best first, all affected pairs judged anew after each merge, until none is
/// left.
class TrackletAssociation {
 public:
  /// `by_appearance`: false to judge by motion alone. `scene`: its threshold, where the options
  /// name none; where all look alike, motion judges.
  TrackletAssociation(const AssociationOptions& options, const MotionOptions& motion,
                      const AppearanceOptions& appearance, bool by_appearance,
                      const SceneReport& scene)
      : options_(options),
        motion_(motion),
        appearance_(appearance),
        by_appearance_(by_appearance),
        scene_(scene) {}

  /// Calls merge(older, newer) for each pair to join, `tracklets` being all positive ones by id.
  /// merge() must leave the joined track in `newer` under the older id; `older` is not looked at
  /// again.
  void run(int frame, std::vector<Tracklet*> tracklets,
           const std::function<void(Tracklet& older, Tracklet& newer)>& merge);

  std::function<void(const AssociationDecision&)> observer;

 private:
  bool judges_appearance() const { return by_appearance_ && !scene_.all_look_alike(); }
  double threshold() const { return options_.threshold.value_or(scene_.association_threshold); }
  bool within_reach(const mot::Cxcywh& predicted, const mot::Cxcywh& first) const;
  std::optional<AssociationPair> judge_motion(int frame, Tracklet& older, Tracklet& newer) const;
  std::optional<AssociationPair> judge(int frame, Tracklet& older, Tracklet& newer) const;
  void judge_all(int frame, const std::vector<Tracklet*>& tracklets, Tracklet& with);
  const AssociationPair& best() const;
  void report(int frame, const Tracklet& older, const Tracklet& newer, double affinity,
              AssociationVerdict verdict) const;

  const AssociationOptions& options_;
  const MotionOptions& motion_;
  const AppearanceOptions& appearance_;
  bool by_appearance_;
  const SceneReport& scene_;
  std::vector<AssociationPair> pairs_;
};

}  // namespace sdmt::track

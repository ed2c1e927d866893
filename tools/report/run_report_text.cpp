// SPDX-License-Identifier: Apache-2.0
#include "report/run_report_text.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "cli/peak_memory.h"

namespace sdmt::tools {

std::string run_report_json(const pipeline::RunReport& report) {
  const track::TrackerStats& stats = report.stats;
  const auto per_frame = [&](double seconds) {
    return stats.frames > 0 ? 1000 * seconds / static_cast<double>(stats.frames) : 0.0;
  };
  nlohmann::ordered_json json{{"frames", stats.frames},
                              {"detections", stats.detections},
                              {"tracks", stats.tracks},
                              {"hz", report.hz()},
                              {"hz_without_embedding", report.hz_without_embedding()},
                              {"stage_ms",
                               {{"detect", per_frame(report.detect_seconds)},
                                {"embed", per_frame(stats.embed_seconds)},
                                {"predict", per_frame(stats.predict_seconds)},
                                {"assign", per_frame(stats.assign_seconds)},
                                {"boost", per_frame(stats.boost_seconds)},
                                {"associate", per_frame(stats.associate_seconds)},
                                {"emit", per_frame(stats.emit_seconds)}}},
                              {"embedded", stats.embedded},
                              {"peak_rss_mib", peak_rss_mib()},
                              {"unreadable_frames", report.unreadable},
                              {"suppressed", stats.suppressed},
                              {"without_embedding", stats.without_embedding},
                              {"tracklets", stats.tracklets},
                              {"boosted", stats.boosted},
                              {"merges", stats.merges}};
  const track::SceneReport& scene = report.scene;
  json["scene"] = {{"prior", scene.prior},
                   {"assignment_threshold", scene.assignment_threshold},
                   {"association_threshold", scene.association_threshold},
                   {"say", scene.say},
                   {"strangers", scene.strangers},
                   {"stranger_tracks", scene.stranger_tracks},
                   {"own", scene.own}};
  for (const auto& tenth : scene.scores) {
    json["scene"]["scores"].push_back({{"boxes", tenth.boxes}, {"people", tenth.people}});
  }
  if (report.live) {
    json["live"] = {{"received", report.live->received},
                    {"dropped", report.live->dropped},
                    {"garbled", report.live->garbled},
                    {"losses", report.live->losses},
                    {"longest_lag", report.live->longest_lag}};
  }
  return json.dump(2) + "\n";
}

namespace {

// Why nobody was reported; empty when somebody was.
std::string why_no_tracks(const track::TrackerStats& stats) {
  if (stats.frames == 0 || stats.tracks > 0) return {};
  if (stats.detections == 0) return "no tracks: nobody was detected\n";
  if (stats.suppressed == stats.detections) {
    return "no tracks: every detection was dropped, see --min-confidence\n";
  }
  if (stats.tracklets == 0) {
    return "no tracks: no score is high enough to start one, see --strong-confidence and "
           "--calibration\n";
  }
  return fmt::format(
      "no tracks: none of {} candidates has enough detections or score, see --min-length and "
      "--min-mean-confidence\n",
      stats.tracklets);
}

}  // namespace

std::string run_summary(const pipeline::RunReport& report) {
  const track::TrackerStats& stats = report.stats;
  std::string text = fmt::format("{} frames, {} detections, {} tracks; tracker {:.1f} Hz",
                                 stats.frames, stats.detections, stats.tracks, report.hz());
  if (stats.embedded > 0) {
    text += fmt::format(" ({:.0f} Hz without embedding)", report.hz_without_embedding());
  }
  text += fmt::format(", {:.1f} s in all\n", report.total_seconds);
  if (report.unreadable > 0) text += fmt::format("{} frames were unreadable\n", report.unreadable);
  if (report.live) {
    text += fmt::format(
        "{} frames came, {} of them were dropped for newer ones; {} garbled, lost {} times, {:.2f} "
        "s "
        "behind at most\n",
        report.live->received, report.live->dropped, report.live->garbled, report.live->losses,
        report.live->longest_lag);
  }
  return text + why_no_tracks(stats);
}

std::string stage_table(const pipeline::RunReport& report) {
  const track::TrackerStats& stats = report.stats;
  const double frames = stats.frames > 0 ? static_cast<double>(stats.frames) : 1;
  std::string text = "stage       ms/frame\n";
  const auto line = [&](const char* stage, double seconds) {
    text += fmt::format("{:<10} {:9.3f}\n", stage, 1000 * seconds / frames);
  };
  line("detect", report.detect_seconds);
  line("predict", stats.predict_seconds);
  line("embed", stats.embed_seconds);
  line("assign", stats.assign_seconds);
  line("boost", stats.boost_seconds);
  line("associate", stats.associate_seconds);
  line("emit", stats.emit_seconds);
  line("tracker", report.tracker_seconds());
  text += fmt::format(
      "{:.1f} Hz with embedding, {:.1f} Hz without (reading, detecting and drawing excluded)\n",
      report.hz(), report.hz_without_embedding());
  text += fmt::format(
      "{} boxes embedded ({} without a usable crop), {} detections suppressed, "
      "{} boosted, {} merges, peak memory {:.0f} MiB\n",
      stats.embedded, stats.without_embedding, stats.suppressed, stats.boosted, stats.merges,
      peak_rss_mib());
  const track::SceneReport& scene = report.scene;
  if (scene.own > 0) {
    text += fmt::format(
        "scene: affinity above {:.3f} to be assigned, {:.3f} to be joined (model: {:.3f}), say of "
        "appearance {:.2f}, from {} pairs of strangers\n",
        scene.assignment_threshold, scene.association_threshold, scene.prior, scene.say,
        scene.strangers);
  }
  return text;
}

}  // namespace sdmt::tools

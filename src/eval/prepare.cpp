// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/prepare.h"

#include <algorithm>
#include <stdexcept>

#include "sdmt/mot/assignment.h"

namespace sdmt::eval {

namespace {

using mot::GroundTruthRow;
using mot::ResultRow;

template <typename Row>
std::string where(const std::string& file, const Row& row) {
  return file + ": frame " + std::to_string(row.frame) + ", id " + std::to_string(row.id) + ": ";
}

// The rows of each frame, in place of searching for them.
template <typename Row>
class ByFrame {
 public:
  ByFrame(std::span<const Row> rows, int num_frames) : rows_(rows), first_(num_frames + 2, 0) {
    for (const auto& row : rows) {
      if (row.frame >= 1 && row.frame <= num_frames) ++first_[row.frame + 1];
    }
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  }
  std::span<const Row> operator[](int frame) const {
    return rows_.subspan(first_[frame], first_[frame + 1] - first_[frame]);
  }

 private:
  std::span<const Row> rows_;
  std::vector<std::size_t> first_;  // [frame] .. [frame + 1]
};

template <typename Row>
void require_unique_ids(std::span<const Row> rows, const std::string& file) {
  std::vector<int> ids;
  for (std::size_t begin = 0; begin < rows.size();) {
    std::size_t end = begin;
    ids.clear();
    while (end < rows.size() && rows[end].frame == rows[begin].frame) ids.push_back(rows[end++].id);
    std::sort(ids.begin(), ids.end());
    const auto twice = std::adjacent_find(ids.begin(), ids.end());
    if (twice != ids.end()) {
      Row row = rows[begin];
      row.id = *twice;
      throw std::invalid_argument(where(file, row) + "id occurs more than once in this frame");
    }
    begin = end;
  }
}

template <typename Row>
void require_frames_within(std::span<const Row> rows, const std::string& file,
                           const GroundTruth& gt) {
  if (rows.empty() || rows.back().frame <= gt.num_frames) return;
  throw std::invalid_argument(
      where(file, rows.back()) + "the sequence has " + std::to_string(gt.num_frames) + " frames" +
      (gt.has_length ? " (seqLength in seqinfo.ini)"
                     : " of ground truth and no seqinfo.ini that states its length"));
}

// Every frame takes room, also empty ones: one absurd number must not eat the memory.
void require_sane_length(const GroundTruth& gt) {
  constexpr int kMostFrames = 10'000'000;
  if (gt.num_frames <= kMostFrames) return;
  throw std::invalid_argument(gt.file.string() + ": the sequence has " +
                              std::to_string(gt.num_frames) + " frames, expected at most " +
                              std::to_string(kMostFrames));
}

void require_classes(const GroundTruth& gt, Benchmark benchmark) {
  for (const auto& row : gt.rows) {
    if (row.category >= 1 && row.category <= kNumCategories) continue;
    throw std::invalid_argument(
        where(gt.file.string(), row) + "class is " + std::to_string(row.category) +
        ", expected 1..13: " + std::string(to_string(benchmark)) +
        " ground truth has a class in its eighth column; without classes use MOT15");
  }
}

bool counts(const GroundTruthRow& row, Benchmark benchmark) {
  return row.keep && (benchmark == Benchmark::mot15 || row.category == kPedestrian);
}

int last_counted_frame(const GroundTruth& gt, Benchmark benchmark) {
  for (auto row = gt.rows.rbegin(); row != gt.rows.rend(); ++row) {
    if (counts(*row, benchmark)) return row->frame;
  }
  return 0;
}

template <typename Row>
std::vector<mot::Tlwh> boxes_of(std::span<const Row> rows) {
  std::vector<mot::Tlwh> boxes;
  boxes.reserve(rows.size());
  for (const auto& row : rows) boxes.push_back(row.box);
  return boxes;
}

// Step 1: which result boxes of a frame stay.
std::vector<unsigned char> kept_results(std::span<const GroundTruthRow> gt, std::size_t num_results,
                                        std::span<const BoxPair> pairs, Benchmark benchmark,
                                        PreparedSequence& out) {
  std::vector<unsigned char> kept(num_results, 1);
  if (benchmark == Benchmark::mot15) return kept;
  std::vector<mot::AssignmentEdge> edges;
  for (const auto& pair : pairs) {
    if (pair.similarity >= 0.5 - kSimilaritySlack) {
      edges.push_back({pair.gt, pair.result, pair.similarity});
    }
  }
  const auto result_of = mot::maximum_weight_assignment(static_cast<int>(gt.size()),
                                                        static_cast<int>(num_results), edges);
  for (std::size_t i = 0; i < gt.size(); ++i) {
    if (result_of[i] < 0 || counts(gt[i], benchmark)) continue;
    if (is_distractor(gt[i].category, benchmark)) {
      kept[result_of[i]] = 0;
      ++out.removed_results;
    } else {
      ++out.results_on_uncounted[gt[i].category];
    }
  }
  return kept;
}

// Replaces the file's ids by 0, 1, ... in ascending order and returns the file's.
template <typename Member>
std::vector<int> renumber(std::vector<FrameSimilarities>& frames, Member ids) {
  std::vector<int> labels;
  for (const auto& frame : frames) {
    labels.insert(labels.end(), (frame.*ids).begin(), (frame.*ids).end());
  }
  std::sort(labels.begin(), labels.end());
  labels.erase(std::unique(labels.begin(), labels.end()), labels.end());
  for (auto& frame : frames) {
    for (int& id : frame.*ids) {
      id = static_cast<int>(std::lower_bound(labels.begin(), labels.end(), id) - labels.begin());
    }
  }
  return labels;
}

// Steps 1 and 2 for one frame; ids are still those of the files.
void prepare_frame(std::span<const GroundTruthRow> gt, std::span<const ResultRow> results,
                   Benchmark benchmark, PreparedSequence& out) {
  const auto gt_boxes = boxes_of(gt);
  const auto result_boxes = boxes_of(results);
  const auto pairs = overlapping_pairs(gt_boxes, result_boxes);
  const auto kept = kept_results(gt, results.size(), pairs, benchmark, out);

  constexpr int kGone = -1;
  FrameSimilarities frame;
  std::vector<int> new_gt(gt.size(), kGone), new_result(results.size(), kGone);
  auto& frame_gt_boxes = out.gt_boxes.emplace_back();
  auto& frame_result_boxes = out.result_boxes.emplace_back();
  for (std::size_t i = 0; i < gt.size(); ++i) {
    if (!counts(gt[i], benchmark)) continue;
    new_gt[i] = static_cast<int>(frame.gt_ids.size());
    frame.gt_ids.push_back(gt[i].id);
    frame_gt_boxes.push_back(gt[i].box);
  }
  for (std::size_t j = 0; j < results.size(); ++j) {
    if (kept[j] == 0) continue;
    new_result[j] = static_cast<int>(frame.result_ids.size());
    frame.result_ids.push_back(results[j].id);
    frame_result_boxes.push_back(results[j].box);
  }
  for (const auto& pair : pairs) {
    const int i = new_gt[pair.gt];
    const int j = new_result[pair.result];
    if (i != kGone && j != kGone) frame.overlaps.push_back({i, j, pair.similarity});
  }
  out.similarities.frames.push_back(std::move(frame));
}

}  // namespace

PreparedSequence prepare_sequence(const GroundTruth& gt, std::span<const ResultRow> results,
                                  const std::string& result_name, Benchmark benchmark,
                                  Compat compat) {
  const std::span<const GroundTruthRow> gt_rows(gt.rows);
  require_sane_length(gt);
  require_unique_ids(gt_rows, gt.file.string());
  require_unique_ids(results, result_name);
  require_frames_within(gt_rows, gt.file.string(), gt);
  if (benchmark != Benchmark::mot15) require_classes(gt, benchmark);
  int num_frames = gt.num_frames;
  if (compat == Compat::devkit) {
    num_frames = last_counted_frame(gt, benchmark);
  } else {
    require_frames_within(results, result_name, gt);
    for (const auto& row : results) {
      if (row.category <= kPedestrian) continue;
      throw std::invalid_argument(where(result_name, row) + "class is " +
                                  std::to_string(row.category) + ", expected 1 or -1");
    }
  }
  PreparedSequence out;
  out.name = gt.name;
  const ByFrame gt_by_frame(gt_rows, num_frames);
  const ByFrame results_by_frame(results, num_frames);
  for (int frame = 1; frame <= num_frames; ++frame) {
    prepare_frame(gt_by_frame[frame], results_by_frame[frame], benchmark, out);
  }
  out.gt_labels = renumber(out.similarities.frames, &FrameSimilarities::gt_ids);
  out.result_labels = renumber(out.similarities.frames, &FrameSimilarities::result_ids);
  out.similarities.num_gt_ids = static_cast<int>(out.gt_labels.size());
  out.similarities.num_result_ids = static_cast<int>(out.result_labels.size());
  return out;
}

}  // namespace sdmt::eval

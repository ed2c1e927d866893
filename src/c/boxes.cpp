// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "guard.h"
#include "handles.h"
#include "sdmt/eval/prepare.h"
#include "sdmt/eval/scores.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/mot/detection_formats.h"

using namespace sdmt;

struct sdmt_detections {
  mot::DetectionFile file;
  std::vector<sdmt_detection> boxes;  // of the file, in its order
};

struct sdmt_evaluation {
  eval::Benchmark benchmark;
  eval::Compat compat;
  std::vector<eval::Scores> sequences;
};

sdmt_detections* sdmt_detections_read(const char* path, const char* format, sdmt_error* error) {
  return c::guarded_new(error, [&] {
    mot::DetectionReading reading;
    if (format != nullptr) {
      reading.format = mot::parse_detection_format(format);
      if (!reading.format) {
        io::refuse_value("format", io::quoted(format), "one of mot, csv, jsonl, kitti, coco, yolo");
      }
    }
    auto detections = std::make_unique<sdmt_detections>();
    detections->file = mot::read_detections(&c::given(path, "path"), reading);
    for (const mot::Detection& detection : detections->file.detections()) {
      detections->boxes.push_back({c::to_c(detection.box), detection.score});
    }
    return detections.release();
  });
}
void sdmt_detections_free(sdmt_detections* detections) { delete detections; }
int sdmt_detections_last_frame(const sdmt_detections* detections) {
  return detections != nullptr ? detections->file.last_frame() : 0;
}
int sdmt_detections_have_scores(const sdmt_detections* detections) {
  return detections != nullptr && detections->file.has_scores() ? 1 : 0;
}
const sdmt_detection* sdmt_detections_frame(const sdmt_detections* detections, int frame,
                                            size_t* count) {
  std::span<const mot::Detection> boxes;
  if (detections != nullptr) boxes = detections->file.frame(frame);
  if (count != nullptr) *count = boxes.size();
  if (boxes.empty()) return nullptr;
  return &detections->boxes[boxes.data() - detections->file.detections().data()];
}

sdmt_evaluation* sdmt_evaluation_new(const char* benchmark, const char* compat, sdmt_error* error) {
  return c::guarded_new(error, [&] {
    return new sdmt_evaluation{eval::parse_benchmark(&c::given(benchmark, "benchmark")),
                               eval::parse_compat(&c::given(compat, "compat")),
                               {}};
  });
}
void sdmt_evaluation_free(sdmt_evaluation* evaluation) { delete evaluation; }

sdmt_status sdmt_evaluation_add(sdmt_evaluation* evaluation, const char* sequence,
                                const char* results, sdmt_error* error) {
  return c::guarded(error, [&] {
    const auto [benchmark, compat, unused] = c::given(evaluation, "evaluation");
    const auto gt = eval::read_sequence_ground_truth(&c::given(sequence, "sequence"));
    const auto early = compat == eval::Compat::devkit ? mot::RowsBeforeFrame1::drop
                                                      : mot::RowsBeforeFrame1::refuse;
    const auto rows = mot::read_results(&c::given(results, "results"), early);
    const auto prepared = eval::prepare_sequence(gt, rows, results, benchmark, compat);
    evaluation->sequences.push_back(eval::score_sequence(prepared.similarities, compat));
  });
}

sdmt_status sdmt_evaluation_score(const sdmt_evaluation* evaluation, int sequence, const char* name,
                                  double* score, sdmt_error* error) {
  return c::guarded(error, [&] {
    const auto& [benchmark, compat, sequences] = c::given(evaluation, "evaluation");
    c::given(name, "name"), c::given(score, "score");
    if (sequence < SDMT_COMBINED || sequence >= static_cast<int>(sequences.size())) {
      io::refuse_value("sequence", std::to_string(sequence),
                       "SDMT_COMBINED or below " + std::to_string(sequences.size()));
    }
    const auto fields = eval::score_fields(
        sequence == SDMT_COMBINED ? eval::combine(sequences, compat) : sequences[sequence]);
    const auto field = std::find_if(fields.begin(), fields.end(),
                                    [&](const auto& candidate) { return candidate.name == name; });
    if (field == fields.end()) {
      throw std::invalid_argument("there is no score " + io::quoted(name));
    }
    std::visit([&](const auto value) { *score = static_cast<double>(value); }, field->value);
  });
}

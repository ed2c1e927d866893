// SPDX-License-Identifier: Apache-2.0
// Files of boxes, scores of tracks, and how well embeddings tell people apart.
#include <omp.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <variant>

#include "arrays.h"
#include "module.h"
#include "sdmt/eval/prepare.h"
#include "sdmt/eval/scores.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/mot/detection_formats.h"
#include "sdmt/reid/auc_bootstrap.h"
#include "sdmt/reid/pair_curve.h"
#include "sdmt/reid/reid_metrics.h"
#include "sdmt/track/given_embeddings.h"
#include "sdmt/track/result_rows.h"

namespace sdmt::python {

namespace {

using namespace py::literals;
using Ints = py::array_t<int, py::array::c_style | py::array::forcecast>;

// Detections of a file; arrays of it are views.
using FilePointer = std::shared_ptr<mot::DetectionFile>;

FilePointer read_detections(const std::string& path, const std::optional<std::string>& format,
                            const std::optional<std::string>& classes, int frame_offset, int width,
                            int height) {
  mot::DetectionReading reading;
  if (format) {
    reading.format = mot::parse_detection_format(*format);
    if (!reading.format) {
      io::refuse_value("format", io::quoted(*format), "mot, csv, jsonl, kitti, coco or yolo");
    }
  }
  if (classes) reading.classes.emplace(*classes);
  reading.frame_offset = frame_offset;
  reading.width = width;
  reading.height = height;
  const py::gil_scoped_release free;
  return std::make_shared<mot::DetectionFile>(mot::read_detections(path, reading));
}

py::tuple detections_of_frame(const FilePointer& file, int frame) {
  const auto rows = file->frame(frame);
  const py::object owner = py::cast(file);
  const mot::Detection* first = rows.empty() ? nullptr : rows.data();
  return py::make_tuple(column(rows, first != nullptr ? &first->box.left : nullptr, 4, owner),
                        column(rows, first != nullptr ? &first->score : nullptr, 1, owner));
}

py::object embeddings_of_frame(const FilePointer& file, int frame) {
  if (file->dimension() == 0) return py::none();
  const auto values = file->embeddings(frame);
  const py::ssize_t dimension = file->dimension();
  const auto rows = static_cast<py::ssize_t>(values.size()) / dimension;
  py::array_t<float> array({rows, dimension}, values.data(), py::cast(file));
  return make_read_only(std::move(array));
}

// Rows of a file as a dictionary of arrays.
template <typename Value, typename Row, typename Get>
py::array_t<Value> gathered(const std::vector<Row>& rows, Get get) {
  py::array_t<Value> array(static_cast<py::ssize_t>(rows.size()));
  std::transform(rows.begin(), rows.end(), array.mutable_data(), get);
  return array;
}

template <typename Row>
py::array_t<double> gathered_boxes(const std::vector<Row>& rows) {
  py::array_t<double> array({static_cast<py::ssize_t>(rows.size()), py::ssize_t{4}});
  double* value = array.mutable_data();
  for (const Row& row : rows) {
    for (const double side : {row.box.left, row.box.top, row.box.width, row.box.height}) {
      *value++ = side;
    }
  }
  return array;
}

py::dict read_results(const std::string& path) {
  const auto rows = mot::read_results(path);
  using Row = mot::ResultRow;
  return py::dict(
      "frame"_a = gathered<int>(rows, [](const Row& row) { return row.frame; }),
      "id"_a = gathered<int>(rows, [](const Row& row) { return row.id; }),
      "boxes"_a = gathered_boxes(rows),
      "confidence"_a = gathered<double>(rows, [](const Row& row) { return row.confidence; }));
}

py::dict read_ground_truth(const std::string& path) {
  const auto rows = mot::read_ground_truth(path);
  using Row = mot::GroundTruthRow;
  return py::dict(
      "frame"_a = gathered<int>(rows, [](const Row& row) { return row.frame; }),
      "id"_a = gathered<int>(rows, [](const Row& row) { return row.id; }),
      "boxes"_a = gathered_boxes(rows),
      "keep"_a = gathered<bool>(rows, [](const Row& row) { return row.keep; }),
      "category"_a = gathered<int>(rows, [](const Row& row) { return row.category; }),
      "visibility"_a = gathered<double>(rows, [](const Row& row) { return row.visibility; }));
}

void write_results(const std::string& path,
                   const std::vector<std::shared_ptr<track::FinishedFrame>>& frames) {
  const py::gil_scoped_release free;
  std::vector<mot::ResultRow> rows;
  for (const auto& frame : frames) track::append_results(*frame, rows);
  mot::write_results(path, rows);
}

eval::Scores score(const std::string& sequence, const std::string& results,
                   const std::string& benchmark_name, const std::string& compat_name) {
  const auto benchmark = eval::parse_benchmark(benchmark_name);
  const auto compat = eval::parse_compat(compat_name);
  const py::gil_scoped_release free;
  const auto gt = eval::read_sequence_ground_truth(sequence);
  std::vector<mot::ResultRow> rows;
  if (!results.empty()) {
    rows =
        mot::read_results(results, compat == eval::Compat::devkit ? mot::RowsBeforeFrame1::drop
                                                                  : mot::RowsBeforeFrame1::refuse);
  }
  const auto prepared = eval::prepare_sequence(gt, rows, results, benchmark, compat);
  return eval::score_sequence(prepared.similarities, compat);
}

py::dict scores_dict(const eval::Scores& scores) {
  py::dict fields;
  for (const auto& field : eval::score_fields(scores)) {
    std::visit([&](const auto value) { fields[py::str(std::string(field.name))] = value; },
               field.value);
  }
  py::dict alphas;
  for (const auto& field : eval::alpha_fields(scores)) {
    std::visit(
        [&](const auto* values) {
          alphas[py::str(std::string(field.name))] =
              py::array(static_cast<py::ssize_t>(values->size()), values->data());
        },
        field.values);
  }
  fields["per_alpha"] = alphas;
  return fields;
}

reid::LabelledEmbeddings labelled(const py::object& embeddings, const py::object& people,
                                  const py::object& cameras) {
  const auto values = to_array<Floats>(embeddings, "embeddings");
  require_shape(values.ndim() == 2 && values.size() > 0, "embeddings", values, "(n, d), n >= 1");
  const auto rows = static_cast<int>(values.shape(0));
  const auto ids = [&](const py::object& object, const char* name) {
    const auto array = to_array<Ints>(object, name);
    require_shape(array.ndim() == 1 && array.shape(0) == rows, name, array,
                  "(n,), one for each embedding");
    return std::vector<int>(array.data(), array.data() + array.size());
  };
  reid::LabelledEmbeddings set;
  set.pids = ids(people, "person_ids");
  set.camids =
      cameras.is_none() ? std::vector<int>(set.pids.size(), 0) : ids(cameras, "camera_ids");
  set.embeddings.resize({rows, 1, 1, static_cast<int>(values.shape(1))});
  const std::span<float> stored(set.embeddings.image(0), static_cast<std::size_t>(values.size()));
  std::copy_n(values.data(), values.size(), stored.begin());
  track::scale_to_unit_rows(stored, set.pids.size());
  return set;
}

reid::PairSet parse_pair_set(const std::string& name) {
  static const std::map<std::string, reid::PairSet> kSets{
      {"person-only", reid::PairSet::person_only},
      {"cross-camera", reid::PairSet::cross_camera},
      {"paper", reid::PairSet::paper}};
  const auto found = kSets.find(name);
  if (found == kSets.end()) {
    io::refuse_value("pair_set", io::quoted(name), "person-only, cross-camera or paper");
  }
  return found->second;
}

py::dict validate_roc(const py::object& embeddings, const py::object& people,
                      const py::object& cameras, const std::string& pair_set, std::int64_t pairs,
                      std::uint64_t seed) {
  const auto set = labelled(embeddings, people, cameras);
  reid::PairOptions options;
  options.set = parse_pair_set(pair_set);
  options.pairs = pairs;
  options.seed = seed;
  std::optional<reid::PairCurve> curve;
  reid::Interval interval;
  std::vector<reid::RocPoint> points;
  {
    const py::gil_scoped_release free;
    curve = reid::pair_curve(set, options);
    reid::BootstrapOptions bootstrap;
    bootstrap.seed = seed;
    interval = reid::bootstrap_auc(std::move(curve->pairs), curve->identities, curve->backgrounds,
                                   bootstrap);
    points = curve->roc.points();
  }
  const reid::Roc& roc = curve->roc;
  const auto rates = [&](double tau_a) {
    const auto at = roc.at(1 - tau_a);
    return py::dict("tau_a"_a = tau_a, "tpr"_a = at.tpr, "fpr"_a = at.fpr);
  };
  using Point = reid::RocPoint;
  return py::dict(
      "auc"_a = roc.auc(), "auc_low"_a = interval.low, "auc_high"_a = interval.high,
      "eer"_a = roc.eer(), "accuracy"_a = roc.accuracy(),
      "tpr_at_fpr"_a = py::dict("0.1"_a = roc.tpr_at_fpr(0.1), "0.01"_a = roc.tpr_at_fpr(0.01),
                                "0.001"_a = roc.tpr_at_fpr(0.001)),
      "thresholds"_a = py::dict(
          "accuracy"_a = rates(roc.tau_a_max_accuracy()), "eer"_a = rates(roc.tau_a_eer()),
          "crossing"_a = rates(roc.tau_a_histogram_crossing()),
          "fpr 0.1"_a = rates(roc.tau_a_at_fpr(0.1)), "fpr 0.01"_a = rates(roc.tau_a_at_fpr(0.01)),
          "fpr 0.001"_a = rates(roc.tau_a_at_fpr(0.001))),
      "positives"_a = curve->counts.positives, "negatives"_a = curve->counts.negatives,
      "distractors"_a = curve->counts.distractors,
      "distance"_a = gathered<double>(points, [](const Point& p) { return p.threshold; }),
      "tpr"_a = gathered<double>(points, [](const Point& p) { return p.tpr; }),
      "fpr"_a = gathered<double>(points, [](const Point& p) { return p.fpr; }));
}

py::object reid_metrics(const py::object& query, const py::object& query_people,
                        const py::object& query_cameras, const py::object& gallery,
                        const py::object& gallery_people, const py::object& gallery_cameras) {
  const auto queries = labelled(query, query_people, query_cameras);
  const auto images = labelled(gallery, gallery_people, gallery_cameras);
  std::optional<reid::ReidMetrics> metrics;
  {
    const py::gil_scoped_release free;
    metrics = reid::reid_metrics(queries, images);
  }
  if (!metrics) return py::none();
  return py::dict("rank1"_a = metrics->rank1, "rank5"_a = metrics->rank5,
                  "rank10"_a = metrics->rank10, "map"_a = metrics->map,
                  "map_trapezoid"_a = metrics->map_trapezoid, "queries"_a = metrics->queries,
                  "queries_without_match"_a = metrics->queries_without_match);
}

}  // namespace

void add_files(py::module_& module) {
  py::class_<mot::DetectionFile, FilePointer>(
      module, "Detections", "Boxes of a file, by frame. Arrays are views, read-only.")
      .def("frame", &detections_of_frame, "frame"_a,
           "Boxes float64 (n, 4) (left, top, width, height, the first pixel is 1) and scores "
           "float64 (n,) of a frame, counted from 1; empty where the file has none.")
      .def("embeddings", &embeddings_of_frame, "frame"_a,
           "The vectors that came with the boxes of a frame, float32 (n, d) of length 1; None for "
           "a file without.")
      .def_property_readonly("last_frame", &mot::DetectionFile::last_frame,
                             "Largest frame number; 0 for an empty file.")
      .def_property_readonly("has_scores", &mot::DetectionFile::has_scores,
                             "False when all scores are equal and say nothing: then "
                             "Tracker(scores=False).")
      .def("__len__", &mot::DetectionFile::size);

  py::class_<eval::Scores>(module, "Scores").def("fields", &scores_dict);
  module.def("read_detections", &read_detections, "path"_a, "format"_a, "classes"_a,
             "frame_offset"_a, "width"_a, "height"_a);
  module.def("read_results", &read_results, "path"_a);
  module.def("read_ground_truth", &read_ground_truth, "path"_a);
  module.def("write_results", &write_results, "path"_a, "frames"_a);
  module.def(
      "find_sequences",
      [](const std::string& path) {
        std::vector<std::pair<std::string, std::string>> found;
        for (const auto& folder : eval::find_sequences(path)) {
          found.emplace_back(eval::sequence_name(folder), folder.string());
        }
        return found;
      },
      "path"_a, "Name and folder of the sequences with ground truth at `path`, by name.");
  module.def("score", &score);
  module.def("combine", [](const std::vector<eval::Scores>& scores, const std::string& compat) {
    return eval::combine(scores, eval::parse_compat(compat));
  });
  module.def("validate_roc", &validate_roc, "embeddings"_a, "person_ids"_a,
             "camera_ids"_a = py::none(), py::kw_only(), "pair_set"_a = "person-only",
             "pairs"_a = 0, "seed"_a = 1,
             R"(Measures how well embeddings tell people apart, as `sdmt validate-roc` does.

embeddings: (n, d), scaled to length 1. person_ids: (n,), 0 for background. camera_ids: (n,).
pair_set: which pairs of images: "person-only", "cross-camera" or "paper" (with background).
pairs: 0: all pairs, else at most so many of each kind, drawn by `seed`.

Returns a dictionary: auc with its 95 % interval auc_low, auc_high; eer, accuracy, tpr_at_fpr;
thresholds, the tau_a that each criterion chooses with its tpr and fpr; positives, negatives and
distractors, numbers of pairs; and the curve, arrays distance, tpr, fpr. Raises ValueError where
shapes do not fit or there is no pair of one person or none of two.)");
  module.def("reid_metrics", &reid_metrics, "query"_a, "query_ids"_a, "query_cameras"_a,
             "gallery"_a, "gallery_ids"_a, "gallery_cameras"_a,
             R"(Search of each query in a gallery by the protocol of Market-1501 (single query).

query, gallery: (n, d), scaled to length 1; ids (n,), in the gallery 0 for background; cameras (n,).
Returns rank1, rank5, rank10, map, map_trapezoid, queries and queries_without_match; None when no
query has anything to find. Raises ValueError where shapes do not fit.)");
  module.def("set_num_threads", [](int threads) {
    io::require_in("threads", threads, 1, 1024);
    omp_set_num_threads(threads);
  });
}

}  // namespace sdmt::python

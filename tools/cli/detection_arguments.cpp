// SPDX-License-Identifier: Apache-2.0
#include "cli/detection_arguments.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sdmt/io/checked_value.h"
#include "sdmt/pipeline/sparse_detections.h"

namespace sdmt::tools {

std::unique_ptr<pipeline::DetectionSource> DetectionArguments::open(
    const std::string& input) const {
  if (!detector.empty() && !detections.empty()) {
    throw std::invalid_argument("--detector and --detections are both given, expected one of them");
  }
  if (!detector.empty()) return sparse(pipeline::open_detector(detector, options), input);
  const auto spec = detections.empty() ? pipeline::default_detections(input) : detections;
  mot::DetectionReading sized = reading;
  if (spec != "hog" && spec != "-") {
    const auto format = reading.format ? *reading.format : mot::recognise_format(spec);
    if (format == mot::DetectionFormat::yolo) {
      const auto size = pipeline::picture_size(input);
      sized.width = size.width;
      sized.height = size.height;
    }
  }
  auto source = pipeline::open_detection_source(spec, options.hog, sized);
  if (source->needs_images()) return sparse(std::move(source), input);
  if (!every.empty()) {
    throw std::invalid_argument("--detect-every is for detectors, and the boxes come from " + spec);
  }
  return source;
}

std::unique_ptr<pipeline::DetectionSource> DetectionArguments::sparse(
    std::unique_ptr<pipeline::DetectionSource> source, const std::string& input) const {
  if (every.empty()) return source;
  constexpr double kLooksASecond = 10;
  constexpr int kMost = 100;
  int interval = 1;
  if (every == "auto") {
    constexpr double kUsualRate = 30;  // of what cannot be opened twice
    const double rate =
        pipeline::is_live(input) ? kUsualRate : pipeline::open_frame_source(input)->frame_rate();
    interval = std::clamp(static_cast<int>(std::lround(rate / kLooksASecond)), 1, kMost);
  } else {
    const auto number = io::parse_number<int>(every);
    if (!number || *number < 1 || *number > kMost) {
      throw std::invalid_argument("--detect-every is " + io::quoted(every) +
                                  ", expected 1..100 or auto");
    }
    interval = *number;
  }
  return std::make_unique<pipeline::SparseDetections>(std::move(source), interval);
}

void add_detector_arguments(CLI::App& command, DetectionArguments& arguments) {
  pipeline::NetworkOptions& network = arguments.options.network;
  command
      .add_option("--detector", arguments.detector,
                  "Detector network, ONNX or Darknet (.cfg with its .weights beside it); or hog: "
                  "OpenCV's people detector")
      ->type_name("FILE|hog");
  command
      .add_option(
          "--detector-size", network.size,
          "Side of the square as large as the network's input, pixels, a multiple of 32 [the "
          "network's own]")
      ->type_name("PIXELS");
  command
      .add_option("--detector-score", network.min_score, "Least score of the network's boxes, 0..1")
      ->capture_default_str();
  command
      .add_option_function<std::string>(
          "--classes",
          [&arguments](const std::string& list) {
            arguments.options.network.classes = mot::ClassFilter(list);
            arguments.reading.classes = mot::ClassFilter(list);
          },
          "What is tracked, names or numbers of classes separated by commas, or all "
          "[person,pedestrian]")
      ->type_name("LIST");
  command
      .add_option("--hog-min-height", arguments.options.hog.min_person_height,
                  "Smallest person that hog looks for, pixels [64, more in large pictures]")
      ->type_name("PIXELS");
}

void add_detection_arguments(CLI::App& command, DetectionArguments& arguments) {
  command
      .add_option("--detections", arguments.detections,
                  "Boxes: a file, a folder of YOLO's, - for JSON lines from standard input, or "
                  "hog [the sequence's det/det.txt, else hog]")
      ->type_name("FILE|-|hog");
  command
      .add_option_function<std::string>(
          "--detections-format",
          [&arguments](const std::string& name) {
            arguments.reading.format = mot::parse_detection_format(name);
          },
          "How boxes are written: mot, csv, jsonl, kitti, coco or yolo [recognised]")
      ->check(CLI::IsMember({"mot", "csv", "jsonl", "kitti", "coco", "yolo"}).description(""))
      ->type_name("FORMAT");
  command
      .add_option("--frame-offset", arguments.reading.frame_offset,
                  "Added to the frame numbers of the boxes")
      ->check(CLI::Range(-1000000000, 1000000000).description(""))
      ->type_name("N");
  command
      .add_option("--detect-every", arguments.every,
                  "Let the detector look only where something has moved, and at every Nth frame at "
                  "most; auto: ten times a second [every frame]")
      ->type_name("N|auto");
  add_detector_arguments(command, arguments);
}

}  // namespace sdmt::tools

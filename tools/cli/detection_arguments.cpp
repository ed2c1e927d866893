// SPDX-License-Identifier: Apache-2.0
#include "cli/detection_arguments.h"

#include <stdexcept>

namespace sdmt::tools {

std::unique_ptr<pipeline::DetectionSource> DetectionArguments::open(
    const std::string& input) const {
  if (!detector.empty() && !detections.empty()) {
    throw std::invalid_argument("--detector and --detections are both given, expected one of them");
  }
  if (!detector.empty()) return pipeline::open_detector(detector, options);
  const auto spec = detections.empty() ? pipeline::default_detections(input) : detections;
  return pipeline::open_detection_source(spec, options.hog);
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
          "Longer side of the network's input, pixels, a multiple of 32 [the network's own]")
      ->type_name("PIXELS");
  command
      .add_option("--detector-score", network.min_score, "Least score of the network's boxes, 0..1")
      ->capture_default_str();
  command
      .add_option_function<std::string>(
          "--classes",
          [&network](const std::string& list) { network.classes = mot::ClassFilter(list); },
          "What is tracked, names or numbers of classes separated by commas, or all "
          "[person,pedestrian]")
      ->type_name("LIST");
  command
      .add_option("--hog-min-height", arguments.options.hog.min_person_height,
                  "Smallest person that hog looks for, pixels")
      ->capture_default_str();
}

void add_detection_arguments(CLI::App& command, DetectionArguments& arguments) {
  command
      .add_option("--detections", arguments.detections,
                  "MOT det.txt, or hog: OpenCV's people detector [the sequence's det/det.txt, "
                  "else hog]")
      ->type_name("FILE|hog");
  add_detector_arguments(command, arguments);
}

}  // namespace sdmt::tools

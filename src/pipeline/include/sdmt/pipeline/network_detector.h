// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sdmt/mot/class_filter.h"
#include "sdmt/pipeline/detection_source.h"
#include "sdmt/pipeline/network_options.h"

namespace sdmt::pipeline {

/// A detector network of the user's own, run by OpenCV's dnn module (OpenCV 4.5 or newer). Its head
/// is recognised by the shapes of the outputs: YOLOX, YOLOv5 and v7, YOLOv8, v9 and 11, YOLOv10
/// (all ONNX), NanoDet and NanoDet-Plus (ONNX), SSD's DetectionOutput, Darknet's region and yolo
/// layers.
///
/// A frame keeps its proportions: an input of open size takes them over, with as many pixels as the
/// square and at most 31 rows of grey below; one of fixed size is filled up with grey at the right
/// or below (letterbox). Also Darknet's networks, which were trained on pictures stretched to
/// squares, find more so, docs/tracking.md has the numbers. Networks of open size look a second
/// time, in an input of 192 x 192 pixels' area, for people taller than half of the picture: larger
/// inputs make them taller than those that the network was trained on. Of the boxes that overlap a
/// better one by IoU > 0.45 only the better is kept, whatever the classes. Scores are the
/// network's, 0 to 1.
///
/// Same frame, same boxes, for any number of threads; another version of OpenCV may differ in the
/// last digits. Not for accelerators: it runs on the CPU, with OpenMP's number of threads.
class NetworkDetector : public DetectionSource {
 public:
  /// Reads the network and runs it once. Throws std::invalid_argument when the file is none,
  /// is cut off, has an unknown head or none of the wanted classes, cannot be run at the wanted
  /// size, and when this library was built without OpenCV's dnn module.
  explicit NetworkDetector(const NetworkOptions& options);
  ~NetworkDetector() override;

  /// A frame without an image has no detections. Throws std::runtime_error when the network fails.
  std::vector<mot::Detection> detect(const Frame& frame) override;
  bool needs_images() const override { return true; }

  /// The kind of head, and the size of its input for a square picture, as "YOLOX, 416 x 416".
  std::string description() const;

 private:
  struct Network;
  std::unique_ptr<Network> network_;
};

}  // namespace sdmt::pipeline

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/network_detector.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <system_error>

#include "detection_head.h"
#include "detector_files.h"
#include "mat_view.h"
#include "opencv_threads.h"
#include "sdmt/mot/overlaps.h"

namespace sdmt::pipeline {

namespace fs = std::filesystem;

namespace {

constexpr int kSizeStep = 32;
constexpr int kOpenSize = 640;  // of networks that leave their input open
constexpr double kGrey = 114;
constexpr double kMaxOverlap = 0.45;

int round_up(double size) { return kSizeStep * static_cast<int>(std::ceil(size / kSizeStep)); }

// OpenCV takes zeros for weights that a Darknet file lacks.
void check_weights(cv::dnn::Net& net, const fs::path& file) {
  constexpr std::uintmax_t kHeader = 16;  // 20 bytes in newer files
  std::uintmax_t values = 0;
  for (const std::string& name : net.getLayerNames()) {
    const auto layer = net.getLayer(net.getLayerId(name));
    if (layer->type == "Region") continue;  // anchors, from the .cfg
    for (const cv::Mat& blob : layer->blobs) values += blob.total();
  }
  const auto size = fs::file_size(file);
  const auto least = kHeader + sizeof(float) * values;
  if (size >= least) return;
  throw std::invalid_argument(
      fmt::format("{}: is {} bytes long, expected {} by the .cfg: cut off, or of another network",
                  file.string(), size, least));
}

cv::dnn::Net read_network(const DetectorFiles& files) {
  const std::string name = files.network.string();
  try {
    cv::dnn::Net net = files.is_darknet()
                           ? cv::dnn::readNetFromDarknet(name, files.weights.string())
                           : cv::dnn::readNetFromONNX(name);
    net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    if (files.is_darknet()) check_weights(net, files.weights);
    return net;
  } catch (const cv::Exception& error) {
    throw std::invalid_argument(
        fmt::format("{}: OpenCV {} cannot read this network: {}", name, CV_VERSION, error.err));
  }
}

}  // namespace

void NetworkOptions::validate() const {
  constexpr int kLargest = 4096;
  if (size != 0 && (size < kSizeStep || size > kLargest || size % kSizeStep != 0)) {
    throw std::invalid_argument(fmt::format(
        "the detector's input size is {}, expected a multiple of 32 in 32..4096", size));
  }
  if (!(min_score >= 0 && min_score <= 1)) {
    throw std::invalid_argument(
        fmt::format("the detector's least score is {}, expected 0..1", min_score));
  }
}

struct NetworkDetector::Network {
  explicit Network(const NetworkOptions& given)
      : options((given.validate(), given)),
        files(find_detector_files(given.file)),
        net(read_network(files)) {
    const int longer = std::max(files.width, files.height);
    const int side = options.size > 0 ? options.size : longer > 0 ? longer : kOpenSize;
    const bool own = options.size == 0 && files.fixed_size;
    largest = own ? cv::Size(files.width, files.height) : cv::Size(side, side);
    fixed = own;
    try {
      output_names = net.getUnconnectedOutLayersNames();
      for (const int id : net.getUnconnectedOutLayers()) {
        regions.push_back(net.getLayer(id)->type == "Region");
      }
      run(cv::Mat(largest, CV_8UC3, cv::Scalar::all(kGrey)), {});
    } catch (const cv::Exception& error) {
      const std::string own_size =
          files.fixed_size ? fmt::format("; its own size is {} x {}", files.width, files.height)
                           : "";
      throw std::invalid_argument(
          fmt::format("{}: OpenCV {} cannot run this network at {} x {}{}: {}", name(), CV_VERSION,
                      largest.width, largest.height, own_size, error.err));
    }
    head = DetectionHead::recognise(outputs, largest.width, largest.height);
    if (!head) refuse_head();
    choose_classes();
    if (!own) try_oblong();
  }

  // Whether a network whose size is open takes inputs that are not square.
  void try_oblong() {
    const cv::Size oblong(largest.width, round_up(0.75 * largest.height));
    try {
      run(cv::Mat(oblong, CV_8UC3, cv::Scalar::all(kGrey)), {});
      candidates.clear();
      fixed = !head->decode(outputs, oblong.width, oblong.height, wanted, 1, candidates);
    } catch (const cv::Exception&) {
      fixed = true;
    }
  }

  std::string name() const { return files.network.string(); }

  [[noreturn]] void refuse_head() const {
    std::string shapes;
    for (const HeadOutput& output : outputs) {
      shapes += shapes.empty() ? "[" : ", [";
      for (std::size_t i = 0; i < output.shape.size(); ++i) {
        shapes += (i == 0 ? "" : " x ") + std::to_string(output.shape[i]);
      }
      shapes += "]";
    }
    throw std::invalid_argument(fmt::format(
        "{}: is no detector of a known kind: its outputs are {}, expected those of YOLOX, YOLOv5 "
        "to v11, NanoDet, SSD or Darknet (see docs/tracking.md)",
        name(), shapes));
  }

  std::string_view class_name(int index) const {
    constexpr int kCocoClasses = 80;
    if (!files.names.empty()) {
      return index < static_cast<int>(files.names.size()) ? std::string_view(files.names[index])
                                                          : std::string_view();
    }
    const int classes = head->classes();
    return classes == kCocoClasses || classes == 0 ? mot::coco_class_name(index)
                                                   : std::string_view();
  }

  void choose_classes() {
    constexpr int kUnknown = 80;  // rows that name their class: COCO's, unless names are given
    int classes = head->classes();
    if (classes == 0)
      classes = files.names.empty() ? kUnknown : static_cast<int>(files.names.size());
    for (int i = 0; i < classes; ++i) {
      wanted.push_back(classes == 1 || options.classes.wants(i, class_name(i)) ? 1 : 0);
    }
    if (std::find(wanted.begin(), wanted.end(), 1) != wanted.end()) return;
    const std::string first(class_name(0));
    throw std::invalid_argument(fmt::format(
        "{}: none of its {} classes{} is wanted ({}); name others with --classes, by name or "
        "number",
        name(), classes, first.empty() ? " (whose names are not known)" : ", '" + first + "' ...",
        options.classes.text()));
  }

  // The network's outputs for an image of the size of its input.
  void run(const cv::Mat& input, const InputPixels& pixels) {
    const int shape[] = {1, 3, input.rows, input.cols};
    blob.create(4, shape, CV_32F);
    const std::size_t plane = static_cast<std::size_t>(input.rows) * input.cols;
    auto* planes = blob.ptr<float>();
    for (int c = 0; c < 3; ++c, planes += plane) {
      const int channel = pixels.rgb ? 2 - c : c;
      for (int y = 0; y < input.rows; ++y) {
        const auto* row = input.ptr<std::uint8_t>(y) + channel;
        float* to = planes + static_cast<std::size_t>(y) * input.cols;
        for (int x = 0; x < input.cols; ++x) {
          to[x] = (static_cast<float>(row[3 * x]) - pixels.mean[c]) * pixels.factor[c];
        }
      }
    }
    const OpenCvThreads threads;
    net.setInput(blob);
    net.forward(mats, output_names);
    outputs.clear();
    for (std::size_t i = 0; i < mats.size(); ++i) {
      if (mats[i].type() != CV_32F || !mats[i].isContinuous()) {
        throw std::invalid_argument(name() + ": an output is not of 32-bit numbers");
      }
      const cv::MatSize& sizes = mats[i].size;
      outputs.push_back(
          {std::vector<int>(sizes.p, sizes.p + mats[i].dims), mats[i].ptr<float>(), regions[i]});
    }
  }

  cv::Size input_size(int width, int height) const {
    const double zoom = std::min(static_cast<double>(largest.width) / width,
                                 static_cast<double>(largest.height) / height);
    if (fixed) return largest;
    return {std::min(largest.width, round_up(width * zoom)),
            std::min(largest.height, round_up(height * zoom))};
  }

  std::vector<mot::Detection> detect(const image::Image& image) {
    const double zoom = std::min(static_cast<double>(largest.width) / image.width,
                                 static_cast<double>(largest.height) / image.height);
    const cv::Size inner(
        std::clamp(static_cast<int>(std::lround(image.width * zoom)), 1, largest.width),
        std::clamp(static_cast<int>(std::lround(image.height * zoom)), 1, largest.height));
    const cv::Size size = input_size(image.width, image.height);
    canvas.create(size, CV_8UC3);
    canvas.setTo(cv::Scalar::all(kGrey));
    cv::Mat part = canvas(cv::Rect(cv::Point(0, 0), inner));
    cv::resize(mat_view(image), part, inner, 0, 0, cv::INTER_LINEAR);
    candidates.clear();
    run(canvas, head->pixels());
    if (!head->decode(outputs, size.width, size.height, wanted, options.min_score, candidates)) {
      throw std::runtime_error("its outputs are not those of its input's size");
    }
    return survivors(static_cast<double>(image.width) / inner.width,
                     static_cast<double>(image.height) / inner.height);
  }

  std::vector<mot::Detection> survivors(double scale_x, double scale_y) {
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    std::vector<mot::Tlwh> boxes;
    std::vector<double> scores;
    for (const Candidate& c : candidates) {
      boxes.push_back(mot::to_tlwh({c.box.cx * scale_x + 1, c.box.cy * scale_y + 1,
                                    c.box.width * scale_x, c.box.height * scale_y}));
      scores.push_back(c.score);
    }
    std::vector<std::uint8_t> keep;
    mot::suppress_overlaps(boxes, scores, kMaxOverlap, overlaps, keep);
    std::vector<mot::Detection> people;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (keep[i] != 0) people.push_back({boxes[i], scores[i]});
    }
    return people;
  }

  NetworkOptions options;
  DetectorFiles files;
  cv::dnn::Net net;
  cv::Size largest;    // of the input
  bool fixed = false;  // it is always of that size
  std::optional<DetectionHead> head;
  std::vector<std::uint8_t> wanted;  // by class
  std::vector<cv::String> output_names;
  std::vector<bool> regions;  // by output
  // Of the frame at hand.
  cv::Mat canvas, blob;
  std::vector<cv::Mat> mats;
  std::vector<HeadOutput> outputs;
  std::vector<Candidate> candidates;
  mot::OverlapFinder overlaps;
};

NetworkDetector::NetworkDetector(const NetworkOptions& options)
    : network_(std::make_unique<Network>(options)) {}

NetworkDetector::~NetworkDetector() = default;

std::string NetworkDetector::description() const {
  return fmt::format("{}, {} x {}", network_->head->name(), network_->largest.width,
                     network_->largest.height);
}

std::vector<mot::Detection> NetworkDetector::detect(const Frame& frame) {
  if (!frame.has_image()) return {};
  const auto failed = [&](const std::string& why) {
    return std::runtime_error(
        fmt::format("{}: the network failed in frame {}: {}", network_->name(), frame.number, why));
  };
  try {
    return network_->detect(frame.image);
  } catch (const cv::Exception& error) {
    throw failed(error.err);
  } catch (const std::logic_error& error) {
    throw failed(error.what());
  } catch (const std::runtime_error& error) {
    throw failed(error.what());
  }
}

}  // namespace sdmt::pipeline

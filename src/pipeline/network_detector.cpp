// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/network_detector.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>
#include <system_error>

#include "detection_head.h"
#include "detector_files.h"
#include "mat_view.h"
#include "opencv_threads.h"
#include "sdmt/io/delimited_text.h"
#include "sdmt/mot/overlaps.h"

namespace sdmt::pipeline {

namespace fs = std::filesystem;

namespace {

constexpr int kSizeStep = 32;
constexpr int kLargestSize = 4096;
constexpr int kOpenSize = 640;  // of networks that leave their input open
constexpr double kGrey = 114;
// Networks whose input may be enlarged do not know people who are taller than they were trained on.
// These are looked for a second time in an input that is small for all of them.
constexpr int kSmallSide = 192;
constexpr double kTall = 0.5;  // of the picture's height
constexpr double kMaxOverlap = 0.45;

int steps(double count) { return kSizeStep * std::max(1, static_cast<int>(count)); }
int round_up(double size) { return steps(std::ceil(size / kSizeStep)); }
int round_nearest(double size) { return steps(std::round(size / kSizeStep)); }

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

// OpenCV takes [yolo] layers at their word only from a score of 0.2 on, unless they name another.
std::string config_down_to(double min_score, const fs::path& file) {
  constexpr std::string_view kLayer = "[yolo]";
  std::string text = io::read_text(file);
  const std::string line = fmt::format("\nthresh={:.6f}", min_score);
  for (auto at = text.find(kLayer); at != std::string::npos; at = text.find(kLayer, at)) {
    text.insert(at += kLayer.size(), line);
  }
  return text;
}

cv::dnn::Net read_network(const DetectorFiles& files, double min_score) {
  const std::string name = files.network.string();
  try {
    cv::dnn::Net net;
    if (files.is_darknet()) {
      const std::string config = config_down_to(min_score, files.network);
      const std::string weights = io::read_text(files.weights);
      net =
          cv::dnn::readNetFromDarknet(config.data(), config.size(), weights.data(), weights.size());
    } else {
      net = cv::dnn::readNetFromONNX(name);
    }
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
  if (size != 0 && (size < kSizeStep || size > kLargestSize || size % kSizeStep != 0)) {
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
        net(read_network(files, given.min_score)) {
    const double stated = std::sqrt(static_cast<double>(files.width) * files.height);
    const int side = options.size > 0 ? options.size
                     : stated > 0     ? round_nearest(stated)
                                      : kOpenSize;
    const bool own = options.size == 0 && files.fixed_size;
    square = own ? cv::Size(files.width, files.height) : cv::Size(side, side);
    fixed = own;
    try {
      output_names = net.getUnconnectedOutLayersNames();
      for (const int id : net.getUnconnectedOutLayers()) {
        regions.push_back(net.getLayer(id)->type == "Region");
      }
      run(net, cv::Mat(square, CV_8UC3, cv::Scalar::all(kGrey)), {});
    } catch (const cv::Exception& error) {
      const std::string own_size =
          files.fixed_size ? fmt::format("; its own size is {} x {}", files.width, files.height)
                           : "";
      throw std::invalid_argument(
          fmt::format("{}: OpenCV {} cannot run this network at {} x {}{}: {}", name(), CV_VERSION,
                      square.width, square.height, own_size, error.err));
    }
    head = DetectionHead::recognise(outputs, square.width, square.height);
    if (!head) refuse_head();
    choose_classes();
    if (own) return;
    try_oblong();
    if (!fixed && square.area() > kSmallSide * kSmallSide) {
      small_net = read_network(files, options.min_score);
    }
  }

  // Whether a network whose size is open takes inputs that are not square.
  void try_oblong() {
    const cv::Size oblong(square.width, round_up(0.75 * square.height));
    try {
      run(net, cv::Mat(oblong, CV_8UC3, cv::Scalar::all(kGrey)), {});
      fixed = !head->decode(outputs, oblong.width, oblong.height, wanted, 1, seen);
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

  // Its outputs for an image of the size of its input.
  void run(cv::dnn::Net& by, const cv::Mat& input, const InputPixels& pixels) {
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
    by.setInput(blob);
    by.forward(mats, output_names);
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

  // As many pixels as `area`, in the picture's proportions.
  static cv::Size input_size(int area, const image::Image& image) {
    const double zoom = std::sqrt(static_cast<double>(area) / image.width / image.height);
    const int width = std::min(round_nearest(image.width * zoom), kLargestSize);
    const double height = static_cast<double>(width) * image.height / image.width;
    return {width, std::min(round_up(height), kLargestSize)};
  }

  std::vector<mot::Detection> detect(const image::Image& image) {
    candidates.clear();
    look(net, fixed ? square : input_size(square.area(), image), image, 0);
    if (small_net) {
      look(*small_net, input_size(kSmallSide * kSmallSide, image), image, kTall * image.height);
    }
    return survivors();
  }

  // Adds candidates of at least `least_height`, in pixels of the picture.
  void look(cv::dnn::Net& by, const cv::Size& size, const image::Image& image,
            double least_height) {
    const double zoom = std::min(static_cast<double>(size.width) / image.width,
                                 static_cast<double>(size.height) / image.height);
    const cv::Size inner(
        std::clamp(static_cast<int>(std::lround(image.width * zoom)), 1, size.width),
        std::clamp(static_cast<int>(std::lround(image.height * zoom)), 1, size.height));
    canvas.create(size, CV_8UC3);
    canvas.setTo(cv::Scalar::all(kGrey));
    cv::Mat part = canvas(cv::Rect(cv::Point(0, 0), inner));
    cv::resize(mat_view(image), part, inner, 0, 0, cv::INTER_LINEAR);
    run(by, canvas, head->pixels());
    seen.clear();
    if (!head->decode(outputs, size.width, size.height, wanted, options.min_score, seen)) {
      throw std::runtime_error("its outputs are not those of its input's size");
    }
    const double scale_x = static_cast<double>(image.width) / inner.width;
    const double scale_y = static_cast<double>(image.height) / inner.height;
    for (const auto& [box, score] : seen) {
      const mot::Cxcywh there{box.cx * scale_x + 1, box.cy * scale_y + 1, box.width * scale_x,
                              box.height * scale_y};
      if (there.height >= least_height) candidates.push_back({there, score});
    }
  }

  std::vector<mot::Detection> survivors() {
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    std::vector<mot::Tlwh> boxes;
    std::vector<double> scores;
    for (const Candidate& c : candidates) {
      boxes.push_back(mot::to_tlwh(c.box));
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
  std::optional<cv::dnn::Net> small_net;  // the same, for the second look
  cv::Size square;                        // its input for a square picture
  bool fixed = false;                     // its input is always of that size
  std::optional<DetectionHead> head;
  std::vector<std::uint8_t> wanted;  // by class
  std::vector<cv::String> output_names;
  std::vector<bool> regions;  // by output
  // Of the frame at hand.
  cv::Mat canvas, blob;
  std::vector<cv::Mat> mats;
  std::vector<HeadOutput> outputs;
  std::vector<Candidate> seen, candidates;  // by one look, in its pixels; by all, in the picture's
  mot::OverlapFinder overlaps;
};

NetworkDetector::NetworkDetector(const NetworkOptions& options)
    : network_(std::make_unique<Network>(options)) {}

NetworkDetector::~NetworkDetector() = default;

std::string NetworkDetector::description() const {
  return fmt::format("{}, {} x {}", network_->head->name(), network_->square.width,
                     network_->square.height);
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

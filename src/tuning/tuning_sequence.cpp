// SPDX-License-Identifier: Apache-2.0
#include "sdmt/tuning/tuning_sequence.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace sdmt::tuning {

namespace {

struct SequenceName {
  std::string folder;
  std::string detector = "det.txt";
  std::string calibration = "none";
};

SequenceName parse_name(const std::string& text) {
  SequenceName name;
  const auto equals = text.find('=');
  name.folder = text.substr(0, equals);
  if (equals == std::string::npos) return name;
  name.detector = text.substr(equals + 1);
  if (const auto at = name.detector.find('@'); at != std::string::npos) {
    name.calibration = name.detector.substr(at + 1);
    name.detector.resize(at);
  }
  return name;
}

TuningSequence read_sequence(const std::filesystem::path& folder, const SequenceName& name) {
  TuningSequence input;
  input.sequence = mot::Sequence::read(folder);
  input.gt = eval::read_sequence_ground_truth(folder);
  const bool classes = !input.gt.rows.empty() && input.gt.rows.front().category > 0;
  input.benchmark = classes ? eval::Benchmark::mot16 : eval::Benchmark::mot15;
  input.detector = name.detector;
  input.detections = mot::DetectionFile::read(folder / "det" / name.detector);
  input.calibration = track::parse_calibration(name.calibration);
  return input;
}

}  // namespace

track::TrackerOptions TuningSequence::adjusted(track::TrackerOptions options) const {
  if (!options.input.calibration) options.input.calibration = calibration;
  options.fit_to_picture({sequence.width, sequence.height}, sequence.folder.string());
  return options;
}

std::vector<TuningSequence> read_sequences(std::span<const std::string> names) {
  std::vector<TuningSequence> sequences;
  for (const std::string& text : names) {
    const SequenceName name = parse_name(text);
    for (const auto& folder : eval::find_sequences(name.folder)) {
      TuningSequence input = read_sequence(folder, name);
      const auto same = [&](const TuningSequence& other) {
        return other.gt.name == input.gt.name && other.detector == input.detector;
      };
      if (std::any_of(sequences.begin(), sequences.end(), same)) {
        throw std::invalid_argument("sequence " + input.gt.name + " is given twice with " +
                                    input.detector);
      }
      sequences.push_back(std::move(input));
    }
  }
  return sequences;
}

}  // namespace sdmt::tuning

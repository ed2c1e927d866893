// SPDX-License-Identifier: Apache-2.0
#include "checkpoint.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <stdexcept>

#include "sdmt/io/safetensors.h"

namespace sdmt::train {

namespace {

// Away from the model's own names, which a model reader looks for.
constexpr const char* kPrefix = "training.";
constexpr const char* kProgress = "training.progress";
constexpr std::size_t kIterations = 2;  // values of it before the scores

std::vector<std::uint64_t> file_shape(const nn::Shape& shape) {
  return {static_cast<std::uint64_t>(shape.n), static_cast<std::uint64_t>(shape.h),
          static_cast<std::uint64_t>(shape.w), static_cast<std::uint64_t>(shape.c)};
}

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& what) {
  throw std::invalid_argument(path.string() + ": damaged checkpoint: " + what);
}

void require_possible(const std::filesystem::path& path, const nn::NamedTensor& named) {
  const auto values = named.tensor->values();
  const auto odd = std::ranges::find_if(values, [](float value) { return !std::isfinite(value); });
  if (odd != values.end()) refuse(path, kPrefix + named.name + " holds a value that is not finite");
  // Variances of the batch normalisation, and Adam's second moments and its count of steps.
  const bool is_square = named.name.ends_with("running_var") ||
                         named.name.ends_with(".exp_avg_sq") || named.name.ends_with(".step");
  if (is_square && !values.empty() && std::ranges::min(values) < 0) {
    refuse(path, kPrefix + named.name + " holds " + to_text(std::ranges::min(values)) +
                     ", expected values >= 0");
  }
}

void require_possible(const std::filesystem::path& path, const Checkpoint& checkpoint,
                      std::int64_t iterations) {
  const auto at = checkpoint.iteration, best = checkpoint.best_iteration;
  if (at < 0 || at > iterations || best < 0 || best > at) {
    refuse(path, "it is of iteration " + std::to_string(at) + ", the best weights of " +
                     std::to_string(best) +
                     ", expected 0 <= best <= iteration <= " + std::to_string(iterations));
  }
  for (const double score : checkpoint.best_scores) {
    if (score >= 0 && score <= 1) continue;
    refuse(path, "its best score is " + to_text(score) + ", expected 0..1");
  }
}

}  // namespace

void write_checkpoint(const std::filesystem::path& path, const reid::Model& model,
                      const Configuration& configuration, const Checkpoint& checkpoint) {
  io::SafetensorsWriter writer;
  reid::add_model(writer, model, reid::Storage::float32);
  for (const auto& [key, value] : configuration) writer.set_metadata(kPrefix + key, value);
  for (const auto& [name, tensor] : checkpoint.tensors) {
    writer.add(kPrefix + name, file_shape(tensor->shape()),
               std::span<const float>(tensor->values()));
  }
  std::vector<std::uint64_t> progress = {static_cast<std::uint64_t>(checkpoint.iteration),
                                         static_cast<std::uint64_t>(checkpoint.best_iteration)};
  for (const double score : checkpoint.best_scores) {
    progress.push_back(std::bit_cast<std::uint64_t>(score));
  }
  writer.add(kProgress, {progress.size()}, std::span<const std::uint64_t>(progress));
  writer.write(path);
}

void read_checkpoint(const std::filesystem::path& path, const Configuration& configuration,
                     std::int64_t iterations, Checkpoint& checkpoint) {
  const io::Safetensors file(path);
  if (file.find(kProgress) == nullptr) {
    throw std::invalid_argument(path.string() + ": is no training checkpoint, expected a tensor " +
                                kProgress);
  }
  Configuration stored;
  const std::string prefix = kPrefix;
  for (const auto& [key, value] : file.metadata()) {
    if (key.starts_with(prefix)) stored[key.substr(prefix.size())] = value;
  }
  require_same_configuration(path.string(), stored, configuration);
  for (const auto& [name, tensor] : checkpoint.tensors) {
    const auto& entry = file.at(kPrefix + name, file_shape(tensor->shape()));
    file.read_floats(entry, tensor->values());
    require_possible(path, {name, tensor});
  }
  const auto progress = file.read_integers(kProgress);
  const std::size_t expected = kIterations + checkpoint.best_scores.size();
  if (progress.size() != expected) {
    throw std::invalid_argument(path.string() + ": " + kProgress + " has " +
                                std::to_string(progress.size()) + " values, expected " +
                                std::to_string(expected));
  }
  checkpoint.iteration = static_cast<std::int64_t>(progress[0]);
  checkpoint.best_iteration = static_cast<std::int64_t>(progress[1]);
  for (std::size_t i = 0; i < checkpoint.best_scores.size(); ++i) {
    checkpoint.best_scores[i] = std::bit_cast<double>(progress[kIterations + i]);
  }
  require_possible(path, checkpoint, iterations);
}

void broadcast_checkpoint(nn::ProcessGroup& group, Checkpoint& checkpoint) {
  const auto share = [&group](auto& value) {
    group.broadcast(std::as_writable_bytes(std::span(&value, 1)));
  };
  share(checkpoint.iteration);
  share(checkpoint.best_iteration);
  for (double& score : checkpoint.best_scores) share(score);
  for (const auto& [name, tensor] : checkpoint.tensors) {
    group.broadcast(std::as_writable_bytes(tensor->values()));
  }
}

}  // namespace sdmt::train

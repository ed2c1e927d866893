// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/teacher_loss.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdmt/io/first_error.h"

namespace sdmt::train {

namespace {

template <typename T>
double dot(const T* a, const T* b, std::size_t size) {
  double sum = 0;
#pragma omp simd reduction(+ : sum)
  for (std::size_t k = 0; k < size; ++k) sum += static_cast<double>(a[k]) * b[k];
  return sum;
}

constexpr double kTemperature = 0.1;

// log sum exp
double log_sum(const std::vector<double>& values) {
  const double largest = *std::max_element(values.begin(), values.end());
  double sum = 0;
  for (const double value : values) sum += std::exp(value - largest);
  return largest + std::log(sum);
}

template <typename T>
double match_vectors(std::span<const T> embeddings, std::span<const T> teacher, int images,
                     double weight, std::span<T> gradient) {
  double loss = 0;
  for (std::size_t k = 0; k < embeddings.size(); ++k) {
    const double difference = static_cast<double>(embeddings[k]) - teacher[k];
    loss += difference * difference / images;
    gradient[k] += static_cast<T>(2 * weight * difference / images);
  }
  return loss;
}

// By all threads: pull(i, gradient of image i) returns the image's share of the loss and adds to
// the gradient, which is in double until it is whole. The same for any number of threads.
template <typename T, typename Pull>
double sum_over_images(std::size_t images, std::span<T> gradient, Pull pull) {
  const std::size_t size = gradient.size() / images;
  std::vector<double> losses(images, 0.0);
  io::FirstError error;
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < images; ++i) {
    error.guard([&] {
      std::vector<double> sum(size, 0.0);
      losses[i] = pull(i, sum);
      for (std::size_t k = 0; k < size; ++k) gradient[i * size + k] += static_cast<T>(sum[k]);
    });
  }
  error.rethrow();
  double loss = 0;
  for (const double part : losses) loss += part;
  return loss;
}

template <typename T>
double match_relations(std::span<const T> embeddings, std::span<const T> teacher,
                       std::size_t images, double weight, std::span<T> gradient) {
  const std::size_t size = embeddings.size() / images, teacher_size = teacher.size() / images;
  const double share = 1.0 / (static_cast<double>(images) * static_cast<double>(images - 1));
  return sum_over_images(images, gradient, [&](std::size_t i, std::vector<double>& pull) {
    const T* e = embeddings.data() + i * size;
    double loss = 0;
    for (std::size_t j = 0; j < images; ++j) {
      if (j == i) continue;
      const T* other = embeddings.data() + j * size;
      const double difference =
          dot(e, other, size) -
          dot(teacher.data() + i * teacher_size, teacher.data() + j * teacher_size, teacher_size);
      loss += share * difference * difference;
      // Each pair occurs twice in the mean, with i first and with j first.
      const double factor = 4 * weight * share * difference;
      for (std::size_t k = 0; k < size; ++k) pull[k] += factor * other[k];
    }
    return loss;
  });
}

template <typename T>
double match_similarities(std::span<const T> embeddings, std::span<const T> teacher,
                          std::size_t images, double weight, std::span<T> gradient) {
  const std::size_t size = embeddings.size() / images;
  const auto count = static_cast<double>(images);
  return sum_over_images(images, gradient, [&](std::size_t i, std::vector<double>& pull) {
    std::vector<double> ours(images), theirs(images);
    for (std::size_t j = 0; j < images; ++j) {
      const T* other = teacher.data() + j * size;
      ours[j] = dot(embeddings.data() + i * size, other, size) / kTemperature;
      theirs[j] = dot(teacher.data() + i * size, other, size) / kTemperature;
    }
    const double our_sum = log_sum(ours), their_sum = log_sum(theirs);
    double loss = 0;
    for (std::size_t j = 0; j < images; ++j) {
      const double p = std::exp(ours[j] - our_sum), q = std::exp(theirs[j] - their_sum);
      loss += q * ((theirs[j] - their_sum) - (ours[j] - our_sum)) / count;
      const double factor = weight * (p - q) / (kTemperature * count);
      const T* other = teacher.data() + j * size;
      for (std::size_t k = 0; k < size; ++k) pull[k] += factor * other[k];
    }
    return loss;
  });
}

}  // namespace

template <typename T>
double teacher_loss(std::span<const T> embeddings, std::span<const T> teacher, int images,
                    TeacherMatch match, double weight, std::span<T> gradient) {
  const auto count = static_cast<std::size_t>(images);
  const bool fits = images >= 1 && embeddings.size() % count == 0 && teacher.size() % count == 0 &&
                    gradient.size() == embeddings.size();
  const bool right =
      match == TeacherMatch::relations ? images >= 2 : teacher.size() == embeddings.size();
  if (!fits || !right) {
    throw std::invalid_argument("teacher loss: " + std::to_string(images) + " images with " +
                                std::to_string(embeddings.size()) + " values, " +
                                std::to_string(teacher.size()) + " of the teacher and " +
                                std::to_string(gradient.size()) + " of the gradient");
  }
  switch (match) {
    case TeacherMatch::projection:
      return match_vectors(embeddings, teacher, images, weight, gradient);
    case TeacherMatch::relations:
      return match_relations(embeddings, teacher, count, weight, gradient);
    case TeacherMatch::similarities:
      return match_similarities(embeddings, teacher, count, weight, gradient);
  }
  throw std::logic_error("teacher loss: no such match");
}

template double teacher_loss(std::span<const float>, std::span<const float>, int, TeacherMatch,
                             double, std::span<float>);
template double teacher_loss(std::span<const double>, std::span<const double>, int, TeacherMatch,
                             double, std::span<double>);

}  // namespace sdmt::train

// SPDX-License-Identifier: Apache-2.0
#include "channel_shards.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "parameter_access.h"

namespace sdmt::nn {

namespace {

/// Two values for every shard and channel, which processes tell each other.
class ShardValues {
 public:
  explicit ShardValues(int channels)
      : channels_(static_cast<std::size_t>(channels)), values_(kShards * 2 * channels_) {}

  double* first(int shard) { return values_.data() + shard * 2 * channels_; }
  double* second(int shard) { return first(shard) + channels_; }
  void set(int shard, const ChannelValues& first_values, const ChannelValues& second_values) {
    std::ranges::copy(first_values, first(shard));
    std::ranges::copy(second_values, second(shard));
  }
  void gather(const BatchShards& shards) { shards.gather_shards(values_, 2 * channels_); }

 private:
  std::size_t channels_;
  std::vector<double> values_;
};

/// Of the shards that are here, in the rows of x.
RowBounds rows_of_shards(const Tensor& x, const BatchShards& shards) {
  const std::int64_t rows_of_image = rows_of({1, x.shape().h, x.shape().w, x.shape().c});
  RowBounds bounds;
  for (int s = shards.first(); s <= shards.end(); ++s) {
    bounds.push_back((shards.begin(s) - shards.begin(shards.first())) * rows_of_image);
  }
  return bounds;
}

}  // namespace

ChannelMoments moments_of_batch(const Tensor& x, const BatchShards& shards) {
  const int channels = x.shape().c;
  ShardValues values(channels);
  const auto here = channel_moments(x, rows_of_shards(x, shards));
  for (int s = shards.first(); s < shards.end(); ++s) {
    const ChannelMoments& moments = here[s - shards.first()];
    values.set(s, moments.mean, moments.squares);
  }
  values.gather(shards);
  const double rows_of_image = static_cast<double>(x.shape().h) * x.shape().w;
  for (int width = 1; width < kShards; width *= 2) {
    for (int s = 0; s < kShards; s += 2 * width) {
      const int middle = shards.begin(s + width);
      const double before = (middle - shards.begin(s)) * rows_of_image;
      const double count = (shards.begin(s + 2 * width) - middle) * rows_of_image;
      for (int c = 0; c < channels; ++c) {
        merge_moments(before, count, values.first(s + width)[c], values.second(s + width)[c],
                      values.first(s)[c], values.second(s)[c]);
      }
    }
  }
  return {ChannelValues(values.first(0), values.first(0) + channels),
          ChannelValues(values.second(0), values.second(0) + channels)};
}

ChannelGradientSums gradient_sums_of_batch(const Tensor& x, const Tensor& dy,
                                           const ChannelStatistics& statistics,
                                           const ChannelAffine& affine, const BatchShards& shards) {
  auto here = channel_gradient_sums(x, dy, statistics, affine, rows_of_shards(x, shards));
  std::vector<ChannelGradientSums> parts(kShards, zero_sums(x.shape().c));
  std::ranges::move(here, parts.begin() + shards.first());
  return sum_of_shards(std::move(parts), shards);
}

ChannelGradientSums zero_sums(int channels) {
  return {ChannelValues(channels), ChannelValues(channels)};
}

void add_sums(const ChannelGradientSums& from, ChannelGradientSums& to) {
  for (std::size_t c = 0; c < to.dy.size(); ++c) {
    to.dy[c] += from.dy[c];
    to.dy_by_x[c] += from.dy_by_x[c];
  }
}

ChannelGradientSums sum_of_shards(std::vector<ChannelGradientSums> parts,
                                  const BatchShards& shards) {
  const int channels = static_cast<int>(parts.front().dy.size());
  if (shards.group().size() > 1) {
    ShardValues values(channels);
    for (int s = shards.first(); s < shards.end(); ++s)
      values.set(s, parts[s].dy, parts[s].dy_by_x);
    values.gather(shards);
    for (int s = 0; s < kShards; ++s) {
      std::copy_n(values.first(s), channels, parts[s].dy.begin());
      std::copy_n(values.second(s), channels, parts[s].dy_by_x.begin());
    }
  }
  for (int width = 1; width < kShards; width *= 2) {
    for (int s = 0; s < kShards; s += 2 * width) add_sums(parts[s + width], parts[s]);
  }
  return std::move(parts.front());
}

void add_to_gradient(const ChannelValues& sums, Parameter& parameter) {
  if (!parameter.trainable) return;
  float* const gradient = gradient_of(parameter);
  for (std::size_t c = 0; c < sums.size(); ++c) gradient[c] += static_cast<float>(sums[c]);
}

}  // namespace sdmt::nn

// SPDX-License-Identifier: Apache-2.0
#include "kernels/channel_norm.h"

#include <algorithm>
#include <cstddef>
#include <type_traits>

#include "sdmt/io/first_error.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/channel_norm.cpp"
#include <hwy/foreach_target.h>
// Highway's order: highway.h comes after foreach_target.h.
#include <hwy/highway.h>

namespace sdmt::nn {
#ifndef SDMT_NN_CHANNEL_NORM_ONCE_
#define SDMT_NN_CHANNEL_NORM_ONCE_
/// Some rows of x and dy, and what is known of their channels.
struct ChannelRows {
  const float* x = nullptr;
  const float* dy = nullptr;
  std::int64_t rows = 0;
  int channels = 0;
  const double* mean = nullptr;
  const double* inv_std = nullptr;
  const double* scale = nullptr;
  const double* shift = nullptr;
  bool relu = false;
};
#endif
}  // namespace sdmt::nn

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Calls step(tag, channel) for every vector of channels; the last ones come singly.
template <class Step>
HWY_INLINE void ForChannels(int channels, const Step& step) {
  const hn::ScalableTag<double> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  int c = 0;
  for (; c + lanes <= channels; c += lanes) step(d, c);
  for (; c < channels; ++c) step(hn::CappedTag<double, 1>(), c);
}

/// Rows that some channels are summed over before the next: they stay in the level-1 cache, and the
/// sums and what is known of the channels in registers.
constexpr std::int64_t kRowsAtOnce = 16;

constexpr int kMomentVectors = 4;
constexpr int kGradientVectors = 2;

template <int kCount>
using Vectors = std::integral_constant<int, kCount>;

/// Calls step(tag, vectors, channel, first row, end of the rows), row by row of each channel in
/// order: for kVectors vectors of channels where there are as many, for single ones, and for the
/// last channels one by one.
template <int kVectors, class Step>
HWY_INLINE void ForColumns(const ChannelRows& in, const Step& step) {
  const hn::ScalableTag<double> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (std::int64_t row = 0; row < in.rows; row += kRowsAtOnce) {
    const std::int64_t end = std::min(in.rows, row + kRowsAtOnce);
    int c = 0;
    for (; c + kVectors * lanes <= in.channels; c += kVectors * lanes) {
      step(d, Vectors<kVectors>(), c, row, end);
    }
    for (; c + lanes <= in.channels; c += lanes) step(d, Vectors<1>(), c, row, end);
    for (; c < in.channels; ++c) step(hn::CappedTag<double, 1>(), Vectors<1>(), c, row, end);
  }
}

template <class D>
HWY_INLINE hn::Vec<D> LoadDoubles(D d, const float* from) {
  return hn::PromoteTo(d, hn::LoadU(hn::Rebind<float, D>(), from));
}

template <class D>
HWY_INLINE void StoreFloats(D, hn::Vec<D> values, float* to) {
  const hn::Rebind<float, D> f;
  hn::StoreU(hn::DemoteTo(f, values), f, to);
}

/// Whether the ReLU lets the value through, once it is rounded to float.
template <class D>
HWY_INLINE hn::Mask<D> Passes(D d, hn::Vec<D> value) {
  return hn::Gt(value, hn::Set(d, 0x1p-150));  // what is smaller is rounded to 0
}

/// The gradient at dy after the ReLU, if there is one.
template <class D>
HWY_INLINE hn::Vec<D> Gradient(D d, bool relu, hn::Vec<D> x, hn::Vec<D> scale, hn::Vec<D> shift,
                               const float* dy) {
  const auto g = LoadDoubles(d, dy);
  if (!relu) return g;
  return hn::IfThenElseZero(Passes(d, hn::Add(hn::Mul(x, scale), shift)), g);
}

/// Adds term(tag, x, channel) of all rows to sums.
template <class Term>
HWY_INLINE void SumRows(const ChannelRows& in, double* sums, const Term& term) {
  ForColumns<kMomentVectors>(
      in, [&](auto d, auto vectors, int c, std::int64_t row, std::int64_t end) HWY_ATTR {
        constexpr int kVectors = decltype(vectors)::value;
        const int lanes = static_cast<int>(hn::Lanes(d));
        hn::Vec<decltype(d)> sum[kVectors];
        for (int v = 0; v < kVectors; ++v) sum[v] = hn::LoadU(d, sums + c + v * lanes);
        const float* x = in.x + row * in.channels + c;
        for (; row < end; ++row, x += in.channels) {
#pragma GCC unroll 4
          for (int v = 0; v < kVectors; ++v) {
            sum[v] = hn::Add(sum[v], term(d, LoadDoubles(d, x + v * lanes), c + v * lanes));
          }
        }
        for (int v = 0; v < kVectors; ++v) hn::StoreU(sum[v], d, sums + c + v * lanes);
      });
}

/// mean, squares: of these rows alone.
void MomentsOfRows(const ChannelRows& in, double* mean, double* squares) {
  std::fill_n(mean, in.channels, 0.0);
  std::fill_n(squares, in.channels, 0.0);
  SumRows(in, mean, [](auto, auto x, int) HWY_ATTR { return x; });
  for (int c = 0; c < in.channels; ++c) mean[c] /= static_cast<double>(in.rows);
  SumRows(in, squares, [mean](auto d, auto x, int c) HWY_ATTR {
    const auto centred = hn::Sub(x, hn::LoadU(d, mean + c));
    return hn::Mul(centred, centred);
  });
}

void AffineOfRows(const ChannelRows& in, float* y) {
  const float* x = in.x;
  for (std::int64_t row = 0; row < in.rows; ++row, x += in.channels, y += in.channels) {
    ForChannels(in.channels, [&](auto d, int c) HWY_ATTR {
      auto value = hn::Add(hn::Mul(LoadDoubles(d, x + c), hn::LoadU(d, in.scale + c)),
                           hn::LoadU(d, in.shift + c));
      // Keeps NaN, as the ReLU layer does.
      if (in.relu) value = hn::IfThenElse(hn::Lt(value, hn::Zero(d)), hn::Zero(d), value);
      StoreFloats(d, value, y + c);
    });
  }
}

void GradientSumsOfRows(const ChannelRows& in, double* sum, double* sum_by_x) {
  std::fill_n(sum, in.channels, 0.0);
  std::fill_n(sum_by_x, in.channels, 0.0);
  ForColumns<kGradientVectors>(
      in, [&](auto d, auto vectors, int c, std::int64_t row, std::int64_t end) HWY_ATTR {
        using D = decltype(d);
        constexpr int kVectors = decltype(vectors)::value;
        const int lanes = static_cast<int>(hn::Lanes(d));
        hn::Vec<D> mean[kVectors], inv_std[kVectors], scale[kVectors], shift[kVectors];
        hn::Vec<D> total[kVectors], total_by_x[kVectors];
#pragma GCC unroll 4
        for (int v = 0; v < kVectors; ++v) {
          const int at = c + v * lanes;
          mean[v] = hn::LoadU(d, in.mean + at);
          inv_std[v] = hn::LoadU(d, in.inv_std + at);
          scale[v] = hn::LoadU(d, in.scale + at);
          shift[v] = hn::LoadU(d, in.shift + at);
          total[v] = hn::LoadU(d, sum + at);
          total_by_x[v] = hn::LoadU(d, sum_by_x + at);
        }
        for (std::int64_t at = row * in.channels + c; row < end; ++row, at += in.channels) {
#pragma GCC unroll 4
          for (int v = 0; v < kVectors; ++v) {
            const auto x = LoadDoubles(d, in.x + at + v * lanes);
            const auto g = Gradient(d, in.relu, x, scale[v], shift[v], in.dy + at + v * lanes);
            total[v] = hn::Add(total[v], g);
            total_by_x[v] =
                hn::Add(total_by_x[v], hn::Mul(hn::Mul(g, hn::Sub(x, mean[v])), inv_std[v]));
          }
        }
#pragma GCC unroll 4
        for (int v = 0; v < kVectors; ++v) {
          hn::StoreU(total[v], d, sum + c + v * lanes);
          hn::StoreU(total_by_x[v], d, sum_by_x + c + v * lanes);
        }
      });
}

void InputGradientOfRows(const ChannelRows& in, const double* mean_dy, const double* mean_dy_by_x,
                         float* dx) {
  const float* x = in.x;
  const float* dy = in.dy;
  for (std::int64_t row = 0; row < in.rows; ++row) {
    ForChannels(in.channels, [&](auto d, int c) HWY_ATTR {
      const auto value = LoadDoubles(d, x + c);
      const auto scale = hn::LoadU(d, in.scale + c);
      const auto g = Gradient(d, in.relu, value, scale, hn::LoadU(d, in.shift + c), dy + c);
      const auto normalised =
          hn::Mul(hn::Sub(value, hn::LoadU(d, in.mean + c)), hn::LoadU(d, in.inv_std + c));
      const auto rest = hn::Sub(hn::Sub(g, hn::LoadU(d, mean_dy + c)),
                                hn::Mul(normalised, hn::LoadU(d, mean_dy_by_x + c)));
      StoreFloats(d, hn::Mul(scale, rest), dx + c);
    });
    x += in.channels;
    dy += in.channels;
    dx += in.channels;
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sdmt::nn {

HWY_EXPORT(MomentsOfRows);
HWY_EXPORT(AffineOfRows);
HWY_EXPORT(GradientSumsOfRows);
HWY_EXPORT(InputGradientOfRows);

namespace {

constexpr std::int64_t kRowsPerPart = 512;  // stay in the level-2 cache between two readings

std::int64_t rows_of(const Tensor& x) { return static_cast<std::int64_t>(x.size()) / x.shape().c; }

/// Calls run(part, first row, number of rows) for all parts, in parallel.
template <class Run>
void for_parts(std::int64_t rows, const Run& run) {
  const std::int64_t parts = (rows + kRowsPerPart - 1) / kRowsPerPart;
  io::FirstError error;
#pragma omp parallel for schedule(static)
  for (std::int64_t part = 0; part < parts; ++part) {
    error.guard([&] {
      const std::int64_t first = part * kRowsPerPart;
      run(part, first, std::min(kRowsPerPart, rows - first));
    });
  }
  error.rethrow();
}

/// A part of a group of rows.
struct RowPart {
  std::size_t group;
  std::int64_t first, count;
};

/// Two sums for every channel and part of the rows.
struct PartSums {
  int channels;
  std::vector<RowPart> parts;
  ChannelValues first, second;  // [part][channel]

  PartSums(const Tensor& x, const RowBounds& groups) : channels(x.shape().c) {
    for (std::size_t group = 0; group + 1 < groups.size(); ++group) {
      for (std::int64_t row = groups[group]; row < groups[group + 1]; row += kRowsPerPart) {
        parts.push_back({group, row, std::min(kRowsPerPart, groups[group + 1] - row)});
      }
    }
    first.resize(parts.size() * channels);
    second.resize(parts.size() * channels);
  }

  /// Calls run(part, its first sums, its second sums) for all parts, in parallel.
  template <class Run>
  void compute(const Run& run) {
    // nothing throws
#pragma omp parallel for schedule(static) if (parts.size() > 1)
    for (std::size_t i = 0; i < parts.size(); ++i) {
      run(parts[i], &first[i * channels], &second[i * channels]);
    }
  }
};

ChannelRows rows_at(std::int64_t row, std::int64_t rows, const Tensor& x, const Tensor* dy,
                    const ChannelStatistics* statistics, const ChannelAffine* affine) {
  const int channels = x.shape().c;
  ChannelRows in{.x = x.data() + row * channels, .rows = rows, .channels = channels};
  if (dy != nullptr) in.dy = dy->data() + row * channels;
  if (statistics != nullptr) {
    in.mean = statistics->mean.data();
    in.inv_std = statistics->inv_std.data();
  }
  if (affine != nullptr) {
    in.scale = affine->scale.data();
    in.shift = affine->shift.data();
    in.relu = affine->relu;
  }
  return in;
}

}  // namespace

void merge_moments(double before, double count, double other_mean, double other_squares,
                   double& mean, double& squares) {
  // Chan, Golub & LeVeque, "Updating Formulae and a Pairwise Algorithm for Computing Sample
  // Variances", 1979.
  const double total = before + count;
  if (total == 0) return;
  const double step = other_mean - mean;
  mean += step * (count / total);
  squares += other_squares + step * step * (before * count / total);
}

std::vector<ChannelMoments> channel_moments(const Tensor& x, const RowBounds& groups) {
  PartSums sums(x, groups);
  sums.compute([&](const RowPart& part, double* mean, double* squares) {
    HWY_DYNAMIC_DISPATCH(MomentsOfRows)
    (rows_at(part.first, part.count, x, nullptr, nullptr, nullptr), mean, squares);
  });
  const int channels = sums.channels;
  std::vector<ChannelMoments> moments(groups.size() - 1,
                                      {ChannelValues(channels), ChannelValues(channels)});
  for (std::size_t i = 0; i < sums.parts.size(); ++i) {
    const RowPart& part = sums.parts[i];
    ChannelMoments& group = moments[part.group];
    const auto before = static_cast<double>(part.first - groups[part.group]);
    for (int c = 0; c < channels; ++c) {
      merge_moments(before, static_cast<double>(part.count), sums.first[i * channels + c],
                    sums.second[i * channels + c], group.mean[c], group.squares[c]);
    }
  }
  return moments;
}

void channel_affine(const Tensor& x, const ChannelAffine& affine, Tensor& y) {
  y.resize(x.shape());
  for_parts(rows_of(x), [&](std::int64_t, std::int64_t first, std::int64_t count) {
    HWY_DYNAMIC_DISPATCH(AffineOfRows)
    (rows_at(first, count, x, nullptr, nullptr, &affine), y.data() + first * x.shape().c);
  });
}

std::vector<ChannelGradientSums> channel_gradient_sums(const Tensor& x, const Tensor& dy,
                                                       const ChannelStatistics& statistics,
                                                       const ChannelAffine& affine,
                                                       const RowBounds& groups) {
  PartSums sums(x, groups);
  sums.compute([&](const RowPart& part, double* of_dy, double* of_dy_by_x) {
    HWY_DYNAMIC_DISPATCH(GradientSumsOfRows)
    (rows_at(part.first, part.count, x, &dy, &statistics, &affine), of_dy, of_dy_by_x);
  });
  const int channels = sums.channels;
  std::vector<ChannelGradientSums> result(groups.size() - 1,
                                          {ChannelValues(channels), ChannelValues(channels)});
  for (std::size_t i = 0; i < sums.parts.size(); ++i) {
    ChannelGradientSums& group = result[sums.parts[i].group];
    for (int c = 0; c < channels; ++c) {
      group.dy[c] += sums.first[i * channels + c];
      group.dy_by_x[c] += sums.second[i * channels + c];
    }
  }
  return result;
}

void channel_input_gradient(const Tensor& x, const Tensor& dy, const ChannelStatistics& statistics,
                            const ChannelAffine& affine, const ChannelGradientSums& sums,
                            double rows, Tensor& dx) {
  dx.resize(x.shape());
  ChannelGradientSums mean = sums;
  for (double& value : mean.dy) value /= rows;
  for (double& value : mean.dy_by_x) value /= rows;
  for_parts(rows_of(x), [&](std::int64_t, std::int64_t first, std::int64_t count) {
    HWY_DYNAMIC_DISPATCH(InputGradientOfRows)
    (rows_at(first, count, x, &dy, &statistics, &affine), mean.dy.data(), mean.dy_by_x.data(),
     dx.data() + first * x.shape().c);
  });
}

}  // namespace sdmt::nn
#endif

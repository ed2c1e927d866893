// SPDX-License-Identifier: Apache-2.0
// Reading input tiles out of an image, for the convolution and its weight gradient. Included like
// micro_kernel-inl.h.
#if defined(SDMT_NN_WINOGRAD_TILE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SDMT_NN_WINOGRAD_TILE_INL_H_
#undef SDMT_NN_WINOGRAD_TILE_INL_H_
#else
#define SDMT_NN_WINOGRAD_TILE_INL_H_
#endif

#include <algorithm>

#include "kernels/winograd_geometry.h"
#include "kernels/winograd_transform-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

/// Floats from one position to the next in a block of `slots` tiles of `vectors` vectors of
/// channels: an odd number of vectors, so that the positions fall into different sets of the
/// caches.
HWY_INLINE std::ptrdiff_t PositionStep(int vectors, std::int64_t slots) {
  return static_cast<std::ptrdiff_t>((vectors * slots) | 1) * kLanes;
}

HWY_INLINE int VectorsOf(int channels) { return (channels + kLanes - 1) / kLanes; }

/// Rows of an image: row i at data + (i - first) * width * channels.
struct ImageRows {
  const float* data;
  int first;
  int channels;
};

/// Transforms input tile `tile`, whose image is given, into column `slot` of a block of `slots`
/// tiles: the vector `chunk` of channels of position p goes to
/// v[p * step + (chunk * slots + slot) * kLanes]. `zeros` holds a row of zero pixels.
template <int kHeight, int kWidth>
HWY_NOINLINE void TransformInputTile(const ImageRows& image, const WinogradTiles& tiles,
                                     std::int64_t tile, int slots, int slot, const float* zeros,
                                     float* v, std::ptrdiff_t step) {
  const FloatTag d;
  const int channels = image.channels;
  const WinogradTiles::Place place = tiles.place(tile);
  InputTile<kHeight> input;
  input.pixel = channels;
  const WinogradTiles::Place following = tiles.place(tile + 1);
  input.ahead =
      ((std::ptrdiff_t{following.image - place.image} * tiles.height + following.top - place.top) *
           tiles.width +
       following.left - place.left) *
      channels;
  input.begin = std::max(0, 1 - place.left);
  input.end = std::min(kWidth + 2, tiles.width + 1 - place.left);
  for (int i = 0; i < kHeight + 2; ++i) {
    const int row = place.top - 1 + i;
    input.rows[i] =
        row < 0 || row >= tiles.height
            ? zeros
            : image.data +
                  (std::ptrdiff_t{row - image.first} * tiles.width + place.left - 1) * channels;
  }
  float* to = v + static_cast<std::ptrdiff_t>(slot) * kLanes;
  const std::ptrdiff_t chunk_step = static_cast<std::ptrdiff_t>(slots) * kLanes;
  int channel = 0;
  for (; channel + kLanes <= channels; channel += kLanes, to += chunk_step) {
    const bool more = channel + kLanes < channels;
    const std::ptrdiff_t next = more ? chunk_step : v + (std::ptrdiff_t{slot} + 1) * kLanes - to;
    TransformInput<kHeight, kWidth>(input, to, step, next);
    for (const float*& row : input.rows) row += kLanes;
  }
  if (channel == channels) return;
  // The last channels do not fill a vector: from a copy with zeros in the other lanes.
  alignas(64) float pixels[kHeight + 2][kWidth + 2][kLanes];
  for (int i = 0; i < kHeight + 2; ++i) {
    for (int j = 0; j < kWidth + 2; ++j) {
      const bool inside = j >= input.begin && j < input.end;
      const float* from = input.rows[i] + static_cast<std::ptrdiff_t>(j) * channels;
      hn::Store(inside ? LoadSome(from, channels - channel) : hn::Zero(d), d, pixels[i][j]);
    }
    input.rows[i] = pixels[i][0];
  }
  input.pixel = kLanes;
  input.ahead = 0;
  input.begin = 0;
  input.end = kWidth + 2;
  TransformInput<kHeight, kWidth>(input, to, step, 0);
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#endif

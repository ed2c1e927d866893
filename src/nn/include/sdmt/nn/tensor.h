// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace sdmt::nn {

/// Extent of a tensor, channels last: n images of h rows, w columns and c channels. A matrix of
/// n rows and c columns is {n, 1, 1, c}. Extents are >= 0; size() == 0 means empty.
struct Shape {
  int n = 0;
  int h = 1;
  int w = 1;
  int c = 1;

  /// Number of values; computed in 64 bits.
  std::size_t size() const;
  /// Values of one image, h*w*c.
  std::size_t image_size() const;
  /// "[n,h,w,c]", for messages.
  std::string str() const;

  bool operator==(const Shape&) const = default;
};

/// A dense float32 array in NHWC order (the channel varies fastest) that owns its memory.
/// The memory starts at a 64-byte boundary.
class Tensor {
 public:
  Tensor() = default;
  /// Zero-filled. Throws std::invalid_argument for a negative extent.
  explicit Tensor(Shape shape);

  const Shape& shape() const { return shape_; }
  std::size_t size() const { return shape_.size(); }
  bool empty() const { return size() == 0; }

  float* data() { return data_; }
  const float* data() const { return data_; }
  std::span<float> values() { return {data_, size()}; }
  std::span<const float> values() const { return {data_, size()}; }

  /// First value of image i, 0 <= i < shape().n.
  float* image(int i) { return data_ + static_cast<std::size_t>(i) * shape_.image_size(); }
  const float* image(int i) const {
    return data_ + static_cast<std::size_t>(i) * shape_.image_size();
  }

  /// Changes the shape. The memory is kept when it is large enough, so that resizing to a size seen
  /// before never allocates; the values are then unspecified. Throws as the constructor does.
  void resize(Shape shape);

  void fill(float value);

  /// Images [first, first + count) of this tensor without copying them: the memory stays this
  /// tensor's, which must outlive the result and not be resized meanwhile. Resizing the result to
  /// more than it holds gives it memory of its own.
  Tensor images(int first, int count);
  const Tensor images(int first, int count) const;

  Tensor(const Tensor& other);
  Tensor& operator=(const Tensor& other);
  Tensor(Tensor&& other) noexcept;
  Tensor& operator=(Tensor&& other) noexcept;
  ~Tensor() = default;

 private:
  Shape shape_;
  std::vector<float> storage_;  // 15 floats longer than needed, to reach the boundary
  std::size_t capacity_ = 0;    // values that fit at data_
  float* data_ = nullptr;
};

}  // namespace sdmt::nn

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/tensor.h"

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <utility>

namespace sdmt::nn {

namespace {

constexpr std::size_t kAlignment = 64;
constexpr std::size_t kSlack = kAlignment / sizeof(float) - 1;

float* aligned(float* p) {
  const auto address = reinterpret_cast<std::uintptr_t>(p);
  return p + (kAlignment - address % kAlignment) % kAlignment / sizeof(float);
}

}  // namespace

std::size_t Shape::size() const { return static_cast<std::size_t>(n) * image_size(); }

std::size_t Shape::image_size() const {
  return static_cast<std::size_t>(h) * static_cast<std::size_t>(w) * static_cast<std::size_t>(c);
}

std::string Shape::str() const {
  return "[" + std::to_string(n) + "," + std::to_string(h) + "," + std::to_string(w) + "," +
         std::to_string(c) + "]";
}

Tensor::Tensor(Shape shape) {
  resize(shape);
  fill(0.0F);
}

void Tensor::resize(Shape shape) {
  if (shape.n < 0 || shape.h < 0 || shape.w < 0 || shape.c < 0) {
    throw std::invalid_argument("tensor shape " + shape.str() + " has a negative extent");
  }
  if (shape.size() > capacity_ || data_ == nullptr) {
    storage_ = std::vector<float>();  // free first: the old values are not kept
    storage_.resize(shape.size() + kSlack);
    data_ = aligned(storage_.data());
    capacity_ = shape.size();
  }
  shape_ = shape;
}

void Tensor::fill(float value) { std::fill_n(data_, size(), value); }

Tensor Tensor::images(int first, int count) {
  Tensor view;
  view.shape_ = shape_;
  view.shape_.n = count;
  view.capacity_ = view.shape_.size();
  view.data_ = image(first);
  return view;
}

const Tensor Tensor::images(int first, int count) const {
  return const_cast<Tensor*>(this)->images(first, count);  // the result is const again
}

Tensor::Tensor(const Tensor& other) { *this = other; }

Tensor& Tensor::operator=(const Tensor& other) {
  if (this != &other) {
    resize(other.shape_);
    std::copy_n(other.data_, size(), data_);
  }
  return *this;
}

Tensor::Tensor(Tensor&& other) noexcept { *this = std::move(other); }

Tensor& Tensor::operator=(Tensor&& other) noexcept {
  // Moving a vector keeps its buffer, so the aligned pointer into it stays valid.
  std::swap(shape_, other.shape_);
  std::swap(storage_, other.storage_);
  std::swap(capacity_, other.capacity_);
  std::swap(data_, other.data_);
  return *this;
}

}  // namespace sdmt::nn

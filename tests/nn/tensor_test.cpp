// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/tensor.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <stdexcept>
#include <utility>

namespace sdmt::nn {
namespace {

TEST(Tensor, StartsAtACacheLineAndIsZero) {
  for (const int c : {1, 3, 17, 64}) {
    const Tensor t(Shape{2, 3, 5, c});
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(t.data()) % 64, 0U);
    for (const float v : t.values()) EXPECT_EQ(v, 0.0F);
  }
}

TEST(Tensor, CopyIsDeepAndMoveKeepsTheMemory) {
  Tensor a(Shape{1, 2, 2, 3});
  a.fill(2.0F);
  Tensor b = a;
  b.fill(3.0F);
  EXPECT_EQ(a.values()[5], 2.0F);
  const float* memory = b.data();
  const Tensor c = std::move(b);
  EXPECT_EQ(c.data(), memory);
  EXPECT_EQ(c.shape(), (Shape{1, 2, 2, 3}));
}

TEST(Tensor, ShrinkingAndGrowingBackDoesNotAllocate) {
  Tensor t(Shape{8, 4, 4, 4});
  const float* memory = t.data();
  t.resize(Shape{1, 4, 4, 4});
  t.resize(Shape{8, 4, 4, 4});
  EXPECT_EQ(t.data(), memory);
}

TEST(Tensor, ImagesShareTheMemoryUntilTheyGrow) {
  Tensor all(Shape{4, 1, 2, 3});
  Tensor middle = all.images(1, 2);
  EXPECT_EQ(middle.shape(), (Shape{2, 1, 2, 3}));
  middle.fill(5.0F);
  EXPECT_EQ(all.image(1)[0], 5.0F);
  EXPECT_EQ(all.image(2)[5], 5.0F);
  EXPECT_EQ(all.image(3)[0], 0.0F);
  middle.resize(Shape{1, 1, 2, 3});
  EXPECT_EQ(middle.data(), all.image(1));
  middle.resize(Shape{9, 1, 2, 3});
  EXPECT_NE(middle.data(), all.image(1));
  const Tensor copy = all.images(0, 2);
  EXPECT_EQ(copy.image(1)[0], 5.0F);
}

TEST(Tensor, RefusesNegativeExtents) {
  EXPECT_THROW(Tensor(Shape{1, -2, 3, 4}), std::invalid_argument);
}

TEST(Shape, SizeDoesNotOverflowInThirtyTwoBits) {
  EXPECT_EQ((Shape{65536, 256, 256, 2}).size(), std::size_t{8589934592});
}

}  // namespace
}  // namespace sdmt::nn

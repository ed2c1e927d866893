// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/box.h"

#include <gtest/gtest.h>

namespace sdmt::mot {
namespace {

TEST(Iou, HandComputed) {
  const Tlwh a{0, 0, 10, 10};
  EXPECT_DOUBLE_EQ(iou(a, a), 1.0);
  EXPECT_DOUBLE_EQ(iou(a, Tlwh{5, 0, 10, 10}), 50.0 / 150.0);
  EXPECT_DOUBLE_EQ(iou(a, Tlwh{2, 2, 5, 5}), 0.25);
  EXPECT_DOUBLE_EQ(iou(a, Tlwh{10, 0, 10, 10}), 0.0);
  EXPECT_DOUBLE_EQ(iou(a, Tlwh{20, 20, 1, 1}), 0.0);
}

TEST(Iou, BoxesWithoutExtentOverlapNothing) {
  const Tlwh a{0, 0, 10, 10};
  EXPECT_EQ(iou(a, Tlwh{5, 5, 0, 10}), 0.0);
  EXPECT_EQ(iou(a, Tlwh{5, 5, -3, 10}), 0.0);
  EXPECT_EQ(iou(Tlwh{}, Tlwh{}), 0.0);
}

TEST(Box, ConversionsAreInverse) {
  const Tlwh box{1.5, -2.25, 30, 70};
  EXPECT_EQ(to_tlwh(to_cxcywh(box)), box);
}

}  // namespace
}  // namespace sdmt::mot

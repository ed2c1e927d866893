// SPDX-License-Identifier: Apache-2.0
#include <sdmt/mot/assignment.h>
#include <sdmt/mot/box.h>

#include <cstdio>
#include <vector>

int main() {
  const sdmt::mot::Tlwh box{1, 1, 10, 10};
  const std::vector<sdmt::mot::AssignmentEdge> edges{{0, 1, sdmt::mot::iou(box, box)}};
  std::printf("column %d\n",
              static_cast<int>(sdmt::mot::maximum_weight_assignment(1, 2, edges)[0]));
}

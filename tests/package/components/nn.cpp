// SPDX-License-Identifier: Apache-2.0
#include <sdmt/nn/conv2d.h>

#include <cstdio>

int main() {
  sdmt::nn::Conv2d convolution({.in_channels = 3, .out_channels = 4});
  std::puts("a layer");
}

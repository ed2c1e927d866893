// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sdmt/reid/network_description.h"

namespace sdmt::reid {

/// The network of the paper's table 1: VGG-16's conv1_1 to conv3_3 with their ReLUs and the first
/// two poolings ([n,128,64,3] -> [n,32,16,256]), a fully connected layer to 128, ReLU, another to
/// 128, batch normalisation and the projection to the unit sphere. Files have torchvision's names
/// for the trunk. height and width: multiples of 4.
NetworkDescription vgg16(int height = 128, int width = 64);

/// A small network, 0.21 GFLOP a patch where vgg16 has 3.1, for learning from a larger one: nine
/// 3x3 convolutions with batch normalisation, the first with stride 2, to a map of 8 x 4 x 192. The
/// map is averaged over four stripes from head to foot (Sun et al., "Beyond Part Models", ECCV
/// 2018), which go to 192 numbers. height: a multiple of 32; width: of 64.
NetworkDescription lite(int height = 128, int width = 64);

/// An architecture by its name, "vgg16" or "lite", or from a file of JSON text (see
/// parse_network_description()), whose name contains a '.' or a '/'. Throws std::invalid_argument
/// when there is none or the description is not valid.
NetworkDescription find_architecture(const std::string& name_or_file);

}  // namespace sdmt::reid

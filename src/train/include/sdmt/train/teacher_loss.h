// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace sdmt::train {

/// What a network learns from the vectors that a teacher, another network, made of the same images
/// (distillation; Hinton, Vinyals & Dean, 2015).
enum class TeacherMatch {
  /// The teacher's vector itself: mean over the images of |e - t|^2 (from 0, learnt, over 2,
  /// unrelated, to 4). A teacher of more dimensions is projected to its principal axes first.
  projection,
  /// How images relate: mean over the pairs of different images of (e_i e_j - t_i t_j)^2, for
  /// teachers of any dimensions (Park et al., Relational knowledge distillation, CVPR 2019).
  relations,
  /// Which of the teacher's rows a vector resembles: mean over the images of the Kullback-Leibler
  /// divergence of softmax_j(e_i t_j / 0.1) from softmax_j(t_i t_j / 0.1) (from 0, learnt; Fang et
  /// al., SEED, ICLR 2021, with the batch for its queue). A vector in the middle of all, which a
  /// squared distance likes where an image leaves a doubt, resembles nobody here. A teacher of more
  /// dimensions is projected as above.
  similarities
};

/// Loss of a batch of `images` embeddings against the teacher's rows of the same images, all of
/// length 1; adds `weight` times its derivative by the embeddings to `gradient`. Returns the loss
/// without the weight. Both arrays hold one row an image; projection and similarities need rows
/// of equal length, relations two images. The same for any number of threads. T is float or double.
/// Throws std::invalid_argument when the sizes do not fit together.
template <typename T>
double teacher_loss(std::span<const T> embeddings, std::span<const T> teacher, int images,
                    TeacherMatch match, double weight, std::span<T> gradient);

}  // namespace sdmt::train

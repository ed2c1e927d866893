// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/optimizer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "sdmt/nn/adam.h"
#include "sdmt/nn/clip_grad_norm.h"
#include "sdmt/nn/learning_rate_schedule.h"
#include "sdmt/nn/sgd.h"

namespace sdmt::nn {
namespace {

Parameter make(float value, float gradient) {
  Parameter parameter;
  parameter.value = Tensor({1, 1, 1, 3});
  parameter.value.fill(value);
  parameter.grad = Tensor({1, 1, 1, 3});
  parameter.grad.fill(gradient);
  return parameter;
}

TEST(Sgd, FollowsItsEquations) {
  Parameter decayed = make(2.0F, 1.0F);
  Parameter plain = make(2.0F, 1.0F);
  plain.decay = false;
  plain.lr_scale = 0.1F;
  Sgd sgd({{"a", &decayed}, {"b", &plain}},
          {.learning_rate = 0.5, .momentum = 0.9, .weight_decay = 0.25});
  sgd.step();  // a: velocity 1.5; b: velocity 1
  EXPECT_FLOAT_EQ(decayed.value.data()[0], 2.0F - 0.5F * 1.5F);
  EXPECT_FLOAT_EQ(plain.value.data()[2], 2.0F - 0.05F);
  sgd.step();  // a: 0.9 * 1.5 + 1 + 0.25 * 1.25; b: 1.9
  EXPECT_FLOAT_EQ(decayed.value.data()[0], 1.25F - 0.5F * (1.35F + 1.0F + 0.3125F));
  EXPECT_FLOAT_EQ(plain.value.data()[2], 1.95F - 0.05F * 1.9F);
}

TEST(Adam, FirstStepHasTheLengthOfTheLearningRate) {
  Parameter parameter = make(1.0F, -0.003F);
  Adam adam({{"a", &parameter}}, {.learning_rate = 0.01});
  adam.step();
  EXPECT_NEAR(parameter.value.data()[0], 1.01F, 1e-6);
}

TEST(Optimizer, LeavesFrozenAndUntouchedParametersAlone) {
  Parameter frozen = make(1.0F, 1.0F);
  frozen.trainable = false;
  Parameter untouched;
  untouched.value = Tensor({1, 1, 1, 3});
  Adam adam({{"a", &frozen}, {"b", &untouched}}, {});
  adam.step();
  EXPECT_EQ(frozen.value.data()[0], 1.0F);
  EXPECT_EQ(untouched.value.data()[0], 0.0F);
  adam.zero_grad();
  EXPECT_EQ(frozen.grad.data()[1], 0.0F);
}

template <typename Kind>
void expect_resumes_exactly(const auto& options) {
  const auto run = [&](int stop) {
    Parameter parameter = make(1.0F, 0.0F);
    std::vector<NamedParameter> names{{"a", &parameter}};
    std::vector<Tensor> saved;
    Tensor value;
    const auto advance = [&](Kind& optimizer, int from, int to) {
      for (int i = from; i < to; ++i) {
        parameter.grad.fill(std::sin(static_cast<float>(i)));
        optimizer.step();
      }
    };
    Kind first(names, options);
    advance(first, 0, stop);
    for (const NamedTensor& state : first.state()) saved.push_back(*state.tensor);
    Kind second(names, options);
    const auto states = second.state();
    for (std::size_t i = 0; i < states.size(); ++i) *states[i].tensor = saved[i];
    advance(second, stop, 9);
    return parameter.value.data()[1];
  };
  const float expected = run(0);
  EXPECT_NE(expected, 1.0F);
  for (const int stop : {1, 4, 8}) EXPECT_EQ(run(stop), expected);
}

TEST(Optimizer, StateIsEverythingThatDecidesTheNextSteps) {
  expect_resumes_exactly<Sgd>(SgdOptions{.learning_rate = 0.1, .weight_decay = 0.1});
  expect_resumes_exactly<Adam>(AdamOptions{.learning_rate = 0.1, .weight_decay = 0.1});
}

TEST(Optimizer, NamesItsState) {
  Parameter parameter = make(1.0F, 0.0F);
  Adam adam({{"conv.weight", &parameter}}, {});
  const auto state = adam.state();
  ASSERT_EQ(state.size(), 3U);
  EXPECT_EQ(state[0].name, "conv.weight.exp_avg");
  EXPECT_EQ(state[1].name, "conv.weight.exp_avg_sq");
  EXPECT_EQ(state[2].name, "conv.weight.step");
}

TEST(Optimizer, RefusesImpossibleOptions) {
  EXPECT_THROW(Adam({}, {.beta1 = 1.0}), std::invalid_argument);
  EXPECT_THROW(Adam({}, {.eps = 0.0}), std::invalid_argument);
  EXPECT_THROW(Adam({}, {.learning_rate = -1.0}), std::invalid_argument);
  EXPECT_THROW(Sgd({}, {.momentum = -0.1}), std::invalid_argument);
  Sgd sgd({}, {});
  EXPECT_THROW(sgd.set_learning_rate(std::numeric_limits<double>::quiet_NaN()),
               std::invalid_argument);
}

TEST(ClipGradNorm, ScalesToTheBoundAndReturnsTheNormBefore) {
  Parameter a = make(0.0F, 2.0F);
  Parameter b = make(0.0F, 1.0F);
  Parameter frozen = make(0.0F, 100.0F);
  frozen.trainable = false;
  const std::vector<NamedParameter> all{{"a", &a}, {"b", &b}, {"c", &frozen}};
  const double norm = std::sqrt(15.0);
  EXPECT_NEAR(clip_grad_norm(all, 100.0), norm, 1e-12);
  EXPECT_EQ(a.grad.data()[0], 2.0F);
  EXPECT_NEAR(clip_grad_norm(all, 1.0), norm, 1e-12);
  EXPECT_NEAR(a.grad.data()[0], 2.0 / norm, 1e-6);
  EXPECT_NEAR(clip_grad_norm(all, 10.0), 1.0, 1e-6);
  EXPECT_EQ(frozen.grad.data()[0], 100.0F);
  EXPECT_THROW(clip_grad_norm(all, 0.0), std::invalid_argument);
  a.grad.data()[0] = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(std::isfinite(clip_grad_norm(all, 1.0)));
  EXPECT_NEAR(b.grad.data()[0], 1.0 / norm, 1e-6);
}

TEST(LearningRateSchedule, WarmsUpStaysAndFalls) {
  LearningRateScheduleOptions options{.learning_rate = 2.0,
                                      .iterations = 100,
                                      .warmup_iterations = 10,
                                      .decay = LearningRateDecay::exponential,
                                      .decay_start = 0.5,
                                      .final_factor = 0.01};
  const LearningRateSchedule exponential(options);
  EXPECT_DOUBLE_EQ(exponential.at(0), 0.2);
  EXPECT_DOUBLE_EQ(exponential.at(4), 1.0);
  EXPECT_DOUBLE_EQ(exponential.at(9), 2.0);
  EXPECT_DOUBLE_EQ(exponential.at(50), 2.0);
  EXPECT_NEAR(exponential.at(75), 0.2, 1e-12);
  EXPECT_NEAR(exponential.at(100), 0.02, 1e-12);
  options.decay = LearningRateDecay::cosine;
  const LearningRateSchedule cosine(options);
  EXPECT_NEAR(cosine.at(75), 2.0 * (0.01 + 0.99 / 2.0), 1e-12);
  EXPECT_NEAR(cosine.at(100), 0.02, 1e-12);
  options.decay = LearningRateDecay::constant;
  EXPECT_DOUBLE_EQ(LearningRateSchedule(options).at(99), 2.0);
  options.decay_start = 1.5;
  EXPECT_THROW(LearningRateSchedule{options}, std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::nn

// SPDX-License-Identifier: Apache-2.0
// Training of networks other than the paper's.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "reid/temporary_data.h"
#include "sdmt/nn/sequential.h"
#include "sdmt/train/trainer.h"

namespace sdmt::train {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class LiteTraining : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    threads_ = omp_get_max_threads();
    omp_set_num_threads(1);
    data_ = std::make_unique<reid::TemporaryData>();
    data_->write_people(9, 4);
  }
  static void TearDownTestSuite() {
    data_.reset();
    omp_set_num_threads(threads_);
  }

  static TrainerOptions options(std::int64_t iterations, const std::string& first_trained = {}) {
    TrainerOptions options;
    options.iterations = iterations;
    options.identities = 4;
    options.instances = 3;
    options.first_trained = first_trained;
    options.tie = std::nullopt;
    options.views = 2;
    options.trunk_lr_scale = 1;
    options.warmup_iterations = 2;
    options.validate_every = 3;
    return options;
  }

  // Trains a small lite to `until` steps and returns the bytes of the model when finished.
  struct Outcome {
    std::string bytes;
    std::vector<double> losses;
  };
  static Outcome train(const TrainerOptions& options, std::int64_t until = 1000,
                       const fs::path& save = {}, const fs::path& resume = {}) {
    const reid::TemporaryData out;
    reid::Model model = reid::untrained_model(reid::lite(32, 64), 1);
    TrainingSetOptions set;
    set.folders = {data_->path()};
    set.holdout_identities = 3;
    Trainer trainer(model, load_training_set(set), options);
    trainer.prepare({});
    if (!resume.empty()) trainer.load_checkpoint(resume);
    Outcome outcome;
    while (!trainer.finished() && trainer.iteration() < until) {
      outcome.losses.push_back(trainer.step().loss);
      if (trainer.validation_due()) trainer.validate();
    }
    if (!save.empty()) trainer.save_checkpoint(save);
    if (!trainer.finished()) return outcome;
    trainer.finish();
    reid::save_model(out.path() / "model", model);
    std::ifstream file(out.path() / "model", std::ios::binary);
    outcome.bytes = {std::istreambuf_iterator<char>(file), {}};
    return outcome;
  }

  static std::unique_ptr<reid::TemporaryData> data_;
  static int threads_;
};

std::unique_ptr<reid::TemporaryData> LiteTraining::data_;
int LiteTraining::threads_ = 1;

TEST_F(LiteTraining, LearnsFromNothing) {
  const auto losses = train(options(30)).losses;
  const auto mean = [&losses](std::size_t from) {
    double sum = 0;
    for (std::size_t i = from; i < from + 5; ++i) sum += losses[i];
    return sum / 5;
  };
  EXPECT_LT(mean(25), 0.8 * mean(0));
}

// With running statistics in the trained trunk, in the frozen one, and in neither.
TEST_F(LiteTraining, ResumedItEndsInTheSameBytes) {
  const reid::TemporaryData out;
  const auto checkpoint = out.path() / "checkpoint";
  for (const char* first_trained : {"", "relu1_1", "bn3_1", "conv4_2", "fc"}) {
    const std::string whole = train(options(8, first_trained)).bytes;
    train(options(8, first_trained), 5, checkpoint);
    EXPECT_EQ(train(options(8, first_trained), 1000, {}, checkpoint).bytes, whole) << first_trained;
    EXPECT_EQ(reid::load_model(checkpoint).metadata.architecture, "lite");
  }
}

TEST_F(LiteTraining, FrozenStatisticsStay) {
  const reid::Model untouched = reid::untrained_model(reid::lite(32, 64), 1);
  const reid::TemporaryData out;
  std::ofstream(out.path() / "model", std::ios::binary) << train(options(6, "bn3_1")).bytes;
  const reid::Model trained = reid::load_model(out.path() / "model");
  bool frozen = true;
  for (std::size_t i = 0; i < trained.network.state().size(); ++i) {
    const auto& tensor = trained.network.state()[i];
    const auto& layer =
        trained.network.description().layers[static_cast<std::size_t>(tensor.layer)];
    if (layer.name == "bn3_1") frozen = false;
    const auto before = untouched.network.state()[i].value->values();
    const auto after = tensor.value->values();
    EXPECT_EQ(std::equal(before.begin(), before.end(), after.begin()), frozen)
        << layer.tensor_name(tensor.parameter);
  }
}

TEST_F(LiteTraining, TiesWhereTheMapHasTheGrid) {
  TrainerOptions tied = options(30);
  tied.tie = BlockGrid{1, 1};  // the stripes of a 32 x 64 patch
  const auto losses = train(tied).losses;
  EXPECT_LT(losses.back(), losses.front());
  tied.tie = BlockGrid{8, 2};
  try {
    train(tied);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(),
                 "tie is 8x2, expected rows x columns that divide the map of 1x1, or none");
  }
}

TEST_F(LiteTraining, AnUnknownLayerIsRefused) {
  try {
    train(options(3, "conv9"));
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("conv9"));
  }
}

}  // namespace
}  // namespace sdmt::train

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/trainer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>

#include "reid/temporary_data.h"
#include "sdmt/io/safetensors.h"
#include "sdmt/nn/sequential.h"
#include "sdmt/train/training_log.h"
#include "train/training_fixture.h"

namespace sdmt::train {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

class TrainerTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    threads_ = omp_get_max_threads();
    omp_set_num_threads(1);  // these layers are too small to share; on a busy machine it costs
    data_ = std::make_unique<reid::TemporaryData>();
    data_->write_people(9, 4);
  }
  static void TearDownTestSuite() {
    data_.reset();
    omp_set_num_threads(threads_);
  }

  static TrainingSet training_set() {
    TrainingSetOptions options;
    options.folders = {data_->path()};
    options.holdout_identities = 3;
    return load_training_set(options);
  }

  static Outcome train(const TrainerOptions& options, std::int64_t until = 1000,
                       const fs::path& save = {}, const fs::path& resume = {},
                       const fs::path& cache = {}) {
    return train_set(training_set(), options, until, save, resume, cache);
  }

  static std::unique_ptr<reid::TemporaryData> data_;
  static int threads_;
};

std::unique_ptr<reid::TemporaryData> TrainerTest::data_;
int TrainerTest::threads_ = 1;

TEST_F(TrainerTest, LearnsToTellPeopleApart) {
  for (const char* first_trained : {"fc1", "conv1_1"}) {
    TrainerOptions options = small_options(first_trained);
    options.iterations = 30;
    const Outcome outcome = train(options);
    ASSERT_EQ(outcome.losses.size(), 30u);
    const auto mean = [&](std::size_t from, std::size_t to) {
      double sum = 0;
      for (std::size_t i = from; i < to; ++i) sum += outcome.losses[i];
      return sum / static_cast<double>(to - from);
    };
    EXPECT_LT(mean(25, 30), 0.8 * mean(0, 5)) << first_trained;
    EXPECT_GT(outcome.validation.mean_auc, 0.95) << first_trained;
    EXPECT_FALSE(outcome.bytes.empty());
  }
}

TEST_F(TrainerTest, ResumedItEndsInTheSameBytes) {
  const reid::TemporaryData out;
  const auto checkpoint = out.path() / "checkpoint";
  TrainerOptions frozen = small_options("fc1"), fine_tuned = small_options("conv3_1"),
                 live = small_options("conv1_1"), frozen_live = small_options("fc1");
  fine_tuned.tie = std::nullopt;
  live.optimizer = OptimizerKind::sgd;
  frozen_live.views = 0;
  for (const TrainerOptions& options : {frozen, fine_tuned, live, frozen_live}) {
    const std::string whole = train(options).bytes;
    train(options, 5, checkpoint);
    EXPECT_EQ(train(options, 1000, {}, checkpoint).bytes, whole)
        << options.first_trained << " " << options.views;
  }
}

TEST_F(TrainerTest, ThreadsDoNotChangeTheResult) {
  for (const char* first_trained : {"fc1", "conv1_1"}) {
    TrainerOptions options = small_options(first_trained);
    options.iterations = 3;
    const std::string one = train(options).bytes;
    omp_set_num_threads(2);
    EXPECT_EQ(train(options).bytes, one);
    omp_set_num_threads(1);
  }
}

TEST_F(TrainerTest, SeedsAndOptionsChangeTheResult) {
  const TrainerOptions options = small_options("fc1");
  const std::string bytes = train(options).bytes;
  EXPECT_EQ(train(options).bytes, bytes);
  TrainerOptions other = options;
  other.seed = 1;
  EXPECT_NE(train(other).bytes, bytes);
  other = options;
  other.optimizer = OptimizerKind::sgd;
  EXPECT_NE(train(other).bytes, bytes);
  other = options;
  other.clip_norm = 1e-3;
  EXPECT_NE(train(other).bytes, bytes);
}

TEST_F(TrainerTest, FrozenLayersStayAsTheyWere) {
  const reid::Model untouched = small_model();
  reid::Model model = small_model();
  TrainerOptions options = small_options("conv3_1");
  Trainer trainer(model, training_set(), options);
  trainer.prepare({});
  while (!trainer.finished()) trainer.step();
  trainer.validate();
  trainer.finish();
  const auto before = stored_tensors(untouched.network), after = stored_tensors(model.network);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const bool same = std::equal(before[i].value->values().begin(), before[i].value->values().end(),
                                 after[i].value->values().begin());
    const bool frozen = before[i].name.starts_with("features.") && i < 8;  // conv1_1 .. conv2_2
    EXPECT_EQ(same, frozen) << before[i].name;
  }
  ASSERT_TRUE(model.metadata.training.has_value());
  EXPECT_EQ(model.metadata.training->iterations, 8);
  EXPECT_EQ(model.metadata.training->scores.size(), 1u);
  EXPECT_NO_THROW(model.metadata.validate());
}

TEST_F(TrainerTest, TheBestValidatedWeightsAreKept) {
  const reid::TemporaryData out;
  reid::Model model = small_model();
  TrainerOptions options = small_options("fc1");
  options.iterations = 30;
  Trainer trainer(model, training_set(), options);
  trainer.prepare({});
  double best = 0;
  std::int64_t best_iteration = 0;
  while (!trainer.finished()) {
    trainer.step();
    const Validation validation = trainer.validate();
    ASSERT_EQ(validation.best, validation.mean_auc > best);
    if (!validation.best) continue;
    best = validation.mean_auc;
    best_iteration = trainer.iteration();
    trainer.save_checkpoint(out.path() / "best");
  }
  ASSERT_LT(best_iteration, 30) << "the test needs people who are told apart sooner";
  trainer.finish();
  EXPECT_EQ(model.metadata.training->scores.begin()->second, best);
  EXPECT_EQ(model.metadata.training->iterations, best_iteration);
  const reid::Model kept = reid::load_model(out.path() / "best");
  const auto ours = stored_tensors(model.network), theirs = stored_tensors(kept.network);
  for (std::size_t i = 0; i < ours.size(); ++i) {
    EXPECT_TRUE(std::equal(ours[i].value->values().begin(), ours[i].value->values().end(),
                           theirs[i].value->values().begin()))
        << ours[i].name;
  }
}

TEST_F(TrainerTest, AFeatureCacheServesLaterRunsOfTheSameViews) {
  const reid::TemporaryData out;
  const auto file = out.path() / "features";
  const TrainerOptions options = small_options("conv3_1");
  const std::string bytes = train(options).bytes;
  EXPECT_EQ(train(options, 1000, {}, {}, file).bytes, bytes);
  ASSERT_TRUE(fs::exists(file));
  const auto written = fs::last_write_time(file);
  EXPECT_EQ(train(options, 1000, {}, {}, file).bytes, bytes);
  EXPECT_EQ(fs::last_write_time(file), written);
  TrainerOptions other = options;
  other.learning_rate = 0.1;
  EXPECT_NO_THROW(train(other, 1, {}, {}, file));
  other = options;
  other.augmentation.erase = 0.5;
  EXPECT_THAT(message_of([&] { train(other, 1, {}, {}, file); }),
              HasSubstr("features: made with erase = 0.3, this run has 0.5"));
}

TEST_F(TrainerTest, CachingCanBeStopped) {
  const reid::TemporaryData out;
  reid::Model model = small_model();
  Trainer trainer(model, training_set(), small_options("fc1"));
  EXPECT_EQ(trainer.cache_bytes(), 6u * 4 * 2 * (2 * 1 * 256) * 2);
  struct Stop {};
  EXPECT_THROW(trainer.prepare(
                   [](std::int64_t done, std::int64_t total) {
                     EXPECT_EQ(total, 6 * 4 * 2 + 3 * 4);
                     if (done > 30) throw Stop();
                   },
                   out.path() / "features"),
               Stop);
  EXPECT_TRUE(fs::is_empty(out.path()));
}

TEST_F(TrainerTest, ForeignCheckpointsAreRefusedByTheSettingThatDiffers) {
  const reid::TemporaryData out;
  const auto checkpoint = out.path() / "checkpoint";
  const TrainerOptions options = small_options("fc1");
  train(options, 3, checkpoint);
  const auto refusal = [&](const std::function<void(TrainerOptions&)>& change) {
    TrainerOptions other = options;
    change(other);
    return message_of([&] { train(other, 5, {}, checkpoint); });
  };
  EXPECT_EQ(refusal([](TrainerOptions&) {}), "no exception");
  EXPECT_THAT(refusal([](TrainerOptions& o) { o.identities = 3; }),
              HasSubstr("checkpoint: made with identities = 4, this run has 3"));
  EXPECT_THAT(refusal([](TrainerOptions& o) { o.learning_rate = 0.01; }),
              HasSubstr("made with learning_rate = 0.001, this run has 0.01"));
  EXPECT_THAT(refusal([](TrainerOptions& o) { o.iterations = 20; }), HasSubstr("iterations"));
  EXPECT_THAT(refusal([](TrainerOptions& o) { o.tie = std::nullopt; }),
              HasSubstr("made with tie = 2x1, this run has none"));
  EXPECT_THAT(refusal([](TrainerOptions& o) { o.first_trained = "conv3_1"; }),
              HasSubstr("made with first_trained = fc1"));
  EXPECT_THAT(refusal([](TrainerOptions& o) { o.augmentation.flip = 0; }),
              HasSubstr("made with flip = 0.5, this run has 0"));

  // A model is no checkpoint; half a checkpoint is none either.
  reid::Model model = small_model();
  reid::save_model(out.path() / "model", model);
  EXPECT_THAT(message_of([&] { train(options, 5, {}, out.path() / "model"); }),
              HasSubstr("is no training checkpoint"));
  const std::string bytes = read_file(checkpoint);
  out.write("half", bytes.substr(0, bytes.size() / 2));
  EXPECT_THAT(message_of([&] { train(options, 5, {}, out.path() / "half"); }), HasSubstr("half"));
}

// The file once more, the bytes of one tensor changed.
void write_changed(const fs::path& from, const fs::path& to, const std::string& tensor,
                   const std::function<void(std::vector<std::byte>&)>& change) {
  const io::Safetensors file(from);
  std::vector<std::vector<std::byte>> values;
  io::SafetensorsWriter writer;
  for (const auto& [key, text] : file.metadata()) writer.set_metadata(key, text);
  values.reserve(file.tensors().size());
  bool found = false;
  for (const auto& entry : file.tensors()) {
    auto& bytes = values.emplace_back(entry.count() * io::dtype_size(entry.dtype));
    file.read_bytes(entry, bytes);
    if (entry.name == tensor) change(bytes);
    found |= entry.name == tensor;
    writer.add_bytes(entry.name, entry.dtype, entry.shape, bytes);
  }
  ASSERT_TRUE(found) << tensor;
  writer.write(to);
}

template <typename T>
std::function<void(std::vector<std::byte>&)> put(std::size_t index, T value) {
  return [=](std::vector<std::byte>& bytes) {
    std::memcpy(bytes.data() + index * sizeof value, &value, sizeof value);
  };
}

TEST_F(TrainerTest, CheckpointsThatNoTrainingWroteAreRefused) {
  const reid::TemporaryData out;
  const auto checkpoint = out.path() / "checkpoint", damaged = out.path() / "damaged";
  const TrainerOptions options = small_options("fc1");
  train(options, 3, checkpoint);
  const auto refusal = [&](const std::string& tensor, const auto& change) {
    write_changed(checkpoint, damaged, "training." + tensor, change);
    return message_of([&] { train(options, 8, {}, damaged); });
  };
  for (const std::int64_t iteration : {-5L, -1L, 9L, 1'000'000'000'000L}) {
    EXPECT_THAT(
        refusal("progress", put(0, iteration)),
        HasSubstr("damaged: damaged checkpoint: it is of iteration " + std::to_string(iteration)));
  }
  EXPECT_THAT(refusal("progress", put(1, std::int64_t{4})), HasSubstr("the best weights of 4"));
  EXPECT_THAT(refusal("progress", put(2, 1.5)), HasSubstr("best score is 1.5"));
  EXPECT_THAT(refusal("progress", put(2, std::nan(""))), HasSubstr("best score is nan"));
  EXPECT_THAT(refusal("state.head.bn.running_var", put(3, -1.0F)),
              HasSubstr("training.state.head.bn.running_var holds -1, expected values >= 0"));
  EXPECT_THAT(refusal("best.head.bn.running_var", put(3, -1.0F)), HasSubstr("holds -1"));
  EXPECT_THAT(refusal("optimizer.head.fc2.weight.exp_avg_sq", put(0, -1.0F)),
              HasSubstr("exp_avg_sq holds -1,"));
  EXPECT_THAT(refusal("optimizer.head.fc2.weight.step", put(0, -1.0F)), HasSubstr("step holds -1"));
  for (const char* tensor : {"state.head.fc2.weight", "best.head.fc1.bias",
                             "optimizer.head.fc1.weight.exp_avg", "state.head.bn.running_mean"}) {
    EXPECT_THAT(refusal(tensor, put(1, std::nanf(""))), HasSubstr("not finite")) << tensor;
    EXPECT_THAT(refusal(tensor, put(1, HUGE_VALF)), HasSubstr("not finite")) << tensor;
  }
  EXPECT_EQ(refusal("progress", put(0, std::int64_t{3})), "no exception");
}

TEST_F(TrainerTest, ACheckpointIsAModelToo) {
  const reid::TemporaryData out;
  train(small_options("fc1"), 3, out.path() / "checkpoint");
  const reid::Model model = reid::load_model(out.path() / "checkpoint");
  EXPECT_EQ(model.network.description().height, 16);
}

TEST_F(TrainerTest, AFullDiskLeavesThePreviousCheckpoint) {
  const reid::TemporaryData out;
  reid::Model model = small_model();
  Trainer trainer(model, training_set(), small_options("fc1"));
  trainer.prepare({});
  trainer.step();
  EXPECT_THROW(trainer.save_checkpoint("/dev/full"), std::runtime_error);
  EXPECT_THROW(trainer.save_checkpoint(out.path() / "no" / "checkpoint"), std::invalid_argument);
}

TEST_F(TrainerTest, OptionsAreCheckedByName) {
  const auto refusal = [](const std::function<void(TrainerOptions&)>& change) {
    TrainerOptions options = small_options("fc1");
    change(options);
    return message_of([&] {
      reid::Model model = small_model();
      Trainer trainer(model, training_set(), options);
    });
  };
  EXPECT_THAT(refusal([](auto& o) { o.iterations = 0; }), HasSubstr("iterations is 0"));
  EXPECT_THAT(refusal([](auto& o) { o.learning_rate = -1; }), HasSubstr("learning_rate is -1"));
  EXPECT_THAT(refusal([](auto& o) { o.views = -1; }), HasSubstr("views is -1"));
  EXPECT_THAT(refusal([](auto& o) { o.clip_norm = 0; }), HasSubstr("clip_norm is 0"));
  EXPECT_THAT(refusal([](auto& o) { o.trunk_lr_scale = 0; }), HasSubstr("trunk_lr_scale is 0"));
  EXPECT_THAT(refusal([](auto& o) { o.validate_every = 0; }), HasSubstr("validate_every is 0"));
  EXPECT_THAT(refusal([](auto& o) { o.first_trained = "conv9_9"; }), HasSubstr("conv9_9"));
  EXPECT_THAT(refusal([](auto& o) { o.identities = 9; }), HasSubstr("identities is 9"));
  EXPECT_THAT(refusal([](auto& o) { o.loss.margin = 3; }), HasSubstr("margin is 3"));
}

TEST(TrainingLog, KeepsTheRowsBeforeAResume) {
  const reid::TemporaryData out;
  const auto path = out.path() / "log.csv";
  TrainingStep step;
  step.loss = 0.25;
  Validation validation;
  validation.auc = {{"a", 0.75}};
  validation.mean_auc = 0.75;
  {
    TrainingLog log(path);
    for (step.iteration = 1; step.iteration <= 5; ++step.iteration) log.add(step, nullptr, 100);
  }
  {
    TrainingLog log(path, 3);
    step.iteration = 4;
    log.add(step, &validation, 200);
  }
  EXPECT_EQ(read_file(path),
            "iteration,loss,mean_distance,hardest_positive,hardest_negative,active_negatives,"
            "spread,learning_rate,gradient_norm,images_per_second,validation_auc\n"
            "1,0.25,0,0,0,0,0,0,0,100,\n2,0.25,0,0,0,0,0,0,0,100,\n3,0.25,0,0,0,0,0,0,0,100,\n"
            "4,0.25,0,0,0,0,0,0,0,200,0.75\n");
  EXPECT_THROW(TrainingLog("/dev/full"), std::runtime_error);
  EXPECT_THROW(TrainingLog(out.path() / "no" / "log.csv"), std::runtime_error);
}

}  // namespace
}  // namespace sdmt::train

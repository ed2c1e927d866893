// SPDX-License-Identifier: Apache-2.0
// Trainings that several processes share end in the bytes of one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "nn/thread_group.h"
#include "reid/temporary_data.h"
#include "sdmt/train/pair_classifier.h"
#include "sdmt/train/trainer.h"
#include "train/training_fixture.h"

namespace sdmt::train {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class SharedTraining : public testing::Test {
 protected:
  SharedTraining() {
    omp_set_num_threads(1);
    data_.write_people(9, 4);
  }
  ~SharedTraining() override { omp_set_num_threads(threads_); }

  TrainingSetOptions set_options() const {
    TrainingSetOptions options;
    options.folders = {data_.path()};
    options.holdout_identities = 3;
    return options;
  }

  static TrainerOptions options(const std::string& first_trained) {
    TrainerOptions options = small_options(first_trained);
    options.identities = 5;
    options.instances = 4;
    options.iterations = 4;
    return options;
  }

  struct Files {
    fs::path save, resume, cache;
    std::int64_t until;
  };

  // The losses, then the bytes of the model.
  std::string train(nn::ProcessGroup& group, const reid::Model& start,
                    const TrainerOptions& options, const Files& files = {{}, {}, {}, 1000}) const {
    const reid::TemporaryData out;
    reid::save_model(out.path() / "start", start);
    reid::Model model = reid::load_model(out.path() / "start");
    Trainer trainer(model, load_training_set(set_options(), group), options, group);
    trainer.prepare({}, files.cache);
    if (!files.resume.empty()) trainer.load_checkpoint(files.resume);
    std::string result;
    while (!trainer.finished() && trainer.iteration() < files.until) {
      const TrainingStep step = trainer.step();
      if (trainer.validation_due()) trainer.validate();
      if (trainer.iteration() > 3) result += std::to_string(step.loss) + " ";
    }
    if (!files.save.empty()) trainer.save_checkpoint(files.save);
    if (!trainer.finished()) return result;
    trainer.finish();
    reid::save_model(out.path() / "model", model);
    return result + read_file(out.path() / "model");
  }

  void expect_same(const reid::Model& start, const TrainerOptions& options,
                   const std::vector<int>& sizes, const std::string& what) const {
    const std::string alone = train(nn::ProcessGroup::alone(), start, options);
    for (const int size : sizes) {
      nn::ThreadGroup::run(size, [&](nn::ProcessGroup& group) {
        EXPECT_TRUE(train(group, start, options) == alone)
            << what << ", process " << group.rank() << " of " << size;
      });
    }
  }

  reid::TemporaryData data_;
  int threads_ = omp_get_max_threads();
};

TEST_F(SharedTraining, EndsInTheBytesOfOneProcess) {
  const reid::Model model = small_model();
  expect_same(model, options("conv1_1"), {3}, "the whole network");
  TrainerOptions untied = options("conv1_1");
  untied.tie = std::nullopt;
  untied.loss.kind = LossKind::triplet;
  expect_same(model, untied, {2}, "all weights, triplets");
  expect_same(model, options("fc1"), {3, 16}, "cached features");
  TrainerOptions live = options("conv3_1");
  live.views = 0;
  live.optimizer = OptimizerKind::sgd;
  live.clip_norm = 0.01;
  live.average = 0.5;
  expect_same(model, live, {2}, "frozen layers without a cache");
}

TEST_F(SharedTraining, WithNormalisationsInTheTrunk) {
  TrainerOptions lite = options("");
  lite.tie = std::nullopt;
  expect_same(reid::untrained_model(reid::lite(32, 64), 1), lite, {5}, "lite");
}

TEST_F(SharedTraining, GoesOnWithAnotherNumberOfProcesses) {
  const reid::Model model = small_model();
  const TrainerOptions each = options("conv3_1");
  const std::string whole = train(nn::ProcessGroup::alone(), model, each);
  const auto checkpoint = data_.path() / "checkpoint";
  const auto cache = data_.path() / "features";
  nn::ThreadGroup::run(3, [&](nn::ProcessGroup& group) {
    train(group, model, each, {checkpoint, {}, cache, 2});
  });
  EXPECT_TRUE(train(nn::ProcessGroup::alone(), model, each, {{}, checkpoint, cache, 1000}) ==
              whole);
  nn::ThreadGroup::run(2, [&](nn::ProcessGroup& group) {
    EXPECT_TRUE(train(group, model, each, {{}, checkpoint, cache, 1000}) == whole);
  });
}

TEST_F(SharedTraining, AnImageThatOneCannotReadIsLeftOutByAll) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(data_.path())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (int copy = 0; copy < 3; ++copy) {  // one in a hundred may be unreadable
    for (std::size_t i = 0; i < files.size(); ++i) {
      fs::copy_file(files[i], data_.path() / ("00" + std::to_string(20 + copy) + "_c1s1_0000" +
                                              std::to_string(10 + i) + "_00.png"));
    }
  }
  data_.write(files[11].filename().string(), "no image");
  const TrainingSet alone = load_training_set(set_options());
  ASSERT_EQ(alone.unreadable.size(), 1u);
  nn::ThreadGroup::run(4, [&](nn::ProcessGroup& group) {
    const TrainingSet shared = load_training_set(set_options(), group);
    EXPECT_EQ(shared.unreadable, alone.unreadable);
    EXPECT_EQ(shared.files, alone.files);
    std::size_t read = 0;
    for (const auto& image : shared.images) read += image.width > 0 ? 1 : 0;
    EXPECT_LT(read, shared.images.size() / 2);
  });
}

TEST_F(SharedTraining, WeightsThatDifferAreNoticed) {
  const auto run = [&] {
    nn::ThreadGroup::run(2, [&](nn::ProcessGroup& group) {
      reid::Model model = small_model(static_cast<std::uint64_t>(group.rank()));
      Trainer trainer(model, load_training_set(set_options(), group), options("conv1_1"), group);
      trainer.step();
      trainer.validate();
    });
  };
  EXPECT_THAT(message_of(run), HasSubstr("the weights of process 1 are not those of process 0"));
}

TEST_F(SharedTraining, ABatchTooSmallToShareIsRefused) {
  const auto run = [&] {
    nn::ThreadGroup::run(2, [&](nn::ProcessGroup& group) {
      reid::Model model = small_model();
      Trainer(model, load_training_set(set_options(), group), small_options("fc1"), group);
    });
  };
  EXPECT_THAT(message_of(run), HasSubstr("a batch of 12 images"));
}

TEST_F(SharedTraining, PairClassifier) {
  TrainerOptions each = options("fc1");
  each.tie = BlockGrid{};
  const auto weights = [&](nn::ProcessGroup& group) {
    reid::Model model = reid::untrained_model(reid::vgg16(32, 16), 0);
    PairTrainingEvents events;
    std::vector<double> losses;
    events.step = [&](const PairTrainingStep& step) { losses.push_back(step.loss); };
    auto classifier = train_pair_classifier(model, load_training_set(set_options(), group), each,
                                            events, {}, group);
    std::vector<float> values(losses.begin(), losses.end());
    for (const auto& [name, tensor] : classifier.state()) {
      values.insert(values.end(), tensor->values().begin(), tensor->values().end());
    }
    return values;
  };
  const auto alone = weights(nn::ProcessGroup::alone());
  for (const int size : {2, 3}) {
    nn::ThreadGroup::run(size, [&](nn::ProcessGroup& group) {
      EXPECT_EQ(weights(group), alone) << group.rank() << " of " << size;
    });
  }
}

}  // namespace
}  // namespace sdmt::train

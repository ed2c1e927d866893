// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/trainer_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "sdmt/train/pk_sampler.h"
#include "sdmt/train/trainer_option_table.h"
#include "train/training_fixture.h"
#include "training_configuration.h"

namespace sdmt::train {
namespace {

// What a checkpoint is compared with.
Configuration configuration(const TrainerOptions& options) {
  reid::Model model = small_model();
  TrainedNetwork network(model.network, BlockGrid{2, 1}, "fc1", 1.0F);
  const TrainingSet set;
  return training_configuration(options, set, front_configuration(options, set, network));
}

TEST(TrainerOptionTable, ReadsWhatItPrints) {
  std::set<std::string> names, fields;
  for (const auto& option : trainer_option_table()) {
    EXPECT_TRUE(names.insert(option.name).second) << option.name;
    EXPECT_TRUE(fields.insert(option.field).second) << option.field;
    TrainerOptions options;
    option.set(options, option.get({}));
    EXPECT_EQ(option.get(options), option.get({})) << option.name;
  }
}

TEST(TrainerOptionTable, RefusalsNameTheOptionOrTheField) {
  const auto refusal = [](const std::string& name, const std::string& value) {
    return message_of([&] {
      TrainerOptions options;
      for (const auto& option : trainer_option_table()) {
        if (option.name == name) option.set(options, value);
      }
      options.validate();
    });
  };
  EXPECT_EQ(refusal("lr", "fast"), "lr is 'fast', expected a number");
  EXPECT_EQ(refusal("lr", "0"), "learning_rate is 0, expected > 0");
  EXPECT_EQ(refusal("average", "1"), "average is 1, expected >= 0 and < 1");
  EXPECT_EQ(refusal("margin", "2.5"), "margin is 2.5, expected > 0 and <= 2");
  EXPECT_EQ(refusal("instances", "1"), "instances is 1, expected >= 2");
  EXPECT_EQ(refusal("noise", "nan"), "noise is nan, expected 0..255");
  for (const std::string text : {"8", "x2", "8x", "8x2x2", "8by2", "8x2 "}) {
    EXPECT_EQ(refusal("tie", text),
              "tie is '" + text + "', expected ROWSxCOLUMNS, such as 8x2, or none");
  }
}

// Any option that differs keeps a checkpoint from being gone on from.
TEST(TrainerOptionTable, EveryOptionGuardsTheCheckpoint) {
  const Configuration before = configuration({});
  for (const auto& option : trainer_option_table()) {
    bool changed = false;
    for (const char* value : {"0.25", "3", "none", "triplet", "relations", "sgd", "constant"}) {
      TrainerOptions options;
      try {
        option.set(options, value);
        options.validate();
      } catch (const std::invalid_argument&) {
        continue;
      }
      changed = true;
      EXPECT_NE(configuration(options), before) << option.name << " " << value;
    }
    EXPECT_TRUE(changed) << option.name;
  }
}

// Checkpoints of earlier versions hold these settings, in these words.
TEST(TrainingConfiguration, IsWrittenAsEver) {
  Configuration c = configuration({});
  for (const char* counted : {"data", "validation data", "frozen weights"}) c.erase(counted);
  TrainerOptions options;
  options.source_weights = {0.5, 2};
  EXPECT_EQ(configuration(options)["source_weights"], "0.5 2 ");
  const Configuration expected{{"average", "0"},
                               {"blur", "0"},
                               {"brightness", "0.3"},
                               {"clip_norm", "inf"},
                               {"contrast", "0.2"},
                               {"crop", "0"},
                               {"decay", "1"},
                               {"decay_start", "0"},
                               {"erase", "0.3"},
                               {"final_factor", "0.02"},
                               {"first_trained", ""},
                               {"flip", "0.5"},
                               {"gamma", "0"},
                               {"grey", "0"},
                               {"grey_patch", "0"},
                               {"identities", "32"},
                               {"instances", "4"},
                               {"iterations", "3000"},
                               {"learning_rate", "0.001"},
                               {"loss", "contrastive"},
                               {"low_resolution", "0.3"},
                               {"margin", "0.2"},
                               {"momentum", "0.9"},
                               {"noise", "0"},
                               {"offset", "0"},
                               {"optimizer", "adam"},
                               {"saturation", "0"},
                               {"scale", "0.1"},
                               {"seed", "0"},
                               {"source_weights", ""},
                               {"teacher", "none"},
                               {"teacher_match", "projection"},
                               {"teacher_weight", "1"},
                               {"tie", "8x2"},
                               {"tint", "0.08"},
                               {"translate", "0.06"},
                               {"triplet_scale", "8"},
                               {"trunk_lr_scale", "0.1"},
                               {"unlabelled_batch", "32"},
                               {"unreadable images", "0"},
                               {"validate_every", "100"},
                               {"views", "6"},
                               {"warmup_iterations", "20"},
                               {"weight_decay", "0"}};
  EXPECT_EQ(c, expected);
}

TEST(TrainerOptionTable, ReadsTheConfigFiles) {
  for (const char* name :
       {"train-quick", "train-frozen", "train-lite", "train-as-is", "train-market1501"}) {
    std::ifstream file(std::string(SDMT_CONFIGS_DIR) + "/" + name + ".json");
    ASSERT_TRUE(file) << name;
    const auto config = nlohmann::json::parse(file);
    TrainerOptions options;
    for (const auto& option : trainer_option_table()) {
      const auto value = config.find(option.name);
      if (value == config.end()) continue;
      option.set(options, value->is_string() ? value->get<std::string>() : value->dump());
    }
    EXPECT_NO_THROW(options.validate()) << name;
    EXPECT_EQ(options.iterations, config.at("iterations")) << name;
  }
}

// The table of options in the documentation is this one's.
TEST(TrainerOptionTable, IsTheDocumentation) {
  const std::string path = std::string(SDMT_TESTS_DIR) + "/../docs/training.md";
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  EXPECT_THAT(text, testing::HasSubstr(trainer_option_table().markdown({{"default", {}}})));
}

}  // namespace
}  // namespace sdmt::train

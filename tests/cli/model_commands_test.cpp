// SPDX-License-Identifier: Apache-2.0
// init-model, embed, inspect and bench as a user meets them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "cli/run_command.h"
#include "reid/formula_network.h"
#include "sdmt/io/safetensors.h"

namespace sdmt::tests {
namespace {

namespace fs = std::filesystem;
using reid::testing_support::FormulaCrop;
using reid::testing_support::kFormulaCrops;
using testing::ElementsAre;
using testing::HasSubstr;

void write_png(const fs::path& path, FormulaCrop crop) {
  ASSERT_TRUE(cv::imwrite(path, cv::Mat(crop.height, crop.width, CV_8UC3, crop.pixels.data())));
}

std::vector<float> floats(const io::Safetensors& file, const std::string& name) {
  std::vector<float> values(file.at(name).count());
  file.read_floats(file.at(name), values);
  return values;
}

// The fixture is PyTorch's and OpenCV's answer (tests/parity/make_network.py).
TEST(EmbedCommand, AgreesWithPyTorchOnImageFiles) {
  const TemporaryFolder folder;
  reid::testing_support::write_formula_model(folder / "m.safetensors");
  std::vector<std::string> words{"embed", "--model", folder / "m.safetensors", "--output",
                                 folder / "f.safetensors"};
  for (int i = 0; i < kFormulaCrops; ++i) {
    words.push_back(folder / (std::to_string(i) + ".png"));
    write_png(words.back(), FormulaCrop(i));
  }
  const auto result = run_sdmt(words);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const io::Safetensors file(folder / "f.safetensors");
  EXPECT_EQ(file.at("embeddings").shape_str(), "[16,128]");
  EXPECT_EQ(file.tensors().size(), 1U);
  const auto images = nlohmann::json::parse(file.metadata().at("images"));
  EXPECT_EQ(images.at(3), (folder / "3.png").string());

  const auto ours = floats(file, "embeddings");
  const auto theirs =
      floats(io::Safetensors(fs::path(SDMT_TESTS_DIR) / "reid/fixtures/network.safetensors"),
             "embeddings");
  ASSERT_EQ(ours.size(), theirs.size());
  for (std::size_t i = 0; i < ours.size(); ++i) ASSERT_NEAR(ours[i], theirs[i], 1e-5);

  // One thread gives the same bytes.
  words.insert(words.begin() + 1, {"--threads", "1"});
  words[6] = folder / "g.safetensors";
  ASSERT_EQ(run_sdmt(words).exit_code, 0);
  EXPECT_EQ(read_file(folder / "g.safetensors"), read_file(folder / "f.safetensors"));
}

class ModelCommands : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    const auto result = run_sdmt({"init-model", "--seed", "3", "--output", model()});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("random weights, seed 3"));
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string model() { return *folder_ / "model.safetensors"; }

  static std::unique_ptr<TemporaryFolder> folder_;
};

std::unique_ptr<TemporaryFolder> ModelCommands::folder_;

TEST_F(ModelCommands, InitModelRepeatsAndTakesATrunk) {
  const TemporaryFolder folder;
  ASSERT_EQ(run_sdmt({"init-model", "--seed", "3", "--output", folder / "a"}).exit_code, 0);
  EXPECT_EQ(read_file(folder / "a"), read_file(model()));
  // A model file is a trunk file too; its head is listed as ignored.
  const auto result =
      run_sdmt({"init-model", "--seed", "4", "--trunk", model(), "--output", folder / "b"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("ignored 8 tensors of model.safetensors: head.fc1.weight, "));
  const io::Safetensors one(folder / "a");
  const io::Safetensors two(folder / "b");
  EXPECT_EQ(floats(one, "features.14.weight"), floats(two, "features.14.weight"));
  EXPECT_NE(floats(one, "head.fc2.weight"), floats(two, "head.fc2.weight"));
}

TEST_F(ModelCommands, BadInputIsOneLineAndLeavesNothing) {
  const TemporaryFolder folder;
  const std::string output = folder / "out.safetensors";
  const auto expect_refusal = [&](const std::vector<std::string>& words,
                                  const std::string& message) {
    const auto result = run_sdmt(words);
    EXPECT_EQ(result.exit_code, 2) << message;
    EXPECT_EQ(result.err, "sdmt " + words[0] + ": " + message + "\n");
    EXPECT_FALSE(fs::exists(output)) << message;
  };
  write_png(folder / "good.png", FormulaCrop(0));
  write_file(folder / "bad.png", "this is no picture");
  ASSERT_TRUE(cv::imwrite(folder / "dot.png", cv::Mat::zeros(1, 1, CV_8UC3)));
  ASSERT_TRUE(cv::imwrite(folder / "line.png", cv::Mat::zeros(1, 50, CV_8UC3)));
  write_file(folder / "empty", "");
  write_file(folder / "text", "not a model at all");
  const auto embed = [&](const std::string& file, const std::string& image) {
    return std::vector<std::string>{"embed", "--model",           file, "--output",
                                    output,  folder / "good.png", image};
  };

  expect_refusal(embed(model(), folder / "dot.png"),
                 (folder / "dot.png").string() + ": is 1 x 1 pixels, expected at least 2 x 2");
  expect_refusal(embed(model(), folder / "line.png"),
                 (folder / "line.png").string() + ": is 50 x 1 pixels, expected at least 2 x 2");
  for (const char* name : {"bad.png", "none.png"}) {
    const auto result = run_sdmt(embed(model(), folder / name));
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, testing::StartsWith("sdmt embed: " + (folder / name).string() + ": "));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(fs::exists(output));
  }
  expect_refusal(embed(folder / "none", folder / "good.png"),
                 (folder / "none").string() + ": cannot be opened: No such file or directory");
  expect_refusal(embed(folder / "empty", folder / "good.png"),
                 (folder / "empty").string() + ": is empty, expected a safetensors file");
  expect_refusal(embed(folder / "text", folder / "good.png"),
                 (folder / "text").string() +
                     ": header length is 8029109312199880558, expected at most 100000000 (not a "
                     "safetensors file?)");
  fs::copy_file(model(), folder / "cut");
  fs::resize_file(folder / "cut", fs::file_size(model()) - 1);
  const auto cut = run_sdmt({"inspect", folder / "cut"});
  EXPECT_EQ(cut.exit_code, 2);
  EXPECT_EQ(cut.out, "");
  EXPECT_THAT(cut.err, testing::MatchesRegex("sdmt inspect: .*/cut: tensor .* has data_offsets "
                                             ".* beyond the [0-9]+ bytes of data in the file\n"));
  expect_refusal(
      {"embed", "--model", model(), "--output", folder / "none" / "x", folder / "good.png"},
      (folder / "none" / "x").string() + ": folder " + (folder / "none").string() +
          " does not exist");
  expect_refusal({"init-model", "--trunk", folder / "text", "--output", output},
                 (folder / "text").string() +
                     ": header length is 8029109312199880558, expected at most 100000000 (not a "
                     "safetensors file?)");
  const auto full = run_sdmt({"init-model", "--output", "/dev/full"});
  EXPECT_EQ(full.exit_code, 1);
  EXPECT_EQ(full.err, "sdmt init-model: /dev/full: write failed: No space left on device\n");
}

TEST_F(ModelCommands, InspectShowsLayersAndTensors) {
  const TemporaryFolder folder;
  const auto result = run_sdmt({"inspect", model(), "--json", folder / "i.json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("tau_a          not set"));
  EXPECT_THAT(result.out, HasSubstr("mean 0.485 0.456 0.406"));
  EXPECT_THAT(result.out, testing::ContainsRegex("conv3_3 +Conv2d +32 x 16 x 256 +590080 +0.604"));
  EXPECT_THAT(result.out, testing::ContainsRegex("total +18529600 +3.082"));
  const auto json = nlohmann::json::parse(read_file(folder / "i.json"));
  EXPECT_EQ(json.at("kind"), "model");
  EXPECT_EQ(json.at("model").at("flatten_order"), "CHW");
  EXPECT_EQ(json.at("tensors").at(0).at("name"), "features.0.weight");
  EXPECT_THAT(json.at("tensors").at(0).at("shape"), ElementsAre(64, 3, 3, 3));
  EXPECT_EQ(json.at("layers").size(), 21U);
}

TEST_F(ModelCommands, BenchMeasuresForwardAndTraining) {
  const TemporaryFolder folder;
  const auto result = run_sdmt({"bench", "--model", model(), "--batch", "1,2", "--repeat", "2",
                                "--train", "--threads", "1", "--json", folder / "b.json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(read_file(folder / "b.json"));
  EXPECT_EQ(json.at("threads"), 1);
  EXPECT_FALSE(json.at("target").get<std::string>().empty());
  ASSERT_EQ(json.at("forward").size(), 2U);
  const auto& forward = json.at("forward").at(1);
  EXPECT_EQ(forward.at("batch"), 2);
  EXPECT_GT(forward.at("ms_min"), 0.0);
  EXPECT_GE(forward.at("ms_median"), forward.at("ms_min"));
  EXPECT_NEAR(forward.at("gflops").get<double>(),
              2 * 3.0823 / forward.at("ms_median").get<double>() * 1e3, 1.0);
  ASSERT_EQ(json.at("train").size(), 2U);  // not for a batch of one
  EXPECT_EQ(json.at("train").at(0).at("frozen"), false);
  EXPECT_EQ(json.at("train").at(1).at("frozen"), true);
  EXPECT_GT(json.at("peak_rss_mib"), 70.0);
  EXPECT_EQ(run_sdmt({"bench", "--batch", "0"}).exit_code, 2);
}

}  // namespace
}  // namespace sdmt::tests

// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/run_command.h"
#include "sdmt/reid/model_file.h"

namespace sdmt::tests {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

// A model with random weights and a small synthetic set, shared by the tests (15 images).
class ValidateRoc : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    reid::Model model;
    model.network.initialize(1);
    reid::save_model(*folder_ / "model.safetensors", model);
    const auto made = run_sdmt({"synth", "reid", "--output", *folder_ / "set", "--identities", "9",
                                "--images-per-identity", "4"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static fs::path model() { return *folder_ / "model.safetensors"; }
  static fs::path set() { return *folder_ / "set"; }
  static CommandResult validate(const fs::path& data, std::vector<std::string> more = {}) {
    std::vector<std::string> words = {"validate-roc", "--model", model(), "--data", data};
    words.insert(words.end(), more.begin(), more.end());
    return run_sdmt(words);
  }
  // The same image under each name.
  static void fill(const fs::path& folder, const std::vector<std::string>& names) {
    fs::create_directories(folder);
    for (const auto& name : names) {
      fs::copy_file(set() / "query/0007_c1s1_000000_00.jpg", folder / name);
    }
  }

 private:
  static inline TemporaryFolder* folder_ = nullptr;
};

void expect_curve(const nlohmann::json& curve) {
  EXPECT_GE(curve["auc"].get<double>(), curve["auc_low"].get<double>());
  EXPECT_LE(curve["auc"].get<double>(), curve["auc_high"].get<double>());
  EXPECT_GE(curve["eer"].get<double>(), 0.0);
  EXPECT_LE(curve["eer"].get<double>(), 1.0);
  EXPECT_GE(curve["tpr_at_fpr"]["0.1"].get<double>(), curve["tpr_at_fpr"]["0.01"].get<double>());
  EXPECT_GE(curve["tpr_at_fpr"]["0.01"].get<double>(), curve["tpr_at_fpr"]["0.001"].get<double>());
}

TEST_F(ValidateRoc, WritesNumbersPlotReportAndThreshold) {
  const TemporaryFolder out;
  const auto copy = out / "model.safetensors";
  fs::copy_file(model(), copy);
  const auto result = run_sdmt({"validate-roc", "--model", copy, "--data", set(), "--json",
                                out / "roc.json", "--plot", out / "roc.svg", "--report",
                                out / "roc.html", "--write-threshold", "--baselines"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("12 images of 3 people by 2 cameras, 3 of the background"));
  EXPECT_THAT(result.out, HasSubstr("colour histogram"));

  const auto json = nlohmann::json::parse(read_file(out / "roc.json"));
  expect_curve(json["person_only"]);
  expect_curve(json["cross_camera"]);
  expect_curve(json["paper"]);
  EXPECT_EQ(json["person_only"]["positives"], 18);  // 3 people of 4 images
  EXPECT_EQ(json["person_only"]["negatives"], 48);
  EXPECT_EQ(json["person_only"]["distractors"], 0);
  EXPECT_EQ(json["paper"]["positives"], 18);  // 18 : 18 : 18 of 36
  EXPECT_EQ(json["paper"]["negatives"], 18);
  EXPECT_EQ(json["paper"]["distractors"], 18);
  // An untrained network may put nobody first, but finds everybody in the end.
  const double rank1 = json["rank1"], rank5 = json["rank5"], rank10 = json["rank10"];
  EXPECT_GE(rank1, 0.0);
  EXPECT_LE(rank1, rank5);
  EXPECT_LE(rank5, rank10);
  EXPECT_LE(rank10, 1.0);
  for (const char* key : {"map", "map_trapezoid"}) {
    EXPECT_GT(json[key].get<double>(), 0.0) << key;
    EXPECT_LE(json[key].get<double>(), 1.0) << key;
  }
  EXPECT_EQ(json["baselines"].size(), 3u);

  const auto stored = reid::load_model(copy).metadata.tau_a;
  ASSERT_TRUE(stored.has_value());
  EXPECT_NEAR(stored->value, json["tau_a"].get<double>(), 1e-12);
  EXPECT_EQ(stored->criterion, "accuracy");

  const auto html = read_file(out / "roc.html");
  EXPECT_THAT(html, HasSubstr("data:image/jpeg;base64,/9j/"));
  EXPECT_THAT(html, Not(HasSubstr("src=\"http")));
  const auto svg = read_file(out / "roc.svg");
  EXPECT_THAT(svg, testing::StartsWith("<svg "));
  EXPECT_THAT(svg, testing::EndsWith("</svg>\n"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST_F(ValidateRoc, ThreadsDoNotChangeTheNumbers) {
  const TemporaryFolder out;
  ASSERT_EQ(validate(set(), {"--json", out / "1.json", "--threads", "1"}).exit_code, 0);
  ASSERT_EQ(validate(set(), {"--json", out / "3.json", "--threads", "3"}).exit_code, 0);
  EXPECT_EQ(read_file(out / "1.json"), read_file(out / "3.json"));
}

TEST_F(ValidateRoc, SamplesPairsAndPicksTheThresholdByFpr) {
  const TemporaryFolder out;
  const auto result = validate(set(), {"--pairs", "10", "--seed", "2", "--criterion", "fpr",
                                       "--target-fpr", "0.2", "--json", out / "roc.json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(read_file(out / "roc.json"));
  EXPECT_EQ(json["person_only"]["positives"], 10);
  EXPECT_EQ(json["person_only"]["negatives"], 10);
  EXPECT_EQ(json["criterion"], "fpr");
}

TEST_F(ValidateRoc, PlainFolderAndExtraDistractors) {
  const TemporaryFolder out;
  const auto result = validate(set() / "query", {"--distractors", set() / "bounding_box_test"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("6 images of 3 people by 2 cameras, 9 of the background"));
}

// Several sets in one table, each as it is alone; what a network stored is what its own vectors
// say.
TEST_F(ValidateRoc, SeveralSetsAndTheVectorsOfAnotherNetwork) {
  const TemporaryFolder out;
  const auto gallery = set() / "bounding_box_test";
  std::vector<std::string> words = {"embed", "--model", model(), "--output",
                                    out / "vectors.safetensors"};
  for (const auto* part : {"query", "bounding_box_test"}) {
    for (const auto& entry : fs::directory_iterator(set() / part)) words.push_back(entry.path());
  }
  ASSERT_EQ(run_sdmt(words).exit_code, 0);
  ASSERT_EQ(run_sdmt({"synth", "scene", "--output", out / "scene", "--frames", "21", "--walkers",
                      "4", "--width", "320", "--height", "180"})
                .exit_code,
            0);
  const std::string vectors = (out / "vectors.safetensors").string();
  const auto result =
      run_sdmt({"validate-roc", "--model", model(), "--data", set(), out / "scene", "--embeddings",
                "itself=" + vectors, "--json", out / "both.json", "--plot", out / "roc.svg",
                "--report", out / "roc.html", "--target-fpr", "0.2"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("scene: the boxes of a sequence have no rows"));
  EXPECT_THAT(result.out, HasSubstr("tau_a for FPR 0.2"));
  EXPECT_THAT(result.err, HasSubstr("scoring"));
  EXPECT_THAT(read_file(out / "roc.svg"), HasSubstr("ROC, scene"));
  const auto both = nlohmann::json::parse(read_file(out / "both.json"));
  ASSERT_EQ(both["sets"].size(), 2u);
  const auto& first = both["sets"][0];
  EXPECT_EQ(first["baselines"]["itself"]["person_only"], first["person_only"]);
  EXPECT_EQ(first["baselines"]["itself"]["map"], first["map"]);
  EXPECT_TRUE(first["at_stored_tau_a"].is_null());  // an untrained model has none
  EXPECT_TRUE(both["sets"][1]["baselines"].empty());

  const auto alone = validate(out / "scene", {"--json", out / "one.json", "--target-fpr", "0.2"});
  ASSERT_EQ(alone.exit_code, 0) << alone.err;
  EXPECT_EQ(nlohmann::json::parse(read_file(out / "one.json")), both["sets"][1]);

  const auto refused = [&](std::vector<std::string> more) { return validate(set(), more).err; };
  EXPECT_THAT(refused({"--embeddings", vectors}), HasSubstr("expected NAME=FILE"));
  fs::create_directories(out / "other");
  fs::copy(gallery, out / "other/set");
  EXPECT_THAT(validate(out / "other/set", {"--embeddings", "x=" + vectors}).err,
              HasSubstr("has no vector of"));
  EXPECT_THAT(validate(set(), {out / "scene", "--write-threshold"}).err,
              HasSubstr("expected one --data"));
}

// embed --centre of each camera's images alone is what --centre does with all.
TEST_F(ValidateRoc, CentresCameras) {
  const TemporaryFolder out;
  std::vector<std::string> words = {"--centre", "--json", out / "roc.json"};
  for (const char* camera : {"_c1s", "_c2s"}) {
    const std::string file = out / (std::string(camera) + ".safetensors");
    std::vector<std::string> embed = {"embed", "--centre", "--model", model(), "--output", file};
    for (const auto* part : {"query", "bounding_box_test"}) {
      for (const auto& entry : fs::directory_iterator(set() / part)) {
        if (entry.path().filename().string().find(camera) != std::string::npos) {
          embed.push_back(entry.path());
        }
      }
    }
    ASSERT_EQ(run_sdmt(embed).exit_code, 0);
    words.insert(words.end(), {"--embeddings", "each=" + file});
  }
  const auto result = validate(set(), words);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr(", less camera means"));
  const auto json = nlohmann::json::parse(read_file(out / "roc.json"));
  const auto& others = json["baselines"];
  ASSERT_EQ(others.size(), 3u);  // each; each and the model, centred
  const auto centred = std::find_if(others.begin(), others.end(), [&](const auto& one) {
    return one["person_only"] == others["each"]["person_only"] &&
           one["map"] == others["each"]["map"];
  });
  EXPECT_NE(centred, others.end());
  EXPECT_NE(others["each"]["person_only"], json["person_only"]);

  const auto alone = set() / "query/0007_c1s1_000000_00.jpg";
  EXPECT_THAT(run_sdmt({"embed", "--centre", "--model", model(), "--output",
                        out / "one.safetensors", alone})
                  .err,
              HasSubstr("camera 1 has 1 image, expected at least 2"));
  EXPECT_FALSE(fs::exists(out / "one.safetensors"));
}

TEST_F(ValidateRoc, PrintsTheRatesAtTheStoredThreshold) {
  const TemporaryFolder out;
  const auto copy = out / "model.safetensors";
  fs::copy_file(model(), copy);
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"validate-roc", "--model",       copy, "--data", set(),
                                      "--json",       out / "roc.json"};
    words.insert(words.end(), more.begin(), more.end());
    const auto result = run_sdmt(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(read_file(out / "roc.json"));
  };
  const auto chosen = run({"--criterion", "fpr", "--target-fpr", "0.3", "--write-threshold"});
  const auto stored = run({"--target-fpr", "0.3"});
  EXPECT_NEAR(stored["at_stored_tau_a"]["tau_a"].get<double>(), chosen["tau_a"].get<double>(),
              1e-12);
  EXPECT_EQ(stored["at_target_fpr"]["tau_a"]["value"], chosen["tau_a"]);
  const auto& fpr = stored["at_stored_tau_a"]["fpr"];
  EXPECT_GT(fpr["value"], 0.0);
  EXPECT_LE(fpr["value"], 0.3);
  EXPECT_LE(fpr["low"], fpr["value"]);
  EXPECT_GE(fpr["high"], fpr["value"]);
}

TEST_F(ValidateRoc, MotSequence) {
  const TemporaryFolder out;
  ASSERT_EQ(run_sdmt({"synth", "scene", "--output", out / "scene", "--frames", "21", "--walkers",
                      "4", "--width", "320", "--height", "180"})
                .exit_code,
            0);
  const auto result = validate(out / "scene", {"--json", out / "roc.json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("by 1 camera"));
  const auto json = nlohmann::json::parse(read_file(out / "roc.json"));
  EXPECT_TRUE(json["rank1"].is_null());  // one camera: nothing to search
  EXPECT_TRUE(json["cross_camera"].is_null());
  // Every frame instead of every tenth.
  const auto more = validate(out / "scene", {"--frame-step", "5", "--json", out / "more.json"});
  ASSERT_EQ(more.exit_code, 0) << more.err;
  EXPECT_GT(nlohmann::json::parse(read_file(out / "more.json"))["images"], json["images"]);
}

TEST_F(ValidateRoc, SaysWhatIsWrongWithTheInput) {
  const TemporaryFolder bad;
  const auto expect = [](const CommandResult& result, const std::string& message) {
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("sdmt validate-roc: "));
    EXPECT_THAT(result.err, HasSubstr(message));
  };
  expect(validate(bad / "none"), "none: is no folder");
  expect(validate(bad.path()), bad.path().string());  // no image in it

  fill(bad / "one_person", {"0001_c1s1_000001_00.jpg", "0001_c2s1_000002_00.jpg"});
  expect(validate(bad / "one_person"),
         "no pair of images of two people among 2 images of 1 person");
  fill(bad / "one_each", {"0001_c1s1_000001_00.jpg", "0002_c2s1_000002_00.jpg"});
  expect(validate(bad / "one_each"), "no pair of images of one person");
  fill(bad / "half/query", {"0001_c1s1_000001_00.jpg"});
  expect(validate(bad / "half"), "has no folder bounding_box_test");
  fill(bad / "damaged", {"0001_c1s1_000001_00.jpg", "0002_c2s1_000002_00.jpg"});
  write_file(bad / "damaged/0002_c1s1_000003_00.jpg", "not an image");
  expect(validate(bad / "damaged"), "0002_c1s1_000003_00.jpg");

  expect(validate(set(), {"--pairs", "-4"}), "pairs is -4");
  expect(validate(set(), {"--target-fpr", "1"}), "target_fpr is 1");
  expect(validate(set(), {"--frame-step", "0"}), "frame_step is 0");
  expect(validate(set(), {"--criterion", "guess"}), "guess");
  expect(validate(set(), {"--distractors", bad / "none"}), "none: is no folder");
  expect(validate(set(), {"--report", bad / "missing/roc.html"}), "missing");
}

TEST_F(ValidateRoc, BrokenModelIsRefusedAndNothingWritten) {
  const TemporaryFolder bad;
  write_file(bad / "model.safetensors", read_file(model()).substr(0, 5000));
  const auto before = read_file(bad / "model.safetensors");
  const auto result = run_sdmt({"validate-roc", "--model", bad / "model.safetensors", "--data",
                                set(), "--write-threshold", "--json", bad / "roc.json"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("model.safetensors"));
  EXPECT_EQ(read_file(bad / "model.safetensors"), before);
  EXPECT_EQ(bad.listing(), std::vector<std::string>{"model.safetensors"});
}

}  // namespace
}  // namespace sdmt::tests

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/model_metadata.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace sdmt::reid {
namespace {

ModelMetadata full() {
  ModelMetadata metadata;
  metadata.preprocessing.order = image::ChannelOrder::bgr;
  metadata.preprocessing.mean = {0.1F, 0.2F, 0.3F};
  metadata.margin = 0.25;
  metadata.tau_a = AffinityThreshold{0.8625, "fpr", 0.01};
  metadata.training = TrainingSummary{{"cuhk03", "a \"b\""}, 3000, "contrastive", {{"auc", 0.977}}};
  metadata.adaptation = AdaptationSummary{"lite", {"yard", "gate"}, "2026-11-27 06:01 UTC",
                                          40,     {{"auc", 0.9}},   {{"auc", 0.95}}};
  metadata.provenance = "two\nlines";
  return metadata;
}

TEST(ModelMetadata, RoundTrips) {
  const ModelMetadata read = parse_model_metadata(to_json(full()), "x");
  EXPECT_EQ(read.preprocessing, full().preprocessing);
  EXPECT_EQ(read.margin, 0.25);
  ASSERT_TRUE(read.tau_a.has_value());
  EXPECT_EQ(read.tau_a->value, 0.8625);
  EXPECT_EQ(read.tau_a->criterion, "fpr");
  EXPECT_EQ(read.tau_a->false_positive_rate, 0.01);
  ASSERT_TRUE(read.training.has_value());
  EXPECT_THAT(read.training->datasets, testing::ElementsAre("cuhk03", "a \"b\""));
  EXPECT_EQ(read.training->iterations, 3000);
  EXPECT_EQ(read.training->loss, "contrastive");
  EXPECT_THAT(read.training->scores, testing::ElementsAre(testing::Pair("auc", 0.977)));
  ASSERT_TRUE(read.adaptation.has_value());
  EXPECT_EQ(read.adaptation->start, "lite");
  EXPECT_THAT(read.adaptation->scenes, testing::ElementsAre("yard", "gate"));
  EXPECT_EQ(read.adaptation->date, "2026-11-27 06:01 UTC");
  EXPECT_EQ(read.adaptation->iterations, 40);
  EXPECT_THAT(read.adaptation->before, testing::ElementsAre(testing::Pair("auc", 0.9)));
  EXPECT_THAT(read.adaptation->after, testing::ElementsAre(testing::Pair("auc", 0.95)));
  EXPECT_EQ(read.provenance, "two\nlines");
  EXPECT_EQ(to_json(read), to_json(full()));
}

TEST(ModelMetadata, OptionalKeysMayBeAbsentAndOthersAreIgnored) {
  const ModelMetadata read = parse_model_metadata(
      R"({"format_version":1,"architecture":"vgg16-conv3_3-fc128-fc128","future":[1],
          "preprocessing":{"height":64,"width":32,"channel_order":"rgb","mean":[0,0,0],
                           "std":[1,1,1]}})",
      "x");
  EXPECT_EQ(read.preprocessing.height, 64);
  EXPECT_EQ(read.margin, 0.2);
  EXPECT_FALSE(read.tau_a.has_value());
  EXPECT_FALSE(read.training.has_value());
  EXPECT_FALSE(read.adaptation.has_value());
}

TEST(ModelMetadata, TextThatIsNotUtf8DoesNotKeepAModelFromBeingSaved) {
  ModelMetadata metadata;
  metadata.provenance = "caf\xe9";
  EXPECT_EQ(parse_model_metadata(to_json(metadata), "x").provenance, "caf\xEF\xBF\xBD");
}

// Replaces `from` by `to` in a good text and returns the message that follows.
std::string refusal(const std::string& from, const std::string& to) {
  std::string text = to_json(full());
  const auto at = text.find(from);
  if (at == std::string::npos) return "no " + from + " in " + text;
  text.replace(at, from.size(), to);
  try {
    parse_model_metadata(text, "m.safetensors");
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ModelMetadata, RefusalsNameTheKey) {
  EXPECT_EQ(refusal("{", "("), "m.safetensors: metadata is not valid JSON (at byte 1)");
  EXPECT_EQ(refusal("\"format_version\"", "\"version\""),
            "m.safetensors: metadata format_version is missing");
  EXPECT_EQ(refusal("\"format_version\":1", "\"format_version\":2"),
            "m.safetensors: metadata format_version is 2, expected 1 to 1 (a newer sdmt can read "
            "it)");
  EXPECT_EQ(refusal("\"format_version\":1", "\"format_version\":18446744073709551615"),
            "m.safetensors: metadata format_version is 18446744073709551615, expected a whole "
            "number");
  EXPECT_EQ(refusal("vgg16", "resnet"),
            "m.safetensors: metadata architecture is \"resnet-conv3_3-fc128-fc128\" without "
            "layers, expected \"vgg16-conv3_3-fc128-fc128\" or layers beside it");
  EXPECT_EQ(refusal("\"bgr\"", "\"grb\""),
            "m.safetensors: metadata preprocessing.channel_order is \"grb\", expected \"rgb\" or "
            "\"bgr\"");
  EXPECT_EQ(refusal("\"height\":128", "\"height\":-1"),
            "m.safetensors: preprocessing height is -1, expected 1 to 4096");
  EXPECT_EQ(refusal("\"height\":128", "\"height\":1.5"),
            "m.safetensors: metadata preprocessing.height is 1.5, expected a whole number");
  EXPECT_EQ(refusal("\"std\":[", "\"std\":[1,"),
            "m.safetensors: metadata preprocessing.std is not a list of 3 numbers");
  EXPECT_EQ(refusal("\"std\":[0.229", "\"std\":[0"),
            "m.safetensors: preprocessing std is 0, expected 0.001 to 1000");
  EXPECT_EQ(refusal("\"std\":[0.229", "\"std\":[1e-37"),
            "m.safetensors: preprocessing std is 1e-37, expected 0.001 to 1000");
  EXPECT_EQ(refusal("\"mean\":[0.1", "\"mean\":[1e38"),
            "m.safetensors: preprocessing mean is 1e+38, expected -10 to 10");
  EXPECT_EQ(refusal("CHW", "HWC"),
            "m.safetensors: metadata flatten_order is \"HWC\", expected \"CHW\"");
  EXPECT_EQ(refusal("0.8625", "\"high\""),
            "m.safetensors: metadata tau_a.value is \"high\", expected a number");
  EXPECT_EQ(refusal("0.8625", "1.5"),
            "m.safetensors: metadata tau_a.value is 1.500000, expected -1 to 1");
  EXPECT_EQ(refusal("\"margin\":0.25", "\"margin\":0"),
            "m.safetensors: metadata margin is 0.000000, expected > 0");
  EXPECT_EQ(refusal("\"iterations\":3000", "\"iterations\":-1"),
            "m.safetensors: metadata training.iterations is -1, expected >= 0");
  EXPECT_EQ(refusal(R"("iterations":40)", R"("iterations":-4)"),
            "m.safetensors: metadata adaptation.iterations is -4, expected >= 0");
}

}  // namespace
}  // namespace sdmt::reid

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/pk_sampler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <vector>

namespace sdmt::train {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// People of several sources; person i has counts[i] images.
std::vector<Identity> people(const std::vector<std::vector<int>>& counts) {
  std::vector<Identity> result;
  int image = 0;
  for (std::size_t source = 0; source < counts.size(); ++source) {
    for (const int count : counts[source]) {
      Identity identity{static_cast<int>(source), static_cast<int>(result.size()) + 1, {}};
      for (int k = 0; k < count; ++k) identity.images.push_back(image++);
      result.push_back(identity);
    }
  }
  return result;
}

PkSamplerOptions options(int identities, int instances, std::uint64_t seed = 0) {
  return {identities, instances, {}, seed};
}

TEST(PkSampler, BatchesArePeopleTimesImages) {
  const auto identities = people({std::vector<int>(37, 9)});
  PkSampler sampler(identities, 1, options(8, 4));
  for (std::int64_t t = 0; t < 50; ++t) {
    const auto batch = sampler.batch(t);
    ASSERT_EQ(batch.images.size(), 32u);
    ASSERT_EQ(batch.labels.size(), 32u);
    EXPECT_EQ(std::set<int>(batch.labels.begin(), batch.labels.end()).size(), 8u);
    EXPECT_EQ(std::set<int>(batch.images.begin(), batch.images.end()).size(), 32u);
    for (std::size_t i = 0; i < batch.images.size(); ++i) {
      const auto& own = identities[static_cast<std::size_t>(batch.labels[i])].images;
      EXPECT_NE(std::find(own.begin(), own.end(), batch.images[i]), own.end());
      EXPECT_EQ(batch.labels[i], batch.labels[i / 4 * 4]);
    }
  }
}

TEST(PkSampler, AnEpochShowsEveryPersonAtMostOnce) {
  const auto identities = people({std::vector<int>(37, 4)});
  PkSampler sampler(identities, 1, options(8, 2));
  std::map<int, int> seen;
  for (std::int64_t epoch = 0; epoch < 200; ++epoch) {
    std::set<int> once;
    for (std::int64_t i = 0; i < 4; ++i) {  // 37 / 8
      for (const int label : sampler.batch(epoch * 4 + i).labels) once.insert(label);
    }
    EXPECT_EQ(once.size(), 32u);
    for (const int label : once) ++seen[label];
  }
  // 200 * 32 / 37 = 173 appearances each, give or take four standard deviations
  for (int person = 0; person < 37; ++person) EXPECT_NEAR(seen[person], 173, 4 * 5) << person;
}

TEST(PkSampler, ImagesOfAPersonAreEquallyLikely) {
  const auto identities = people({{10, 10, 10, 10}});
  PkSampler sampler(identities, 1, options(4, 4));
  std::vector<int> counts(40);
  for (std::int64_t t = 0; t < 1000; ++t) {
    for (const int image : sampler.batch(t).images) ++counts[static_cast<std::size_t>(image)];
  }
  for (const int count : counts) EXPECT_NEAR(count, 400, 4 * 16);
}

TEST(PkSampler, FewImagesAreAllShownThenRepeated) {
  const auto identities = people({{1, 3, 9}});
  PkSampler sampler(identities, 1, options(3, 4));
  for (std::int64_t t = 0; t < 20; ++t) {
    const auto batch = sampler.batch(t);
    std::map<int, std::set<int>> images;
    for (std::size_t i = 0; i < batch.images.size(); ++i) {
      images[batch.labels[i]].insert(batch.images[i]);
    }
    EXPECT_EQ(images[0].size(), 1u);
    EXPECT_EQ(images[1].size(), 3u);
    EXPECT_EQ(images[2].size(), 4u);
  }
}

TEST(PkSampler, ABatchDependsOnSeedAndNumberOnly) {
  const auto identities = people({std::vector<int>(20, 5), std::vector<int>(10, 5)});
  PkSampler forward(identities, 2, options(6, 3, 5)), backward(identities, 2, options(6, 3, 5));
  PkSampler other(identities, 2, options(6, 3, 6));
  std::vector<std::vector<int>> batches;
  for (std::int64_t t = 0; t < 12; ++t) batches.push_back(forward.batch(t).images);
  int same = 0;
  for (std::int64_t t = 11; t >= 0; --t) {
    EXPECT_EQ(backward.batch(t).images, batches[static_cast<std::size_t>(t)]);
    same += other.batch(t).images == batches[static_cast<std::size_t>(t)] ? 1 : 0;
  }
  EXPECT_EQ(same, 0);
  EXPECT_EQ(std::set<std::vector<int>>(batches.begin(), batches.end()).size(), 12u);
}

TEST(PkSampler, SourcesShareABatchByWeight) {
  const auto identities =
      people({std::vector<int>(60, 2), std::vector<int>(20, 2), std::vector<int>(9, 2)});
  EXPECT_THAT(PkSampler(identities, 3, options(10, 2)).source_counts(), ElementsAre(7, 2, 1));
  PkSamplerOptions weighted = options(10, 2);
  weighted.source_weights = {1, 1, 0};
  PkSampler sampler(identities, 3, weighted);
  EXPECT_THAT(sampler.source_counts(), ElementsAre(5, 5, 0));
  std::vector<int> from(3);
  for (const int label : sampler.batch(0).labels) {
    ++from[static_cast<std::size_t>(identities[static_cast<std::size_t>(label)].source)];
  }
  EXPECT_THAT(from, ElementsAre(10, 10, 0));
}

TEST(PkSampler, RefusesWhatCannotBeDrawn) {
  const auto identities = people({{4, 4, 4}, {4, 4}});
  const auto message = [&](const PkSamplerOptions& bad) -> std::string {
    try {
      PkSampler(identities, 2, bad);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "no exception";
  };
  EXPECT_THAT(message(options(6, 2)), HasSubstr("identities is 6"));
  EXPECT_THAT(message(options(1, 2)), HasSubstr("identities is 1, expected >= 2"));
  EXPECT_THAT(message(options(2, 1)), HasSubstr("instances is 1, expected >= 2"));
  EXPECT_THAT(message({4, 2, {1}, 0}), HasSubstr("source_weights has 1 values"));
  EXPECT_THAT(message({4, 2, {0, 0}, 0}), HasSubstr("source_weights are all 0"));
  EXPECT_THAT(message({4, 2, {1, -1}, 0}), HasSubstr("source_weights has -1"));
  EXPECT_THAT(message({4, 2, {1, NAN}, 0}), HasSubstr("source_weights has nan"));
  EXPECT_THAT(message({4, 2, {0, 1}, 0}), HasSubstr("data folder 2 would have to give 4"));
  EXPECT_THROW(PkSampler({}, 2, options(4, 2)), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::train

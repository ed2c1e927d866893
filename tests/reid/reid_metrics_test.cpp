// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/reid_metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "reid/reid_fixture.h"

namespace sdmt::reid {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(ReidMetrics, AveragePrecisionByHand) {
  // Right at ranks 2 and 4: precisions 1/2 and 2/4. Trapezoids: from precision 0 at rank 1 to 1/2,
  // from 1/3 at rank 3 to 2/4, each over half of the recall.
  const auto ap = average_precision({false, true, false, true, false});
  EXPECT_DOUBLE_EQ(ap.at_hits, 0.5);
  EXPECT_DOUBLE_EQ(ap.trapezoid, 0.5 * (0.0 + 0.5) / 2 + 0.5 * (1.0 / 3 + 0.5) / 2);
  EXPECT_DOUBLE_EQ(average_precision({true, true, false}).at_hits, 1.0);
  EXPECT_DOUBLE_EQ(average_precision({true, true, false}).trapezoid, 1.0);
  EXPECT_DOUBLE_EQ(average_precision({false, false}).at_hits, 0.0);
  EXPECT_DOUBLE_EQ(average_precision({false, false}).trapezoid, 0.0);
}

TEST(ReidMetrics, SameCameraIsPassedOverAndDistractorsCount) {
  const auto query = labelled({{0.0F}}, {1}, {1});
  // By distance: the same person by the same camera (passed over), a distractor, another person by
  // the same camera, the right one.
  const auto gallery = labelled({{0.4F}, {0.1F}, {0.2F}, {0.3F}}, {1, 1, 0, 2}, {2, 1, 3, 1});
  const auto metrics = reid_metrics(query, gallery);
  ASSERT_TRUE(metrics.has_value());
  EXPECT_EQ(metrics->queries, 1);
  EXPECT_DOUBLE_EQ(metrics->rank1, 0.0);
  EXPECT_DOUBLE_EQ(metrics->rank5, 1.0);
  EXPECT_DOUBLE_EQ(metrics->map, 1.0 / 3);
}

TEST(ReidMetrics, TiesKeepTheGallerysOrder) {
  const auto query = labelled({{0.0F}}, {1}, {1});
  EXPECT_DOUBLE_EQ(reid_metrics(query, labelled({{0.5F}, {-0.5F}}, {1, 2}, {2, 2}))->rank1, 1.0);
  EXPECT_DOUBLE_EQ(reid_metrics(query, labelled({{0.5F}, {-0.5F}}, {2, 1}, {2, 2}))->rank1, 0.0);
}

TEST(ReidMetrics, QueriesWithoutMatchAreLeftOut) {
  const auto queries = labelled({{0.0F}, {0.9F}}, {1, 5}, {1, 1});
  const auto gallery = labelled({{0.1F}, {0.8F}}, {1, 2}, {2, 2});
  const auto metrics = reid_metrics(queries, gallery);
  ASSERT_TRUE(metrics.has_value());
  EXPECT_EQ(metrics->queries, 1);
  EXPECT_EQ(metrics->queries_without_match, 1);
  EXPECT_DOUBLE_EQ(metrics->rank1, 1.0);
  EXPECT_FALSE(reid_metrics(labelled({{0.0F}}, {1}, {2}), gallery).has_value());
}

TEST(ReidMetrics, AgreesWithNumpy) {
  const auto fixture = read_reid_fixture();
  const auto gallery = fixture_images(fixture);
  std::vector<std::vector<float>> rows;
  std::vector<int> pids;
  std::vector<int> camids;
  for (std::size_t i = 0; i < gallery.pids.size(); ++i) {
    if (gallery.pids[i] == 0) continue;
    const float* row = gallery.embeddings.image(static_cast<int>(i));
    rows.emplace_back(row, row + gallery.dimensions());
    pids.push_back(gallery.pids[i]);
    camids.push_back(gallery.camids[i]);
  }
  const auto metrics = reid_metrics(labelled(rows, pids, camids), gallery);
  ASSERT_TRUE(metrics.has_value());
  const auto& expected = fixture["reid"];
  EXPECT_EQ(metrics->queries, expected["queries"].get<int>());
  EXPECT_EQ(metrics->queries_without_match, expected["without"].get<int>());
  EXPECT_NEAR(metrics->rank1, expected["rank1"].get<double>(), 1e-12);
  EXPECT_NEAR(metrics->rank5, expected["rank5"].get<double>(), 1e-12);
  EXPECT_NEAR(metrics->rank10, expected["rank10"].get<double>(), 1e-12);
  EXPECT_NEAR(metrics->map, expected["map"].get<double>(), 1e-12);
  EXPECT_NEAR(metrics->map_trapezoid, expected["map_trapezoid"].get<double>(), 1e-12);
}

TEST(ReidMetrics, RefusesBadInput) {
  const auto query = labelled({{0.0F}}, {1}, {1});
  EXPECT_THAT([&] { reid_metrics(labelled({{0.0F}}, {0}, {1}), query); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("query 0 is a distractor")));
  EXPECT_THAT(
      [&] {
        reid_metrics(query, labelled({{0.0F, 0.0F}}, {1}, {1}));
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("1 dimensions and the gallery 2")));
}

}  // namespace
}  // namespace sdmt::reid

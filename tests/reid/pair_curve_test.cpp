// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/pair_curve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>
#include <stdexcept>

#include "reid/reid_fixture.h"
#include "sdmt/nn/random.h"

namespace sdmt::reid {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

void expect_figures(const Roc& roc, const nlohmann::json& expected) {
  EXPECT_EQ(roc.positives(), expected["positives"].get<std::int64_t>());
  EXPECT_EQ(roc.negatives(), expected["negatives"].get<std::int64_t>());
  EXPECT_NEAR(roc.auc(), expected["auc"].get<double>(), 1e-12);
  EXPECT_NEAR(roc.accuracy(), expected["accuracy"].get<double>(), 1e-12);
  // numpy found these by sampling the curve 200,000 times.
  EXPECT_NEAR(roc.eer(), expected["eer"].get<double>(), 1e-4);
  EXPECT_NEAR(roc.tpr_at_fpr(0.1), expected["tpr_at_fpr"]["0.1"].get<double>(), 2e-3);
  EXPECT_NEAR(roc.tpr_at_fpr(0.01), expected["tpr_at_fpr"]["0.01"].get<double>(), 2e-3);
  EXPECT_NEAR(roc.tau_a_max_accuracy(), expected["tau_a_accuracy"].get<double>(), 1e-7);
  EXPECT_NEAR(roc.tau_a_eer(), expected["tau_a_eer"].get<double>(), 1e-7);
  EXPECT_NEAR(roc.tau_a_at_fpr(0.1), expected["tau_a_at_fpr"]["0.1"].get<double>(), 1e-7);
  EXPECT_NEAR(roc.tau_a_at_fpr(0.01), expected["tau_a_at_fpr"]["0.01"].get<double>(), 1e-7);
}

TEST(PairCurve, AgreesWithNumpy) {
  const auto fixture = read_reid_fixture();
  const auto images = fixture_images(fixture);
  expect_figures(pair_curve(images).roc, fixture["person_only"]);
  expect_figures(pair_curve(images, {.set = PairSet::cross_camera}).roc, fixture["cross_camera"]);
}

TEST(PairCurve, PaperMixesEquallyManyOfEachKind) {
  const auto images = fixture_images(read_reid_fixture());
  const auto all = count_pairs(images, PairSet::paper);
  EXPECT_EQ(all.positives, 101);
  EXPECT_EQ(all.negatives, 934);
  EXPECT_EQ(all.distractors, 8 * 46);
  const auto curve = pair_curve(images, {.set = PairSet::paper});
  EXPECT_EQ(curve.counts.positives, 101);
  EXPECT_EQ(curve.counts.negatives, 101);
  EXPECT_EQ(curve.counts.distractors, 101);
  EXPECT_EQ(curve.roc.negatives(), 202);
  EXPECT_EQ(curve.identities, 9);
  EXPECT_EQ(curve.backgrounds, 8);
}

TEST(PairCurve, PaperWithoutBackgroundIsOneToOne) {
  auto images = fixture_images(read_reid_fixture());
  for (int& pid : images.pids) pid = pid == 0 ? 99 : pid;
  const auto curve = pair_curve(images, {.set = PairSet::paper});
  EXPECT_EQ(curve.counts.distractors, 0);
  EXPECT_EQ(curve.counts.positives, curve.counts.negatives);
}

TEST(PairCurve, SampleIsSeededAndWithoutReplacement) {
  const auto images = fixture_images(read_reid_fixture());
  const auto a = pair_curve(images, {.pairs = 60, .seed = 4});
  const auto b = pair_curve(images, {.pairs = 60, .seed = 4});
  const auto c = pair_curve(images, {.pairs = 60, .seed = 5});
  EXPECT_EQ(a.roc.positives(), 60);
  EXPECT_EQ(a.roc.negatives(), 60);
  EXPECT_EQ(a.roc.auc(), b.roc.auc());
  EXPECT_NE(a.roc.auc(), c.roc.auc());
  // Asked for more than there are: each pair once.
  const auto most = pair_curve(images, {.pairs = 500});
  EXPECT_EQ(most.roc.positives(), 101);
  EXPECT_EQ(most.roc.negatives(), 500);
}

TEST(PairCurve, SampleTakesEveryPairEquallyOften) {
  const auto images = labelled({{0.1F}, {0.2F}, {0.3F}, {0.5F}}, {1, 1, 1, 2}, {1, 1, 1, 1});
  std::map<float, int> taken;  // the distance names the positive pair
  for (std::uint64_t seed = 0; seed < 1200; ++seed) {
    for (const auto& pair : pair_curve(images, {.pairs = 1, .seed = seed}).pairs) {
      if (pair.first == pair.second) ++taken[std::round(pair.distance * 1000) / 1000];
    }
  }
  ASSERT_EQ(taken.size(), 2U);  // 0.1 twice (1-2, 2-3), 0.2 once (1-3)
  EXPECT_NEAR(taken.begin()->second, 800, 80);
}

// Points on the unit sphere in three dimensions, `per_id` around each centre.
LabelledEmbeddings sphere(int ids, int per_id) {
  nn::Random random(8);
  std::vector<std::vector<float>> rows;
  std::vector<int> pids;
  for (int id = 1; id <= ids; ++id) {
    const std::array<double, 3> centre = {random.normal(), random.normal(), random.normal()};
    for (int k = 0; k < per_id; ++k) {
      std::array<double, 3> p{};
      double length = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        p[c] = centre[c] + 0.4 * random.normal();
        length += p[c] * p[c];
      }
      length = std::sqrt(length);
      rows.push_back({static_cast<float>(p[0] / length), static_cast<float>(p[1] / length),
                      static_cast<float>(p[2] / length)});
      pids.push_back(id);
    }
  }
  return labelled(rows, pids, std::vector<int>(pids.size(), 1));
}

TEST(PairCurve, LargeSetsAreCountedInBinsWithoutVisibleDifference) {
  const auto images = sphere(420, 10);  // 8.8 million pairs: beyond what is listed
  const auto curve = pair_curve(images);
  EXPECT_EQ(curve.counts.positives, 420 * 45);
  EXPECT_EQ(curve.counts.negatives, 4200LL * 4199 / 2 - 420 * 45);
  EXPECT_EQ(curve.roc.negatives(), curve.counts.negatives);
  EXPECT_LT(curve.pairs.size(), 4'100'000U);

  std::vector<float> positives;
  std::vector<float> negatives;
  for (int i = 0; i < images.size(); ++i) {
    for (int j = i + 1; j < images.size(); ++j) {
      const auto d = euclidean_distance(images.embeddings.image(i), images.embeddings.image(j), 3);
      const bool same =
          images.pids[static_cast<std::size_t>(i)] == images.pids[static_cast<std::size_t>(j)];
      (same ? positives : negatives).push_back(d);
    }
  }
  const Roc exact(positives, negatives);
  EXPECT_NEAR(curve.roc.auc(), exact.auc(), 1e-6);
  EXPECT_NEAR(curve.roc.eer(), exact.eer(), 1e-5);
  EXPECT_NEAR(curve.roc.tpr_at_fpr(0.001), exact.tpr_at_fpr(0.001), 1e-4);
  EXPECT_NEAR(curve.roc.tau_a_max_accuracy(), exact.tau_a_max_accuracy(), 1e-3);

  const int threads = omp_get_max_threads();
  omp_set_num_threads(3);
  const auto again = pair_curve(
      images, {}, [](const float* a, const float* b) { return euclidean_distance(a, b, 3); });
  omp_set_num_threads(threads);
  EXPECT_EQ(curve.roc.auc(), again.roc.auc());
  EXPECT_EQ(curve.pairs.size(), again.pairs.size());
}

TEST(PairCurve, LongVectorsAreSummedWholly) {
  LabelledEmbeddings images;
  images.embeddings.resize({3, 1, 1, 3001});
  images.embeddings.fill(0.0F);
  images.embeddings.image(0)[0] = 0.6F;
  images.embeddings.image(0)[3000] = 0.8F;
  images.embeddings.image(1)[3000] = 0.8F;
  images.embeddings.image(2)[1700] = 1.0F;
  images.pids = {1, 1, 2};
  images.camids = {1, 1, 1};
  const auto curve = pair_curve(images);
  EXPECT_NEAR(curve.roc.counts().front().distance, 0.6, 1e-6);
  EXPECT_NEAR(curve.roc.counts().back().distance, std::sqrt(2.0), 1e-6);
}

TEST(PairCurve, TakesAnotherDistance) {
  const auto images = labelled({{3.0F}, {5.0F}, {4.5F}, {9.0F}}, {1, 1, 2, 2}, {1, 1, 1, 1});
  const auto curve = pair_curve(images, {}, [](const float* a, const float* b) {
    return std::abs(*a - *b) < 3.0F ? 0.25F : 0.75F;
  });
  // Of one person: 2 and 4.5 apart. Of two: 1.5, 6, 0.5, 4.
  EXPECT_DOUBLE_EQ(curve.roc.auc(), (0.5 * 2 + 2 + 0.5 * 2) / 8);
}

TEST(PairCurve, AnErrorOfTheDistanceReachesTheCaller) {
  const auto images = labelled({{3.0F}, {5.0F}, {4.5F}, {9.0F}}, {1, 1, 2, 2}, {1, 1, 1, 1});
  const PairDistance fails = [](const float*, const float*) -> float {
    throw std::runtime_error("no distance");
  };
  EXPECT_THROW(pair_curve(images, {}, fails), std::runtime_error);
}

TEST(HardestPairs, AreTheFarthestOfOneAndTheNearestOfTwoOncePerIdentity) {
  const auto images = labelled({{0.0F}, {0.5F}, {0.9F}, {0.45F}, {0.2F}, {0.7F}},
                               {1, 1, 1, 2, 2, 0}, {1, 1, 1, 1, 1, 1});
  const auto hardest = hardest_pairs(images, 10);
  ASSERT_EQ(hardest.positives.size(), 2U);
  EXPECT_NEAR(hardest.positives[0].distance, 0.9, 1e-6);
  EXPECT_NEAR(hardest.positives[1].distance, 0.25, 1e-6);
  ASSERT_EQ(hardest.negatives.size(), 1U);  // one pair of identities; background takes no part
  EXPECT_NEAR(hardest.negatives[0].distance, 0.05, 1e-6);
}

TEST(PairCurve, RefusesWhatHasNoCurve) {
  const auto one_person = labelled({{0.0F}, {0.5F}}, {7, 7}, {1, 2});
  EXPECT_THAT([&] { pair_curve(one_person); },
              ThrowsMessage<std::invalid_argument>(
                  HasSubstr("no pair of images of two people among 2 images of 1 person")));
  const auto one_each = labelled({{0.0F}, {0.5F}}, {1, 2}, {1, 1});
  EXPECT_THAT([&] { pair_curve(one_each); },
              ThrowsMessage<std::invalid_argument>(
                  HasSubstr("no pair of images of one person among 2 images of 2 people")));
  EXPECT_THAT([&] { pair_curve(one_person, {.pairs = -1}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("pairs is -1")));
  EXPECT_THAT(
      [&] {
        pair_curve(labelled({{2.0F}, {0.0F}}, {1, 1}, {1, 1}));
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("row 0 has length 2")));
  EXPECT_THAT(
      [&] {
        pair_curve(labelled({{NAN}, {0.0F}}, {1, 1}, {1, 1}));
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("row 0 has a value that is not finite")));
  EXPECT_THAT(
      [&] {
        pair_curve(labelled({{0.0F}, {0.0F}}, {1}, {1, 1}));
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("2 rows with 1 pids")));
}

}  // namespace
}  // namespace sdmt::reid

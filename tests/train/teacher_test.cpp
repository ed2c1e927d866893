// SPDX-License-Identifier: Apache-2.0
// Learning from another network's vectors: the loss, the projection, the file, the training.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "principal_axes.h"
#include "reid/temporary_data.h"
#include "sdmt/io/safetensors.h"
#include "sdmt/train/teacher_loss.h"
#include "sdmt/train/trainer.h"
#include "train/training_fixture.h"
#include "weight_average.h"

namespace sdmt::train {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

// ---- the loss

std::vector<double> unit_rows(int rows, int size, std::uint64_t seed) {
  nn::Random random(seed);
  std::vector<double> values;
  for (int i = 0; i < rows; ++i) {
    std::vector<double> row;
    double square = 0;
    for (int k = 0; k < size; ++k) {
      row.push_back(random.normal());
      square += row.back() * row.back();
    }
    for (const double value : row) values.push_back(value / std::sqrt(square));
  }
  return values;
}

TEST(TeacherLoss, ItsGradientIsThatOfDifferencesWithTheIdentitiesLoss) {
  constexpr int kImages = 10, kLabelled = 6, kSize = 5;
  const std::vector<int> labels = {0, 0, 1, 1, 2, 2}, samples = {0, 1, 2, 3, 4, 5};
  BatchHardOptions metric;
  metric.kind = LossKind::triplet;
  for (const auto& [match, teacher_size] :
       {std::pair(TeacherMatch::projection, kSize), std::pair(TeacherMatch::relations, 7),
        std::pair(TeacherMatch::similarities, kSize)}) {
    std::vector<double> e = unit_rows(kImages, kSize, 1);
    const std::vector<double> teacher = unit_rows(kImages, teacher_size, 2);
    constexpr double kWeight = 0.7;
    std::vector<double> gradient(e.size());
    // As Trainer::step() adds them: the identities' loss on the first rows only.
    const auto total = [&] {
      std::fill(gradient.begin(), gradient.end(), 0.0);
      const auto labelled = std::span<double>(e).first(kLabelled * kSize);
      const double loss = batch_hard_loss<double>(labelled, labels, samples, metric,
                                                  std::span(gradient).first(kLabelled * kSize))
                              .loss;
      return loss + kWeight * teacher_loss<double>(e, teacher, kImages, match, kWeight, gradient);
    };
    total();
    const std::vector<double> analytic = gradient;
    for (std::size_t k = 0; k < e.size(); ++k) {
      constexpr double kStep = 1e-6;
      const double at = e[k];
      e[k] = at + kStep;
      const double above = total();
      e[k] = at - kStep;
      const double below = total();
      e[k] = at;
      EXPECT_NEAR(analytic[k], (above - below) / (2 * kStep), 1e-8) << k;
    }
  }
}

TEST(TeacherLoss, IsItsDefinition) {
  constexpr int kImages = 4, kSize = 3;
  const auto e = unit_rows(kImages, kSize, 3), t = unit_rows(kImages, kSize, 4);
  std::vector<double> gradient(e.size());
  const auto row_dot = [](const std::vector<double>& a, const std::vector<double>& b, int i,
                          int j) {
    double sum = 0;
    for (int k = 0; k < kSize; ++k) sum += a.at(i * kSize + k) * b.at(j * kSize + k);
    return sum;
  };
  double squares = 0, relations = 0;
  for (std::size_t k = 0; k < e.size(); ++k) squares += (e[k] - t[k]) * (e[k] - t[k]);
  for (int i = 0; i < kImages; ++i) {
    for (int j = 0; j < i; ++j) {
      relations += std::pow(row_dot(e, e, i, j) - row_dot(t, t, i, j), 2);
    }
  }
  EXPECT_NEAR(teacher_loss<double>(e, t, kImages, TeacherMatch::projection, 1, gradient),
              squares / 4, 1e-12);
  EXPECT_NEAR(teacher_loss<double>(e, t, kImages, TeacherMatch::relations, 1, gradient),
              relations / 6, 1e-12);
  double divergence = 0;
  for (int i = 0; i < kImages; ++i) {
    double ours = 0, theirs = 0;
    for (int j = 0; j < kImages; ++j) {
      ours += std::exp(10 * row_dot(e, t, i, j));
      theirs += std::exp(10 * row_dot(t, t, i, j));
    }
    for (int j = 0; j < kImages; ++j) {
      const double q = std::exp(10 * row_dot(t, t, i, j)) / theirs;
      divergence += q * std::log(q / (std::exp(10 * row_dot(e, t, i, j)) / ours));
    }
  }
  EXPECT_NEAR(teacher_loss<double>(e, t, kImages, TeacherMatch::similarities, 1, gradient),
              divergence / 4, 1e-12);
  EXPECT_NEAR(teacher_loss<double>(t, t, kImages, TeacherMatch::similarities, 1, gradient), 0,
              1e-12);
  for (const auto match : {TeacherMatch::projection, TeacherMatch::similarities}) {
    EXPECT_THROW(teacher_loss<double>(e, unit_rows(kImages, 4, 1), kImages, match, 1, gradient),
                 std::invalid_argument);
  }
  EXPECT_THROW(teacher_loss<double>(e, t, 5, TeacherMatch::relations, 1, gradient),
               std::invalid_argument);
}

// ---- the projection

TEST(PrincipalAxes, KeepWhatLiesInFewDirections) {
  // 40 vectors in a random 3-dimensional subspace of 9 dimensions: three axes lose nothing.
  constexpr int kCount = 40, kSize = 9, kInner = 3;
  const auto basis = unit_rows(kInner, kSize, 5), factors = unit_rows(kCount, kInner, 6);
  nn::Tensor vectors({kCount, 1, 1, kSize});
  for (int i = 0; i < kCount; ++i) {
    double square = 0;
    std::vector<double> row(kSize);
    for (int k = 0; k < kSize; ++k) {
      for (int b = 0; b < kInner; ++b) {
        row[k] += factors.at(i * kInner + b) * basis.at(b * kSize + k);
      }
      square += row[k] * row[k];
    }
    for (int k = 0; k < kSize; ++k) {
      vectors.image(i)[k] = static_cast<float>(row[k] / std::sqrt(square));
    }
  }
  const auto dot = [](const nn::Tensor& t, int i, int j) {
    double sum = 0;
    for (int k = 0; k < t.shape().c; ++k) sum += t.image(i)[k] * t.image(j)[k];
    return sum;
  };
  const Projection three = project(vectors, kInner), many = project(vectors, 20);
  EXPECT_NEAR(three.kept, 1, 1e-9);
  for (int i = 0; i < kCount; ++i) {
    for (int j = 0; j <= i; ++j) {
      EXPECT_NEAR(dot(three.rows, i, j), dot(vectors, i, j), 1e-5);
      EXPECT_NEAR(dot(many.rows, i, j), dot(vectors, i, j), 1e-5);
    }
  }
  // Two axes keep less, but no two coordinates hold more than they do.
  const Projection two = project(vectors, 2);
  EXPECT_LT(two.kept, 1 - 1e-6);
  for (int a = 0; a < kSize; ++a) {
    for (int b = 0; b < a; ++b) {
      double held = 0;
      for (int i = 0; i < kCount; ++i) {
        held +=
            vectors.image(i)[a] * vectors.image(i)[a] + vectors.image(i)[b] * vectors.image(i)[b];
      }
      EXPECT_GT(two.kept, held / kCount);
    }
  }
}

TEST(PrincipalAxes, AreThoseOfAKnownSpectrum) {
  // Multiples of the unit vectors: axis k occurs 9 - k times.
  constexpr int kSize = 6;
  std::vector<int> axis;
  for (int k = 0; k < kSize; ++k) axis.insert(axis.end(), static_cast<std::size_t>(9 - k), k);
  nn::Tensor vectors({static_cast<int>(axis.size()), 1, 1, kSize});
  for (int i = 0; i < vectors.shape().n; ++i) vectors.image(i)[axis.at(i)] = 1;
  const Projection projection = project(vectors, 4);
  EXPECT_NEAR(projection.kept, (9.0 + 8 + 7 + 6) / (9 + 8 + 7 + 6 + 5 + 4), 1e-12);
  for (int i = 0; i < vectors.shape().n; ++i) {
    for (int k = 0; k < 4; ++k) {
      EXPECT_NEAR(std::abs(projection.rows.image(i)[k]), axis.at(i) == k ? 1 : 0, 1e-6);
    }
  }
}

TEST(PrincipalAxes, ThreadsDoNotChangeThem) {
  nn::Tensor vectors({50, 1, 1, 24});
  const auto rows = unit_rows(50, 24, 7);
  std::copy(rows.begin(), rows.end(), vectors.data());
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const Projection one = project(vectors, 8);
  omp_set_num_threads(3);
  const Projection three = project(vectors, 8);
  omp_set_num_threads(threads);
  EXPECT_TRUE(std::ranges::equal(one.rows.values(), three.rows.values()));
}

// ---- the average

TEST(WeightAverage, IsTheRecursionItSaysItIs) {
  nn::Tensor value({1, 1, 1, 2});
  const std::vector<nn::NamedTensor> state = {{"w", &value}};
  WeightAverage average(0.6);
  average.start(state);
  double expected = 0;
  for (int t = 1; t <= 20; ++t) {
    value.fill(static_cast<float>(t * t));
    average.add(state, t);
    const double decay = std::min(0.6, (1.0 + t) / (10 + t));
    expected = decay * expected + (1 - decay) * t * t;
    EXPECT_NEAR(average.values().front().data()[1], expected, 1e-4 * expected);
  }
  average.swap(state);
  EXPECT_NEAR(value.data()[0], expected, 1e-4 * expected);
  EXPECT_EQ(average.values().front().data()[0], 400);
  average.swap(state);
  EXPECT_EQ(value.data()[0], 400);
}

// ---- the training

void write_vectors(const fs::path& path, const std::vector<std::string>& images,
                   const std::vector<float>& values) {
  io::SafetensorsWriter writer;
  writer.set_metadata("images", nlohmann::json(images).dump());
  writer.add("embeddings", {images.size(), values.size() / images.size()}, values);
  writer.write(path);
}

class TeacherTest : public testing::Test {
 protected:
  void SetUp() override {
    threads_ = omp_get_max_threads();
    omp_set_num_threads(1);
    data_.write_people(6, 4, "people");
    data_.write_people(3, 5, "others");
    for (const char* folder : {"people", "others"}) {
      for (const auto& entry : fs::directory_iterator(data_.path() / folder)) {
        images_.push_back(entry.path().string());
      }
    }
    std::sort(images_.begin(), images_.end());
    options_.folders = {data_.path() / "people"};
    options_.unlabelled_folders = {data_.path() / "others"};
    options_.teachers = {data_.path() / "teacher"};
    teach(24);
  }
  void TearDown() override { omp_set_num_threads(threads_); }

  // A teacher whose vector is the first of its colours that a picture has, in `dimensions` random
  // directions: something that can be learnt.
  void teach(int dimensions) {
    const auto basis = unit_rows(6, dimensions, 9);
    std::vector<float> values;
    for (const auto& path : images_) {
      const auto image = media::read_image(path);
      for (int k = 0; k < dimensions; ++k) {
        double value = 0;
        for (int c = 0; c < 6; ++c) {
          const std::uint8_t* pixel = image.pixel(4, c < 3 ? 4 : 28);
          value += (pixel[c % 3] / 255.0 - 0.4) * basis.at(c * dimensions + k);
        }
        values.push_back(static_cast<float>(value));
      }
    }
    write_vectors(options_.teachers.front(), images_, values);
  }

  static TrainerOptions trainer_options() {
    TrainerOptions options = small_options("conv1_1");
    options.iterations = 40;
    options.unlabelled_batch = 6;
    options.teacher_weight = 3;
    return options;
  }

  std::string refusal() const {
    return message_of([&] { load_training_set(options_); });
  }

  reid::TemporaryData data_;
  std::vector<std::string> images_;
  TrainingSetOptions options_;
  int threads_ = 1;
};

TEST_F(TeacherTest, AStudentLearnsTheTeachersVectors) {
  for (const auto& [match, dimensions] :
       {std::pair(TeacherMatch::projection, 24), std::pair(TeacherMatch::projection, 200),
        std::pair(TeacherMatch::relations, 200), std::pair(TeacherMatch::similarities, 200)}) {
    teach(dimensions);
    TrainerOptions options = trainer_options();
    options.teacher_match = match;
    options.iterations = 250;
    options.learning_rate = 0.03;
    options.first_trained = "fc1";
    options.views = 1;
    reid::Model model = small_model();
    Trainer trainer(model, load_training_set(options_), options);
    trainer.prepare({});
    const double start = trainer.step().teacher_loss.value();
    double end = start;
    while (!trainer.finished()) end = trainer.step().teacher_loss.value();
    EXPECT_LT(end, start / 5) << dimensions;
    EXPECT_GT(trainer.teacher_kept(), 0.999);  // six directions, whatever the dimensions
  }
}

TEST_F(TeacherTest, ImagesWithoutIdentitiesBringNoIdentity) {
  const TrainingSet set = load_training_set(options_);
  EXPECT_EQ(set.identities.size(), 6u);
  EXPECT_EQ(set.images.size(), 6u * 4 + 3 * 5);
  EXPECT_EQ(set.unlabelled.size(), 15u);
  EXPECT_EQ(set.unlabelled.front(), 24);
  EXPECT_EQ(set.teacher.shape(), (nn::Shape{39, 1, 1, 24}));
  // What the identities' loss sees is the same with and without them.
  const auto first_loss = [&](int unlabelled) {
    TrainerOptions options = trainer_options();
    options.unlabelled_batch = unlabelled;
    options.first_trained = "fc1";
    options.views = 1;
    reid::Model model = small_model();
    Trainer trainer(model, set, options);
    trainer.prepare({});
    return trainer.step();
  };
  EXPECT_EQ(first_loss(0).mining.mean_distance > 0, true);
  EXPECT_NE(first_loss(0).teacher_loss, first_loss(6).teacher_loss);
}

TEST_F(TeacherTest, ResumedItEndsInTheSameBytesOnAnyNumberOfThreads) {
  TrainerOptions options = trainer_options();
  options.iterations = 6;
  options.average = 0.8;
  options.augmentation.gamma = options.augmentation.offset = 0.2;
  options.augmentation.noise = 4;
  options.augmentation.grey_patch = options.augmentation.crop = 0.5;
  options_.holdout_identities = 2;
  options.identities = 3;
  TrainerOptions relations = options;
  relations.teacher_match = TeacherMatch::relations;
  relations.first_trained = "fc1";
  TrainerOptions similarities = options;
  similarities.teacher_match = TeacherMatch::similarities;
  for (const TrainerOptions& each : {options, relations, similarities}) {
    const auto checkpoint = data_.path() / "checkpoint";
    const std::string whole = train_set(load_training_set(options_), each).bytes;
    train_set(load_training_set(options_), each, 4, checkpoint);
    omp_set_num_threads(3);
    EXPECT_EQ(train_set(load_training_set(options_), each, 1000, {}, checkpoint).bytes, whole);
    omp_set_num_threads(1);
    // Every new setting guards the checkpoint.
    const auto refused = [&](const std::function<void(TrainerOptions&)>& change) {
      TrainerOptions other = each;
      change(other);
      return message_of([&] { train_set(load_training_set(options_), other, 5, {}, checkpoint); });
    };
    EXPECT_THAT(refused([](auto& o) { o.average = 0.7; }), HasSubstr("average = 0.8"));
    EXPECT_THAT(refused([](auto& o) { o.average = 0; }), HasSubstr("average = 0.8"));
    EXPECT_THAT(refused([](auto& o) { o.teacher_weight = 1; }), HasSubstr("teacher_weight = 3"));
    EXPECT_THAT(refused([](auto& o) { o.unlabelled_batch = 2; }),
                HasSubstr("unlabelled_batch = 6"));
    EXPECT_THAT(refused([](auto& o) {
                  o.teacher_match = o.teacher_match == TeacherMatch::relations
                                        ? TeacherMatch::projection
                                        : TeacherMatch::relations;
                }),
                HasSubstr("teacher_match = "));
    EXPECT_THAT(refused([](auto& o) { o.augmentation.gamma = 0; }), HasSubstr("gamma = 0.2"));
    EXPECT_THAT(refused([](auto& o) { o.augmentation.offset = 0; }), HasSubstr("offset = 0.2"));
    EXPECT_THAT(refused([](auto& o) { o.augmentation.noise = 0; }), HasSubstr("noise = 4"));
    EXPECT_THAT(refused([](auto& o) { o.augmentation.crop = 0; }), HasSubstr("crop = 0.5"));
    EXPECT_THAT(refused([](auto& o) { o.augmentation.grey_patch = 0; }),
                HasSubstr("grey_patch = 0.5"));
    TrainingSetOptions other_teacher = options_;
    teach(23);
    EXPECT_THAT(
        message_of([&] { train_set(load_training_set(other_teacher), each, 5, {}, checkpoint); }),
        HasSubstr("made with teacher = "));
    teach(24);
  }
}

TEST_F(TeacherTest, TheAverageIsWhatIsValidatedAndKept) {
  TrainerOptions options = trainer_options();
  options.iterations = 5;
  options_.holdout_identities = 2;
  options.identities = 4;
  options.learning_rate = 0.01;
  const auto plain = train_set(load_training_set(options_), options);
  options.average = 0.9;
  const auto averaged = train_set(load_training_set(options_), options);
  EXPECT_EQ(plain.losses, averaged.losses);  // the training itself goes on as without
  EXPECT_NE(plain.bytes, averaged.bytes);
}

TEST_F(TeacherTest, AFileThatDoesNotFitIsRefused) {
  const auto rewrite = [&](const std::vector<std::string>& images, float value = 1) {
    write_vectors(options_.teachers.front(), images, std::vector<float>(images.size() * 3, value));
  };
  auto images = images_;
  images.erase(images.begin() + 20);  // of the people, who come second in this order
  rewrite(images);
  EXPECT_THAT(refusal(), HasSubstr("teacher: has no vector of " + images_[20]));
  images = images_;
  images.push_back("elsewhere/people/" + fs::path(images_.back()).filename().string());
  rewrite(images);
  EXPECT_THAT(refusal(), HasSubstr("has more than one vector of people/0006_c"));
  images.back() = "elsewhere/persons/" + fs::path(images_.back()).filename().string();
  rewrite(images);
  EXPECT_EQ(refusal(), "no exception");  // more than is needed
  images.back() = "";
  for (auto& image : images) image = fs::path(image).lexically_relative(data_.path()).string();
  rewrite(images);
  EXPECT_EQ(refusal(), "no exception");  // known by the folder's name and what follows
  rewrite(images, 0);
  EXPECT_THAT(refusal(), HasSubstr("is 0"));
  rewrite(images, std::nanf(""));
  EXPECT_THAT(refusal(), HasSubstr("is not finite"));

  io::SafetensorsWriter writer;
  const std::vector<float> row(3);
  writer.add("embeddings", {1, 3}, row);
  writer.write(options_.teachers.front());
  EXPECT_THAT(refusal(), HasSubstr("metadata `images`"));
  writer.set_metadata("images", R"(["a","b"])");
  writer.write(options_.teachers.front());
  EXPECT_THAT(refusal(), HasSubstr("embeddings has 1 rows, but `images` names 2"));

  options_.teachers.clear();
  EXPECT_THAT(refusal(), HasSubstr("nothing teaches images without identities"));
}

TEST_F(TeacherTest, FoldersOfOneNameAreNeverMixedUp) {
  data_.write_people(4, 2, "second/people");
  options_.folders.push_back(data_.path() / "second/people");
  EXPECT_THAT(refusal(), HasSubstr("are both known as people/0001_c"));
  // The same folder with and without names is no collision.
  options_.folders.pop_back();
  options_.unlabelled_folders.push_back(data_.path() / "people");
  EXPECT_EQ(load_training_set(options_).unlabelled.size(), 15u + 24);
}

TEST_F(TeacherTest, SeveralFilesAreOneTeacher) {
  const std::vector<std::string> first(images_.begin(), images_.begin() + 20),
      second(images_.begin() + 20, images_.end());
  write_vectors(data_.path() / "a", first, std::vector<float>(first.size() * 3, 1));
  write_vectors(data_.path() / "b", second, std::vector<float>(second.size() * 3, 2));
  options_.teachers = {data_.path() / "a", data_.path() / "b"};
  EXPECT_EQ(load_training_set(options_).teacher.shape().c, 3);
  write_vectors(data_.path() / "b", second, std::vector<float>(second.size() * 4, 2));
  EXPECT_THAT(refusal(), HasSubstr("b: has vectors of 4 values, expected 3"));
}

TEST_F(TeacherTest, OptionsAreCheckedByName) {
  const auto refused = [&](const std::function<void(TrainerOptions&)>& change) {
    TrainerOptions options = trainer_options();
    change(options);
    return message_of([&] {
      reid::Model model = small_model();
      Trainer trainer(model, load_training_set(options_), options);
    });
  };
  EXPECT_THAT(refused([](auto& o) { o.teacher_weight = 0; }), HasSubstr("teacher_weight is 0"));
  EXPECT_THAT(refused([](auto& o) { o.unlabelled_batch = -1; }),
              HasSubstr("unlabelled_batch is -1"));
  EXPECT_THAT(refused([](auto& o) { o.unlabelled_batch = 16; }),
              HasSubstr("unlabelled_batch is 16, but there are 15"));
  EXPECT_THAT(refused([](auto& o) { o.average = 1; }), HasSubstr("average is 1"));
}

}  // namespace
}  // namespace sdmt::train

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/training_set.h"

#include <algorithm>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

#include "hash.h"
#include "patches.h"
#include "random_stream.h"
#include "sdmt/reid/image_vectors.h"
#include "shared_blocks.h"

namespace sdmt::train {

namespace {

namespace fs = std::filesystem;

// People in the order of their pid, each with images in the order of the folder.
using People = std::map<int, std::vector<reid::ReidImage>>;

People by_person(std::vector<reid::ReidImage> images, reid::LeftOut& left_out) {
  People people;
  for (auto& image : images) {
    if (image.pid != reid::kDistractorPid) {
      people[image.pid].push_back(std::move(image));
    } else {
      ++left_out.background;
    }
  }
  return people;
}

People list_people(const fs::path& root, reid::LeftOut& left_out) {
  const fs::path folder = reid::split_folder(root, reid::Split::train);
  return by_person(reid::list_reid_images(folder, &left_out), left_out);
}

// Adds the names of one folder's files, in order, to a fingerprint; returns their number.
std::size_t hash_files(const People& people, std::uint64_t& state) {
  std::size_t count = 0;
  for (const auto& [pid, list] : people) {
    for (const auto& image : list) hash(state, image.path.filename().string());
    count += list.size();
  }
  hash(state, "end of folder");
  return count;
}

// Moves `count` people drawn by the seed out of `people`.
People hold_out(People& people, int count, std::uint64_t seed, int source) {
  std::vector<int> pids;
  for (const auto& [pid, images] : people) pids.push_back(pid);
  auto random = random_stream(seed, Purpose::holdout, static_cast<std::uint64_t>(source));
  random.shuffle(std::span<int>(pids));
  People held;
  for (std::size_t i = 0; i < pids.size() && i < static_cast<std::size_t>(count); ++i) {
    held.insert(people.extract(pids[i]));
  }
  return held;
}

// Every k-th person, so that no more than `limit` images remain.
People thin(People people, int limit) {
  std::size_t images = 0;
  for (const auto& [pid, list] : people) images += list.size();
  const std::size_t step =
      (images + static_cast<std::size_t>(limit) - 1) / static_cast<std::size_t>(limit);
  std::size_t at = 0;
  std::erase_if(people, [&](const auto&) { return at++ % std::max<std::size_t>(step, 1) != 0; });
  return people;
}

// A folder of images without identities, as one person.
People list_unlabelled(const fs::path& root, reid::LeftOut& left_out) {
  return {{0, reid::list_nameless_images(reid::split_folder(root, reid::Split::train), &left_out)}};
}

void require_visible(const image::Image& image, const fs::path& path) {
  if (image.width >= kSmallestImage && image.height >= kSmallestImage) return;
  throw std::invalid_argument(path.string() + ": is " + std::to_string(image.width) + "x" +
                              std::to_string(image.height) + " pixels, expected at least 2x2");
}

struct DecodedImage {
  image::Image image;
  fs::path path;
};

class Decoder {
 public:
  Decoder(std::size_t total, nn::ProcessGroup& group) : unreadable_(total), group_(group) {}

  // The images of each person that can be read; those of others' share are empty.
  std::vector<std::vector<DecodedImage>> decode(const People& people) {
    std::vector<fs::path> paths;
    for (const auto& [pid, list] : people) {
      for (const auto& image : list) paths.push_back(image.path);
    }
    auto decoded = read_share(paths);
    const auto readable = readable_to_all(decoded);
    std::vector<std::vector<DecodedImage>> result;
    std::size_t at = 0;
    for (const auto& [pid, list] : people) {
      auto& images = result.emplace_back();
      for (std::size_t i = 0; i < list.size(); ++i, ++at) {
        if (readable[at]) {
          images.push_back({std::move(*decoded[at]), std::move(paths[at])});
        } else {
          unreadable_.add(paths[at]);
        }
      }
    }
    return result;
  }

  const std::vector<fs::path>& unreadable() const { return unreadable_.paths(); }

 private:
  // In the places of other shares there is an empty image.
  std::vector<std::optional<image::Image>> read_share(const std::vector<fs::path>& paths) const {
    std::vector<fs::path> here;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      if (in_share(static_cast<std::int64_t>(i), group_)) here.push_back(paths[i]);
    }
    auto decoded = media::read_images(here);
    std::vector<std::optional<image::Image>> all(paths.size(), image::Image());
    std::size_t next = 0;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      if (!in_share(static_cast<std::int64_t>(i), group_)) continue;
      all[i] = std::move(decoded[next++]);
      if (all[i]) require_visible(*all[i], paths[i]);
    }
    return all;
  }

  // Whether each image can be read by the process whose share it is in.
  std::vector<bool> readable_to_all(const std::vector<std::optional<image::Image>>& here) const {
    const std::size_t count = here.size();
    std::vector<std::byte> failed(count * static_cast<std::size_t>(group_.size()));
    std::vector<std::size_t> bounds;
    for (int rank = 0; rank <= group_.size(); ++rank) bounds.push_back(rank * count);
    for (std::size_t i = 0; i < count; ++i) {
      failed[bounds[group_.rank()] + i] = std::byte{!here[i].has_value()};
    }
    group_.gather(failed, bounds);
    std::vector<bool> readable(count, true);
    for (std::size_t i = 0; i < failed.size(); ++i) {
      if (failed[i] != std::byte{0}) readable[i % count] = false;
    }
    return readable;
  }

  media::UnreadableImages unreadable_;
  nn::ProcessGroup& group_;
};

ValidationSet make_validation_set(std::string name, const People& people, Decoder& decoder) {
  ValidationSet set;
  set.name = std::move(name);
  bool has_pair = false;
  int label = 0;
  for (auto& images : decoder.decode(people)) {
    has_pair |= images.size() > 1;
    for (auto& [image, path] : images) {
      set.images.push_back(std::move(image));
      set.files.push_back(std::move(path));
      set.labels.push_back(label);
    }
    ++label;
  }
  if (!has_pair || set.labels.empty() || set.labels.front() == set.labels.back()) {
    throw std::invalid_argument(set.name + ": validation needs two people, one of them twice");
  }
  return set;
}

// Where the images of a training set are from, for the teacher.
struct Origins {
  std::vector<fs::path> paths;
  std::vector<fs::path> roots;
};

// Moves one person's images behind those of the set; returns their indices.
std::vector<int> add_images(TrainingSet& set, std::vector<DecodedImage>& images,
                            const fs::path& root, Origins& origins) {
  std::vector<int> indices;
  for (auto& [image, path] : images) {
    indices.push_back(static_cast<int>(set.images.size()));
    set.images.push_back(std::move(image));
    origins.paths.push_back(std::move(path));
    origins.roots.push_back(root);
  }
  return indices;
}

void add_identities(TrainingSet& set, const People& people, int source, const fs::path& root,
                    Decoder& decoder, Origins& origins) {
  auto decoded = decoder.decode(people);
  auto person = decoded.begin();
  for (const auto& [pid, list] : people) {
    auto& images = *person++;
    if (images.empty()) continue;
    set.identities.push_back({source, pid, add_images(set, images, root, origins)});
  }
}

void require_pairs(const TrainingSet& set, const fs::path& first_folder) {
  if (set.identities.size() < 2) {
    throw std::invalid_argument(first_folder.string() + ": " +
                                std::to_string(set.identities.size()) +
                                " identities to train on, expected at least 2");
  }
  const bool has_pair = std::any_of(set.identities.begin(), set.identities.end(),
                                    [](const Identity& i) { return i.images.size() > 1; });
  if (!has_pair) {
    throw std::invalid_argument(first_folder.string() +
                                ": every identity has one image only, expected at least one with "
                                "two: without them there is no pair of the same person");
  }
}

std::string set_name(const fs::path& folder) {
  const auto name = folder.filename();
  return (name.empty() ? folder.parent_path().filename() : name).string();
}

}  // namespace

void TrainingSetOptions::validate() const {
  if (folders.empty()) throw std::invalid_argument("folders is empty, expected at least one");
  if (!unlabelled_folders.empty() && teachers.empty()) {
    throw std::invalid_argument("unlabelled_folders is " + unlabelled_folders.front().string() +
                                ", but nothing teaches images without identities: expected a "
                                "file in teachers");
  }
  if (holdout_identities < 0) {
    throw std::invalid_argument("holdout_identities is " + std::to_string(holdout_identities) +
                                ", expected >= 0");
  }
  if (max_validation_images < 2) {
    throw std::invalid_argument("max_validation_images is " +
                                std::to_string(max_validation_images) + ", expected >= 2");
  }
}

TrainingSet load_training_set(const TrainingSetOptions& options, nn::ProcessGroup& group) {
  options.validate();
  TrainingSet set;
  std::vector<People> training;
  std::vector<std::pair<std::string, People>> validation;
  std::size_t total = 0;
  for (const auto& root : options.folders) {
    set.sources.push_back(set_name(root));
    auto& people = training.emplace_back(list_people(root, set.left_out));
    if (options.holdout_identities > 0) {
      const int source = static_cast<int>(training.size()) - 1;
      auto held = hold_out(people, options.holdout_identities, options.seed, source);
      validation.emplace_back(set.sources.back() + " (held out)", std::move(held));
    }
    total += hash_files(people, set.fingerprint);
  }
  std::vector<People> unlabelled;
  for (const auto& root : options.unlabelled_folders) {
    total +=
        hash_files(unlabelled.emplace_back(list_unlabelled(root, set.left_out)), set.fingerprint);
  }
  reid::LeftOut ignored;  // what validation leaves out is no loss
  for (const auto& root : options.validation_folders) {
    validation.emplace_back(set_name(root), by_person(reid::list_validation_images(root), ignored));
  }
  for (auto& [name, people] : validation) {
    people = thin(std::move(people), options.max_validation_images);
    total += hash_files(people, set.validation_fingerprint);
  }

  Decoder decoder(total, group);
  Origins origins;
  for (std::size_t source = 0; source < training.size(); ++source) {
    add_identities(set, training[source], static_cast<int>(source), options.folders[source],
                   decoder, origins);
  }
  require_pairs(set, options.folders.front());
  for (std::size_t source = 0; source < unlabelled.size(); ++source) {
    for (auto& images : decoder.decode(unlabelled[source])) {
      const auto added = add_images(set, images, options.unlabelled_folders[source], origins);
      set.unlabelled.insert(set.unlabelled.end(), added.begin(), added.end());
    }
  }
  if (!options.teachers.empty()) {
    set.teacher = reid::image_vectors(options.teachers, origins.paths, origins.roots);
  }
  set.files = std::move(origins.paths);
  for (const auto& [name, people] : validation) {
    set.validation.push_back(make_validation_set(name, people, decoder));
  }
  set.unreadable = decoder.unreadable();
  return set;
}

}  // namespace sdmt::train

// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/sequence.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

#include "sdmt/io/delimited_text.h"

namespace sdmt::mot {

namespace fs = std::filesystem;

namespace {

bool is_hidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

// Names of the form PREFIX NUMBER EXTENSION.
struct NumberedImages {
  int count = 0;
  int smallest = std::numeric_limits<int>::max();
  int largest = 0;
  std::size_t fewest_digits = std::numeric_limits<std::size_t>::max();

  void add(std::string_view digits) {
    int number = 0;
    const auto end = digits.data() + digits.size();
    if (std::from_chars(digits.data(), end, number).ec != std::errc()) return;
    ++count;
    smallest = std::min(smallest, number);
    largest = std::max(largest, number);
    fewest_digits = std::min(fewest_digits, digits.size());
  }
};

// Nothing where there is no such folder; one that cannot be listed is not taken for empty.
fs::directory_iterator files_of(const fs::path& folder) {
  std::error_code error;
  fs::directory_iterator files(folder, error);
  const bool missing =
      error == std::errc::no_such_file_or_directory || error == std::errc::not_a_directory;
  if (error && !missing) {
    throw std::runtime_error(folder.string() + ": cannot be listed: " + error.message());
  }
  return files;
}

std::map<std::pair<std::string, std::string>, NumberedImages> numbered_images(
    const fs::path& folder) {
  std::map<std::pair<std::string, std::string>, NumberedImages> found;
  for (const auto& entry : files_of(folder)) {
    if (is_hidden(entry.path()) || !is_image_name(entry.path())) continue;
    const std::string stem = entry.path().stem().string();
    const std::size_t digits = stem.find_last_not_of("0123456789") + 1;
    if (digits == stem.size()) continue;
    found[{stem.substr(0, digits), entry.path().extension().string()}].add(
        std::string_view(stem).substr(digits));
  }
  return found;
}

// Takes the numbering of the images that there are most of: those of imExt, if there are any.
void read_numbering(Sequence& sequence) {
  const auto found = numbered_images(sequence.folder / sequence.image_folder);
  const auto rank = [&](const auto& entry) {
    return std::pair(entry.first.second == sequence.image_extension, entry.second.count);
  };
  const auto best = std::max_element(
      found.begin(), found.end(), [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  if (best == found.end() || best->second.count == 0) return;
  const NumberedImages& images = best->second;
  std::tie(sequence.image_prefix, sequence.image_extension) = best->first;
  sequence.image_digits = static_cast<int>(images.fewest_digits);
  const bool shifted =
      images.largest > sequence.length && images.largest - images.smallest < sequence.length;
  sequence.first_image = images.smallest == 0 || shifted ? images.smallest : 1;
  sequence.last_image_frame = images.largest - sequence.first_image + 1;
}

}  // namespace

bool is_image_name(const fs::path& path) {
  static const std::set<std::string> kExtensions{".jpg", ".jpeg", ".png",  ".bmp",
                                                 ".ppm", ".tif",  ".tiff", ".webp"};
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return kExtensions.contains(extension);
}

bool Sequence::is_sequence(const fs::path& path) {
  std::error_code error;
  const auto status = fs::status(path / "seqinfo.ini", error);
  if (status.type() == fs::file_type::none) {
    throw std::runtime_error((path / "seqinfo.ini").string() + ": " + error.message());
  }
  return fs::is_regular_file(status);
}

Sequence Sequence::read(const fs::path& folder) {
  const fs::path path = folder / "seqinfo.ini";
  Sequence sequence;
  sequence.folder = folder;
  const fs::path plain = fs::path(folder / "").parent_path();  // without a trailing separator
  sequence.name = plain.filename().string();
  io::for_each_line(io::read_text(path), [&](std::size_t number, std::string_view line) {
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos) return;  // section heading
    const std::string_view key = line.substr(0, line.find_last_not_of(" \t", equals - 1) + 1);
    const std::size_t start = line.find_first_not_of(" \t", equals + 1);
    const std::string_view text =
        start == std::string_view::npos ? std::string_view() : line.substr(start);
    io::NumberLine value(path, number, text);
    if (key == "name" && !text.empty()) sequence.name = text;
    if (key == "imDir" && !text.empty()) sequence.image_folder = text;
    if (key == "imExt" && !text.empty()) sequence.image_extension = text;
    if (key == "seqLength") {
      // Whoever goes from frame to frame must not go on for ever for one absurd number.
      constexpr int kLongest = 10'000'000;
      sequence.length = value.whole("seqLength", 0);
      if (sequence.length > kLongest) value.refuse("seqLength", sequence.length, "<= 10000000");
    }
    if (key == "imWidth") sequence.width = value.whole("imWidth", 0);
    if (key == "imHeight") sequence.height = value.whole("imHeight", 0);
    if (key == "frameRate") {
      sequence.frame_rate = value.number("frameRate");
      if (sequence.frame_rate <= 0) value.refuse("frameRate", sequence.frame_rate, "> 0");
    }
  });
  read_numbering(sequence);
  return sequence;
}

fs::path Sequence::image(int frame) const {
  const std::string number = std::to_string(frame - 1 + first_image);
  const std::size_t digits = std::max(number.size(), static_cast<std::size_t>(image_digits));
  return folder / image_folder /
         (image_prefix + std::string(digits - number.size(), '0') + number + image_extension);
}

bool Sequence::has_images() const {
  const auto files = files_of(folder / image_folder);
  return std::any_of(begin(files), end(files), [this](const fs::directory_entry& file) {
    return !is_hidden(file.path()) && file.path().extension() == image_extension;
  });
}

}  // namespace sdmt::mot

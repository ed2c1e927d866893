// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/sequence.h"

#include <algorithm>
#include <cstdio>

#include "sdmt/io/delimited_text.h"

namespace sdmt::mot {

namespace fs = std::filesystem;

bool Sequence::is_sequence(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path / "seqinfo.ini", error);
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
    if (key == "seqLength") sequence.length = value.whole("seqLength", 0);
    if (key == "imWidth") sequence.width = value.whole("imWidth", 0);
    if (key == "imHeight") sequence.height = value.whole("imHeight", 0);
    if (key == "frameRate") {
      sequence.frame_rate = value.number("frameRate");
      if (sequence.frame_rate <= 0) value.refuse("frameRate", sequence.frame_rate, "> 0");
    }
  });
  return sequence;
}

fs::path Sequence::image(int frame) const {
  char number[16];
  std::snprintf(number, sizeof number, "%06d", frame);
  return folder / image_folder / (number + image_extension);
}

bool Sequence::has_images() const {
  std::error_code error;
  const fs::directory_iterator files(folder / image_folder, error);
  return !error && std::any_of(begin(files), end(files), [this](const fs::directory_entry& file) {
    return file.path().extension() == image_extension;
  });
}

}  // namespace sdmt::mot

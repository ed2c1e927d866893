// SPDX-License-Identifier: Apache-2.0
#include "folder_listing.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <stdexcept>
#include <system_error>

#include "sdmt/mot/sequence.h"

namespace sdmt::pipeline {

namespace fs = std::filesystem;

namespace {

// Every digit run padded to one length, so that comparing texts compares the numbers in them.
std::string natural_key(const std::string& name) {
  constexpr std::size_t kDigits = 20;
  std::string key;
  for (std::size_t i = 0; i < name.size();) {
    std::size_t end = i;
    while (end < name.size() && std::isdigit(static_cast<unsigned char>(name[end])) != 0) ++end;
    if (end > i) {
      key.append(kDigits - std::min(kDigits, end - i), '0');
      key.append(name, i, end - i);
      i = end;
    } else {
      key += name[i++];
    }
  }
  return key;
}

bool natural_order(const fs::path& a, const fs::path& b) {
  const auto key_a = natural_key(a.filename().string());
  const auto key_b = natural_key(b.filename().string());
  return key_a != key_b ? key_a < key_b : a < b;
}

struct LeftOut {
  int hidden = 0;
  int folders = 0;
  int others = 0;                    // files of other kinds
  std::set<std::string> extensions;  // of these

  std::string text() const {
    std::string counts;
    const auto add = [&](int count, const char* one, const char* many) {
      if (count > 0) {
        counts +=
            fmt::format("{}{} {}", counts.empty() ? "" : ", ", count, count == 1 ? one : many);
      }
    };
    add(hidden, "hidden file", "hidden files");
    add(folders, "folder", "folders");
    add(others, "file that is no image", "files that are no images");
    if (counts.empty()) return {};
    if (!extensions.empty()) {
      std::string list;
      for (const auto& extension : extensions) list += (list.empty() ? "" : " ") + extension;
      counts += " (" + list + ")";
    }
    return counts + (hidden + folders + others == 1 ? " is" : " are") + " left out";
  }
};

}  // namespace

ImageListing list_images(const fs::path& folder) {
  ImageListing listing;
  LeftOut left_out;
  std::error_code failed;
  std::error_code ignored;
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    const fs::path& path = entry->path();
    const auto kind = entry->status(ignored).type();
    if (path.filename().string().starts_with('.')) {
      ++left_out.hidden;
    } else if (kind == fs::file_type::directory) {
      ++left_out.folders;
    } else if (mot::is_image_name(path) &&
               (kind == fs::file_type::regular || kind == fs::file_type::not_found)) {
      listing.images.push_back(path);
    } else {
      ++left_out.others;
      if (path.has_extension()) left_out.extensions.insert(path.extension().string());
    }
  }
  if (failed) {
    throw std::invalid_argument(folder.string() + ": cannot be read: " + failed.message());
  }
  std::sort(listing.images.begin(), listing.images.end(), natural_order);
  listing.left_out = left_out.text();
  return listing;
}

}  // namespace sdmt::pipeline

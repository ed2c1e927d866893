// SPDX-License-Identifier: Apache-2.0
// The rules of the house (CONTRIBUTING.md) that a program can check.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace sdmt::tests {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = fs::path(SDMT_TESTS_DIR).parent_path();

struct SourceFile {
  std::string name;  // from the root of the project
  std::string text;
  std::vector<std::string> includes;  // those in quotes
};

std::vector<SourceFile> read_sources(const std::string& folder) {
  static const std::regex kInclude("(^|\n)\\s*#include \"([^\"]+)\"");
  std::vector<SourceFile> files;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
    const auto extension = entry.path().extension();
    if (extension != ".h" && extension != ".cpp") continue;
    SourceFile file;
    file.name = fs::relative(entry.path(), kRoot).string();
    std::ifstream stream(entry.path());
    file.text.assign(std::istreambuf_iterator<char>(stream), {});
    for (std::sregex_iterator match(file.text.begin(), file.text.end(), kInclude), end;
         match != end; ++match) {
      file.includes.push_back((*match)[2]);
    }
    files.push_back(std::move(file));
  }
  std::sort(files.begin(), files.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  return files;
}

// "src/nn/kernels/gemm.h" -> "nn"
std::string module_of(const std::string& name) {
  const auto first = name.find('/');
  if (name.substr(0, first) != "src") return name.substr(0, first);
  return name.substr(first + 1, name.find('/', first + 1) - first - 1);
}

const std::map<std::string, std::set<std::string>> kMayInclude{
    {"io", {"io"}},
    {"image", {"image"}},
    {"mot", {"mot", "io"}},
    {"nn", {"nn", "io"}},
    {"mpi", {"mpi", "nn"}},
    {"media", {"media", "image", "io"}},
    {"reid", {"reid", "nn", "image", "io"}},
    {"track", {"track", "mot", "image", "io"}},
    {"zones", {"zones", "track", "mot", "image", "io"}},
    {"eval", {"eval", "mot", "io"}},
    {"c", {"c", "reid", "track", "eval", "mot", "image", "io"}},
    {"train", {"train", "reid", "media", "nn", "image", "io"}},
    {"tuning", {"tuning", "track", "eval", "media", "nn", "mot", "image", "io"}},
    {"pipeline", {"pipeline", "zones", "track", "media", "mot", "image", "io"}},
};

TEST(Structure, ModulesIncludeOnlyWhatTheyMay) {
  const auto sources = read_sources("src");
  ASSERT_GT(sources.size(), 50u);
  for (const SourceFile& file : sources) {
    const auto& allowed = kMayInclude.at(module_of(file.name));
    for (const std::string& include : file.includes) {
      EXPECT_EQ(include.find(".."), std::string::npos) << file.name << " includes " << include;
      if (!include.starts_with("sdmt/")) continue;
      const auto module = include.substr(5, include.find('/', 5) - 5);
      EXPECT_TRUE(allowed.contains(module)) << file.name << " includes " << include;
    }
  }
}

// Depth-first search; returns the first circle as "a -> b -> a", or nothing.
std::string find_circle(const std::map<std::string, std::set<std::string>>& edges,
                        const std::string& node, std::vector<std::string>& path,
                        std::set<std::string>& done) {
  if (done.contains(node)) return {};
  const bool circle_closed = std::find(path.begin(), path.end(), node) != path.end();
  path.push_back(node);
  if (circle_closed) {
    std::string circle;
    for (auto at = std::find(path.begin(), path.end(), node); at != path.end(); ++at) {
      circle += (circle.empty() ? "" : " -> ") + *at;
    }
    return circle;
  }
  if (const auto found = edges.find(node); found != edges.end()) {
    for (const std::string& next : found->second) {
      auto circle = find_circle(edges, next, path, done);
      if (!circle.empty()) return circle;
    }
  }
  path.pop_back();
  done.insert(node);
  return {};
}

std::string first_circle(const std::map<std::string, std::set<std::string>>& edges) {
  std::set<std::string> done;
  for (const auto& [node, unused] : edges) {
    std::vector<std::string> path;
    auto circle = find_circle(edges, node, path, done);
    if (!circle.empty()) return circle;
  }
  return {};
}

TEST(Structure, TheSearchFindsAPlantedCircle) {
  EXPECT_EQ(first_circle({{"a", {"b"}}, {"b", {"c"}}, {"c", {}}}), "");
  EXPECT_EQ(first_circle({{"a", {"b"}}, {"b", {"c", "d"}}, {"d", {"b"}}}), "b -> d -> b");
}

TEST(Structure, NoIncludeCircle) {
  std::map<std::string, std::set<std::string>> edges;
  for (const std::string folder : {"src", "tools"}) {
    for (const SourceFile& file : read_sources(folder)) {
      if (!file.name.ends_with(".h")) continue;
      // A public header's name is what follows include/; a private one's, what follows its root.
      const auto at = file.name.find("/include/");
      std::string name = at == std::string::npos ? file.name : file.name.substr(at + 9);
      if (at == std::string::npos) {
        const std::string root = folder == "tools" ? "tools/" : "src/" + module_of(file.name) + "/";
        name = module_of(file.name) + ":" + file.name.substr(root.size());
      }
      for (const std::string& include : file.includes) {
        edges[name].insert(include.starts_with("sdmt/") ? include
                                                        : module_of(file.name) + ":" + include);
      }
    }
  }
  EXPECT_EQ(first_circle(edges), "");
}

TEST(Structure, EveryFileSaysItsLicenceAndHeadersArePlain) {
  for (const std::string folder : {"src", "tools", "tests", "docs"}) {
    for (const SourceFile& file : read_sources(folder)) {
      if (file.text.empty()) continue;
      EXPECT_TRUE(file.text.starts_with("// SPDX-License-Identifier: Apache-2.0\n")) << file.name;
      // Highway compiles a -inl.h once for each instruction set.
      if (file.name.ends_with(".h") && !file.name.ends_with("-inl.h")) {
        EXPECT_NE(file.text.find("#pragma once"), std::string::npos) << file.name;
      }
    }
  }
}

// Indices are int where they are computed with, and subscripts are not cast.
TEST(Structure, SubscriptsAreNotCast) {
  for (const std::string folder : {"src", "tools"}) {
    for (const SourceFile& file : read_sources(folder)) {
      EXPECT_EQ(file.text.find("[static_cast<std::size_t>("), std::string::npos) << file.name;
    }
  }
}

// What an OpenMP pragma holds: the block or loop behind it.
std::string region_of(const std::string& text, std::size_t pragma) {
  int open = 0;
  bool begun = false;
  for (std::size_t at = text.find('\n', pragma); at < text.size(); ++at) {
    open += text[at] == '{' ? 1 : text[at] == '}' ? -1 : 0;
    begun = begun || open > 0;
    if (begun && open == 0) return text.substr(pragma, at - pragma);
  }
  return text.substr(pragma);
}

// An exception that leaves an OpenMP region ends the program. What may throw, allocations too, is
// in io::FirstError's guard; a region without it says "nothing throws", and has nothing in it that
// surely may.
TEST(Structure, NothingThrownLeavesAnOpenMpRegion) {
  static const std::regex kThrows(
      "thread_scratch|std::(vector|string|function)|push_back|resize\\(|Tensor "
      "[a-z]|throw|\\.at\\(");
  int regions = 0;
  for (const SourceFile& file : read_sources("src")) {
    for (std::size_t at = file.text.find("\n#pragma omp parallel"); at != std::string::npos;
         at = file.text.find("\n#pragma omp parallel", at + 1)) {
      ++regions;
      const auto begin = file.text.rfind('\n', at - 1) + 1;
      const std::string above = file.text.substr(begin, at - begin);
      const std::string region = region_of(file.text, at + 1);
      if (region.find(".guard(") != std::string::npos) {
        EXPECT_NE(file.text.find("error.rethrow();", at), std::string::npos) << file.name;
        continue;
      }
      if (region.find(" simd ") != std::string::npos) continue;  // one loop over numbers
      EXPECT_TRUE(above.find("// nothing throws") != std::string::npos)
          << file.name << ": " << region;
      EXPECT_FALSE(std::regex_search(region, kThrows)) << file.name << ": " << region;
    }
  }
  EXPECT_GT(regions, 40);
}

TEST(Structure, FilesStayShort) {
  constexpr int kLimit = 400;
  for (const std::string folder : {"src", "tools"}) {
    for (const SourceFile& file : read_sources(folder)) {
      const auto lines = std::count(file.text.begin(), file.text.end(), '\n');
      EXPECT_LE(lines, kLimit) << file.name;
    }
  }
}

}  // namespace
}  // namespace sdmt::tests

// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <stdexcept>

#include "command.h"

namespace {

constexpr int kFailure = 1;
constexpr int kBadInput = 2;

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Deep similarity metric learning for real-time pedestrian tracking"};
  app.name("sdmt");
  app.set_version_flag("--version", std::string("sdmt ") + SDMT_VERSION);
  app.require_subcommand(1);

  const auto command_name = [&app] {
    const auto chosen = app.get_subcommands();
    return chosen.empty() ? std::string("sdmt") : "sdmt " + chosen.front()->get_name();
  };
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "{}: {}\n", command_name(), error.what());
    return kBadInput;
  } catch (const std::logic_error& error) {
    fmt::print(stderr, "{}: {}\n", command_name(), error.what());
    return kBadInput;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", command_name(), error.what());
    return kFailure;
  }
  return 0;
}

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <memory>

#include "cli/command.h"
#include "cli/console.h"
#include "manual/command_line.h"
#include "sdmt/io/output_file.h"

namespace sdmt::tools {

namespace {

namespace fs = std::filesystem;

void write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  io::write_text_file(file, text);
}

void run(const CLI::App& app, const fs::path& folder) {
  const auto commands = command_lines(app);
  const fs::path pages = folder / "man" / "man1";
  write(pages / "sdmt.1", overview_page(app.get_description(), commands, SDMT_VERSION));
  for (const CommandLine& command : commands) {
    std::string name = "sdmt-" + command.name + ".1";
    std::replace(name.begin(), name.end(), ' ', '-');
    write(pages / name, man_page(command, SDMT_VERSION));
  }
  write(folder / "bash-completion" / "completions" / "sdmt", bash_completion(commands));
  write(folder / "zsh" / "vendor-completions" / "_sdmt", zsh_completion(commands));
  write(folder / "fish" / "vendor_completions.d" / "sdmt.fish", fish_completion(commands));
  say(stdout, "{} pages and the completions of bash, zsh and fish written to {}\n",
      commands.size() + 1, folder.string());
}

}  // namespace

void add_manual_command(CLI::App& app) {
  auto folder = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("manual", "Write man pages and the completions of shells");
  command
      ->add_option("--output", *folder,
                   "Folder that gets man/, bash-completion/, zsh/ and fish/, as ~/.local/share")
      ->required()
      ->type_name("DIR");
  command->callback([&app, folder] { run(app, *folder); });
}

}  // namespace sdmt::tools

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>
#include <stdexcept>

#include "sdmt/io/checked_value.h"
#include "sdmt/nn/random.h"
#include "sdmt/track/tracker_option_table.h"
#include "tuning/tuning.h"

namespace sdmt::tools {

namespace {

const io::Option<track::TrackerOptions>& option_named(const std::string& name) {
  const auto& table = track::tracker_option_table();
  const auto found = std::find_if(table.begin(), table.end(),
                                  [&](const auto& entry) { return entry.name == name; });
  if (found == table.end()) {
    throw std::invalid_argument("--option: the tracker has no option " + io::quoted(name));
  }
  return *found;
}

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts{""};
  for (const char letter : text) {
    if (letter == ',') {
      parts.emplace_back();
    } else {
      parts.back() += letter;
    }
  }
  return parts;
}

// Switches are said as they are typed: on, off.
std::string as_option_takes_it(const io::Option<track::TrackerOptions>& option,
                               const std::string& value) {
  if (!option.is_switch) return value;
  return value == "on" ? "true" : value == "off" ? "false" : value;
}

}  // namespace

TunedOption parse_tuned_option(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos) {
    throw std::invalid_argument("--option: " + io::quoted(text) +
                                ", expected NAME=VALUE,VALUE,...");
  }
  TunedOption tuned{text.substr(0, equals), {}};
  const auto& option = option_named(tuned.name);
  for (const std::string& value : split(text.substr(equals + 1))) {
    track::TrackerOptions options;
    option.set(options, as_option_takes_it(option, value));
    option.check(options);
    tuned.values.push_back(option.get(options));
  }
  return tuned;
}

std::vector<TuningSetting> tuning_settings(const track::TrackerOptions& base,
                                           const std::vector<TunedOption>& tuned, int most,
                                           std::uint64_t seed) {
  TuningSetting first{base, {}};
  std::uint64_t combinations = 1;
  for (const TunedOption& option : tuned) {
    first.values.push_back(option_named(option.name).get(base));
    combinations *= option.values.size();
    if (combinations > 1'000'000) {
      throw std::invalid_argument(
          "--option: more than 1,000,000 combinations, expected fewer options or values");
    }
  }
  std::vector<std::uint64_t> order(combinations);
  for (std::uint64_t i = 0; i < combinations; ++i) order[i] = i;
  if (combinations > static_cast<std::uint64_t>(most)) {
    nn::Random random(seed);
    random.shuffle(std::span(order));
  }
  std::vector<TuningSetting> settings{first};
  for (std::uint64_t combination : order) {
    if (static_cast<int>(settings.size()) >= most) break;
    TuningSetting setting{base, {}};
    for (const TunedOption& option : tuned) {
      setting.values.push_back(option.values[combination % option.values.size()]);
      option_named(option.name).set(setting.options, setting.values.back());
      combination /= option.values.size();
    }
    if (setting.values == first.values) continue;
    try {
      setting.options.validate();
    } catch (const std::invalid_argument&) {
      continue;
    }
    settings.push_back(std::move(setting));
  }
  return settings;
}

}  // namespace sdmt::tools

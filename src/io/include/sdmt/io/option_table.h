// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "sdmt/io/checked_value.h"
#include "sdmt/io/range.h"

namespace sdmt::io {

/// What an option is called: "lr", and for the field behind it "learning_rate", or the same with
/// underscores.
struct OptionName {
  OptionName(const char* option_name) : option(option_name), field(option_name) {
    for (char& letter : field) letter = letter == '-' ? '_' : letter;
  }
  OptionName(const char* option_name, const char* field_name)
      : option(option_name), field(field_name) {}

  std::string option, field;
};

/// One value of a struct of options, said once for the command line and its help, config files,
/// validation, the documentation, and for telling whether two runs had the same options.
template <typename Options>
struct Option {
  std::string name;   ///< in kebab-case, without dashes
  std::string field;  ///< in messages and in files of results
  std::string group;
  std::string help;    ///< one line, without range and default
  std::string values;  ///< what it takes: a range, or words; empty when `help` says it
  bool is_switch = false;
  /// Reads the value. Throws std::invalid_argument `NAME is 'TEXT', expected ...` for text that is
  /// no such value; numbers out of range are found by check().
  std::function<void(Options&, std::string_view text)> set;
  /// The value as set() takes it, the same text for the same value.
  std::function<std::string(const Options&)> get;
  /// Throws std::invalid_argument `FIELD is VALUE, expected RANGE`.
  std::function<void(const Options&)> check;

  /// "on" and "off" for switches, else as get().
  std::string shown(const Options& options) const {
    const std::string value = get(options);
    return is_switch ? (value == "true" ? "on" : "off") : value;
  }
};

template <typename Options, typename Group>
class OptionGroup;

/// All options of a struct, in order.
///
///   OptionTable<TrackerOptions> table;
///   table.group("motion", &TrackerOptions::motion)
///       .number("min-iou", &MotionOptions::min_iou, {.low = 0, .high = 1}, "tau_m, motion gate");
template <typename Options>
class OptionTable {
 public:
  /// Adds options that are fields of a part of the struct, or of the struct itself.
  template <typename Group>
  OptionGroup<Options, Group> group(std::string name, Group Options::*part) {
    return {options_, std::move(name), part};
  }
  OptionGroup<Options, Options> group(std::string name) {
    return {options_, std::move(name), nullptr};
  }

  auto begin() const { return options_.begin(); }
  auto end() const { return options_.end(); }
  std::size_t size() const { return options_.size(); }

  /// The option of that name. Throws std::invalid_argument `the OWNER has no option 'NAME'`.
  const Option<Options>& named(std::string_view name, const char* owner) const {
    for (const auto& option : options_) {
      if (option.name == name) return option;
    }
    throw std::invalid_argument(std::string("the ") + owner + " has no option " + quoted(name));
  }

  /// Checks every option.
  void validate(const Options& options) const {
    for (const auto& option : options_) option.check(options);
  }

  /// The options as a table in Markdown, a column of values for each preset, a line in bold above
  /// each group.
  std::string markdown(const std::vector<std::pair<std::string, Options>>& presets) const;

 private:
  std::vector<Option<Options>> options_;
};

/// Writes options into a table.
template <typename Options, typename Group>
class OptionGroup {
 public:
  using Part = std::conditional_t<std::is_same_v<Options, Group>, std::nullptr_t, Group Options::*>;

  OptionGroup(std::vector<Option<Options>>& table, std::string name, Part part)
      : table_(table), name_(std::move(name)), part_(part) {}

  template <typename Number>
  OptionGroup& number(const OptionName& name, Number Group::*field, const Range& range,
                      std::string help) {
    return value(
        name, field, std::move(help), range.text(),
        [name = name.option](std::string_view text) { return read<Number>(name, text, ""); },
        [](Number number) { return number_text(number); },
        [field = name.field, range](Number number) { require_in(field, number, range); });
  }

  /// A number that may be left to somebody else, by the word `absent`: "auto", "none".
  template <typename Number>
  OptionGroup& number(const OptionName& name, std::optional<Number> Group::*field,
                      std::string absent, const Range& range, std::string help) {
    using Value = std::optional<Number>;
    return value(
        name, field, std::move(help), absent + " or " + range.text(),
        [name = name.option, absent](std::string_view text) {
          return text == absent ? Value() : read<Number>(name, text, " or " + absent);
        },
        [absent](const Value& number) { return number ? number_text(*number) : absent; },
        [field = name.field, range](const Value& number) {
          if (number) require_in(field, *number, range);
        });
  }

  OptionGroup& on_off(const OptionName& name, bool Group::*field, std::string help) {
    value(
        name, field, std::move(help), "",
        [name = name.option](std::string_view text) {
          if (text != "true" && text != "false") refuse_value(name, quoted(text), "true or false");
          return text == "true";
        },
        [](bool on) { return std::string(on ? "true" : "false"); }, [](bool) {});
    table_.back().is_switch = true;
    return *this;
  }

  /// One of some words. Throws std::logic_error in get() for a value that has none.
  template <typename Choice>
  OptionGroup& choice(const OptionName& name, Choice Group::*field,
                      std::vector<std::pair<std::string, Choice>> words, std::string help) {
    std::string known;
    for (const auto& [word, meant] : words) known += (known.empty() ? "" : ", ") + word;
    return value(
        name, field, std::move(help), known,
        [name = name.option, words, known](std::string_view text) {
          for (const auto& [word, meant] : words) {
            if (text == word) return meant;
          }
          refuse_value(name, quoted(text), "one of " + known);
        },
        [words](Choice choice) {
          for (const auto& [word, meant] : words) {
            if (choice == meant) return word;
          }
          throw std::logic_error("an option has a value without a name");
        },
        [](Choice) {});
  }

  /// Anything else: `parse` reads it, `print` writes it, `check` throws when it cannot be.
  template <typename Value, typename Parse, typename Print, typename Check>
  OptionGroup& value(const OptionName& name, Value Group::*field, std::string help,
                     std::string values, Parse parse, Print print, Check check) {
    const auto part = [part = part_](auto& options) -> auto& {
      if constexpr (std::is_same_v<Options, Group>) {
        return options;
      } else {
        return options.*part;
      }
    };
    table_.push_back(
        {name.option, name.field, name_, std::move(help), std::move(values), false,
         [=](Options& options, std::string_view text) { part(options).*field = parse(text); },
         [=](const Options& options) { return print(part(options).*field); },
         [=](const Options& options) { check(part(options).*field); }});
    return *this;
  }

 private:
  template <typename Number>
  static Number read(const std::string& name, std::string_view text, const std::string& or_else) {
    const auto number = parse_number<Number>(text);
    constexpr const char* kKind = std::is_integral_v<Number> ? "a whole number" : "a number";
    if (!number) refuse_value(name, quoted(text), kKind + or_else);
    return *number;
  }

  std::vector<Option<Options>>& table_;
  std::string name_;
  Part part_;
};

/// A row of a Markdown table.
std::string markdown_row(const std::vector<std::string>& cells);

template <typename Options>
std::string OptionTable<Options>::markdown(
    const std::vector<std::pair<std::string, Options>>& presets) const {
  std::vector<std::string> head{"option"}, line{"---"};
  for (const auto& [name, preset] : presets) head.push_back(name), line.push_back("---");
  head.insert(head.end(), {"takes", ""});
  line.insert(line.end(), {"---", "---"});
  std::string text = markdown_row(head) + markdown_row(line);
  std::string group;
  for (const auto& option : options_) {
    if (option.group != group) {
      group = option.group;
      text += markdown_row({"**" + group + "**"});
    }
    std::vector<std::string> cells{"`--" + option.name + "`"};
    for (const auto& [name, preset] : presets) cells.push_back(option.shown(preset));
    cells.insert(cells.end(), {option.is_switch ? "on, off" : option.values, option.help});
    text += markdown_row(cells);
  }
  return text;
}

}  // namespace sdmt::io

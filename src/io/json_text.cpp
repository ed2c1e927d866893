// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/json_text.h"

#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <vector>

#include "sdmt/io/checked_value.h"

namespace sdmt::io {

namespace {

using nlohmann::json;

// Goes through the text to its end, so that a syntax error is reported before anything else.
class Checker : public nlohmann::json_sax<json> {
 public:
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return enter(); }
  bool end_object() override { return leave(); }
  bool start_array(std::size_t) override { return enter(); }
  bool end_array() override { return leave(); }
  bool key(string_t& name) override {
    if (depth_ <= kDeepestJson && !keys_.back().insert(name).second && problem_.empty()) {
      problem_ = "has key " + printable(name, 100) + " twice";
    }
    return true;
  }
  bool parse_error(std::size_t byte, const std::string&, const json::exception& error) override {
    constexpr int kOutOfRange = 406;
    problem_ = error.id == kOutOfRange ? "holds a number that is out of range"
                                       : "is not valid JSON (at byte " + std::to_string(byte) + ")";
    return false;
  }

  const std::string& problem() const { return problem_; }

 private:
  bool enter() {
    if (++depth_ <= kDeepestJson) {
      keys_.emplace_back();
    } else if (problem_.empty()) {
      problem_ = "is nested more than " + std::to_string(kDeepestJson) + " levels deep";
    }
    return true;
  }
  bool leave() {
    if (depth_-- <= kDeepestJson) keys_.pop_back();
    return true;
  }

  int depth_ = 0;
  std::vector<std::set<std::string>> keys_;  // of what is open, down to the deepest level
  std::string problem_;
};

}  // namespace

void check_json(std::string_view text, const std::string& name) {
  Checker checker;
  json::sax_parse(text, &checker);
  if (!checker.problem().empty()) throw std::invalid_argument(name + " " + checker.problem());
}

}  // namespace sdmt::io

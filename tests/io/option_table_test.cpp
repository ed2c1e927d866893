// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/option_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace sdmt::io {
namespace {

enum class Colour { red, green };

struct Wheels {
  double grip = 0.5;
  int count = 4;
  std::optional<double> pressure;
};

struct Cart {
  Wheels wheels;
  bool brake = true;
  Colour colour = Colour::red;
  std::int64_t price = 5'000'000'000;
  std::string owner = "me";
};

OptionTable<Cart> cart_table() {
  OptionTable<Cart> table;
  table.group("wheels", &Cart::wheels)
      .number("grip", &Wheels::grip, {.low = 0, .high = 1, .below = true}, "hold on the road")
      .number("wheel-count", &Wheels::count, {.low = 1, .high = 9}, "how many")
      .number("pressure", &Wheels::pressure, "auto", {.low = 0, .above = true}, "of the tyres");
  table.group("body")
      .on_off("brake", &Cart::brake, "can stop")
      .choice("colour", &Cart::colour, {{"red", Colour::red}, {"green", Colour::green}}, "paint")
      .number("price", &Cart::price, {}, "in cents")
      .value(
          "owner", &Cart::owner, "whose it is", "a name",
          [](std::string_view text) { return std::string(text); },
          [](const std::string& owner) { return owner; },
          [](const std::string& owner) {
            if (owner.empty()) refuse_value("owner", "empty", "a name");
          });
  return table;
}

std::string error(const std::string& name, const std::string& text) {
  const auto table = cart_table();
  Cart cart;
  try {
    table.named(name, "cart").set(cart, text);
    table.validate(cart);
  } catch (const std::invalid_argument& refusal) {
    return refusal.what();
  }
  return "none";
}

TEST(OptionTable, ReadsWritesAndGuardsEveryKindOfValue) {
  const std::pair<const char*, const char*> values[] = {
      {"grip", "0.25"}, {"wheel-count", "3"},     {"pressure", "2.5"}, {"pressure", "auto"},
      {"brake", "off"}, {"price", "-6000000000"}, {"colour", "green"}, {"owner", "you"}};
  const auto table = cart_table();
  table.validate(Cart{});
  for (const auto& [name, text] : values) {
    const auto& entry = table.named(name, "cart");
    Cart cart;
    entry.set(cart, entry.is_switch ? "false" : text);
    EXPECT_EQ(entry.shown(cart), text);
    EXPECT_NO_THROW(table.validate(cart));
    Cart copy;
    entry.set(copy, entry.get(cart));
    EXPECT_EQ(entry.get(copy), entry.get(cart));
    for (const auto& other : table) {  // nothing else has changed
      if (other.name == name) continue;
      EXPECT_EQ(other.get(cart), other.get(Cart{})) << name;
    }
  }
}

TEST(OptionTable, RefusalsSayNameValueAndWhatWasExpected) {
  EXPECT_EQ(error("grip", "1"), "grip is 1, expected >= 0 and < 1");
  EXPECT_EQ(error("grip", "nan"), "grip is nan, expected >= 0 and < 1");
  EXPECT_EQ(error("grip", "much"), "grip is 'much', expected a number");
  EXPECT_EQ(error("wheel-count", "0"), "wheel_count is 0, expected 1..9");
  EXPECT_EQ(error("wheel-count", "2.5"), "wheel-count is '2.5', expected a whole number");
  EXPECT_EQ(error("pressure", "0"), "pressure is 0, expected > 0");
  EXPECT_EQ(error("pressure", "none"), "pressure is 'none', expected a number or auto");
  EXPECT_EQ(error("brake", "yes"), "brake is 'yes', expected true or false");
  EXPECT_EQ(error("colour", "b\nlue"), "colour is 'b?lue', expected one of red, green");
  EXPECT_EQ(error("price", "1e3"), "price is '1e3', expected a whole number");
  EXPECT_EQ(error("owner", ""), "owner is empty, expected a name");
  EXPECT_EQ(error("w\nings", "2"), "the cart has no option 'w?ings'");
}

TEST(OptionTable, AValueWithoutANameIsNotCalledByAnother) {
  Cart cart;
  cart.colour = static_cast<Colour>(7);
  const auto table = cart_table();
  EXPECT_THROW(table.named("colour", "cart").get(cart), std::logic_error);
}

TEST(OptionTable, WritesTheDocumentation) {
  Cart paper;
  paper.brake = false;
  paper.wheels.pressure = 3;
  const std::string text = cart_table().markdown({{"default", Cart{}}, {"paper", paper}});
  EXPECT_THAT(text, testing::StartsWith("| option | default | paper | takes | |\n"
                                        "| --- | --- | --- | --- | --- |\n"
                                        "| **wheels** |\n"
                                        "| `--grip` | 0.5 | 0.5 | >= 0 and < 1 | hold on"));
  EXPECT_THAT(text, testing::HasSubstr("| `--pressure` | auto | 3 | auto or > 0 | of the"));
  EXPECT_THAT(text, testing::HasSubstr("| `--brake` | on | off | on, off | can stop |\n"));
}

TEST(Range, HoldsWhatItsTextSays) {
  const double inf = std::numeric_limits<double>::infinity();
  const struct {
    Range range;
    const char* text;
    std::vector<double> inside, outside;
  } cases[] = {
      {{}, "a number", {-inf, 0, inf}, {}},
      {{.low = 0, .high = 1}, "0..1", {0, 0.5, 1}, {-0.1, 1.1, inf}},
      {{.low = 0, .high = 100, .above = true}, "> 0 and <= 100", {1e-9, 100}, {0, -1, 101}},
      {{.low = -1, .high = 1, .below = true}, ">= -1 and < 1", {-1, 0.99}, {1, -2}},
      {{.low = 1}, ">= 1", {1, inf}, {0.99}},
      {{.low = 1, .high = 1e6}, "1..1000000", {1, 1e6}, {0, 1e6 + 1}},
      {{.high = 0, .below = true}, "< 0", {-inf, -1}, {0, 1}},
      {{.low = 1, .high = 31, .odd = true}, "an odd number in 1..31", {1, 31}, {2, 33, -1}},
  };
  for (const auto& [range, text, inside, outside] : cases) {
    EXPECT_EQ(range.text(), text);
    for (const double value : inside) EXPECT_TRUE(range.holds(value)) << text << " " << value;
    for (const double value : outside) EXPECT_FALSE(range.holds(value)) << text << " " << value;
    EXPECT_FALSE(range.holds(std::nan(""))) << text;
  }
}

}  // namespace
}  // namespace sdmt::io

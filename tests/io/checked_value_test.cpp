// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/checked_value.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace sdmt::io {
namespace {

using testing::ThrowsMessage;

TEST(CheckedValue, NumbersReadBackAsTheyWere) {
  EXPECT_EQ(number_text(0.1), "0.1");
  EXPECT_EQ(number_text(0.1F), "0.1");
  EXPECT_EQ(number_text(-7), "-7");
  for (const double value : {1.0 / 3, 5e-324, std::numeric_limits<double>::max(), -2.5e-17}) {
    EXPECT_EQ(parse_number<double>(number_text(value)), value);
  }
}

TEST(CheckedValue, OnlyWholeTextsAreNumbers) {
  EXPECT_EQ(parse_number<int>("12"), 12);
  for (const char* text : {"", " 12", "12 ", "12x", "0x1p", "99999999999", "1.5", "+3"}) {
    EXPECT_EQ(parse_number<int>(text), std::nullopt) << text;
  }
  EXPECT_EQ(parse_number<double>("1e999"), std::nullopt);
  EXPECT_EQ(parse_number<double>("1,5"), std::nullopt);
}

TEST(CheckedValue, TextOfStrangersCannotReachTheTerminal) {
  EXPECT_EQ(printable("a\x1b]0;b\a\n\x7f"), "a?]0;b???");
  EXPECT_EQ(printable("\xC2\x9B"
                      "1m \xC2\xA9 \xC3\xBC \xE4\xBA\xBA"),
            "?1m \xC2\xA9 \xC3\xBC \xE4\xBA\xBA");
  EXPECT_EQ(printable("abc\xC3\xBC", 4), "abc...");
  EXPECT_EQ(printable("abcd", 4), "abcd");
  EXPECT_EQ(printable("a\n\tb\x1b", 10, "\n\t"), "a\n\tb?");
  EXPECT_EQ(io::quoted("it\n"), "'it?'");
  EXPECT_EQ(io::quoted(std::string(5000, 'n')), "'" + std::string(100, 'n') + "...'");
}

TEST(CheckedValue, RefusalsSayFieldValueAndRange) {
  EXPECT_NO_THROW(require_in("x", 0.0, 0, 1));
  EXPECT_NO_THROW(require_in("n", 5, 5, 5));
  EXPECT_THAT([] { require_in("n", 0, 1, 1000000); },
              ThrowsMessage<std::invalid_argument>("n is 0, expected 1..1000000"));
  EXPECT_THAT([] { require_in("x", std::nan(""), 0, 1); },
              ThrowsMessage<std::invalid_argument>("x is nan, expected 0..1"));
  EXPECT_THAT([] { require(false, "x", 0.1, "> 0.5"); },
              ThrowsMessage<std::invalid_argument>("x is 0.1, expected > 0.5"));
}

}  // namespace
}  // namespace sdmt::io

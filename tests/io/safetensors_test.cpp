// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/safetensors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace sdmt::io {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

// A file as bytes: header length, header, `data` bytes of the values 0, 1, 2, ...
std::vector<std::byte> file_of(const std::string& header, std::size_t data = 0) {
  const std::uint64_t length = header.size();
  std::vector<std::byte> bytes(sizeof(length) + header.size() + data);
  std::memcpy(bytes.data(), &length, sizeof(length));
  std::memcpy(bytes.data() + sizeof(length), header.data(), header.size());
  for (std::size_t i = 0; i < data; ++i) {
    bytes[sizeof(length) + header.size() + i] = static_cast<std::byte>(i);
  }
  return bytes;
}

std::string tensor(const std::string& name, const std::string& dtype, const std::string& shape,
                   const std::string& offsets) {
  return "\"" + name + "\":{\"dtype\":\"" + dtype + "\",\"shape\":" + shape +
         ",\"data_offsets\":" + offsets + "}";
}

// The message with which the bytes are refused.
std::string refusal(const std::vector<std::byte>& bytes) {
  try {
    const Safetensors file(bytes, "x.safetensors");
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}
std::string refusal(const std::string& header, std::size_t data = 0) {
  return refusal(file_of(header, data));
}

// Tests run beside each other, each in its own process.
fs::path temporary(const std::string& name) {
  return fs::path(testing::TempDir()) / (std::to_string(::getpid()) + "-" + name);
}

TEST(Safetensors, ReadsWhatTheFormatAllows) {
  const auto bytes = file_of(
      "{\"__metadata__\":{\"a\":\"b\"}," + tensor("late", "F32", "[2]", "[4,12]") + "," +
          tensor("early", "I8", "[2,2]", "[0,4]") + "," + tensor("none", "F32", "[0,7]", "[4,4]") +
          "," + tensor("scalar", "U8", "[]", "[12,13]") + "}   ",
      13);
  const Safetensors file(bytes, "x");
  EXPECT_EQ(file.metadata().at("a"), "b");
  ASSERT_EQ(file.tensors().size(), 4U);
  EXPECT_EQ(file.tensors()[0].name, "early");
  EXPECT_EQ(file.tensors()[3].name, "scalar");
  EXPECT_EQ(file.at("scalar").count(), 1U);
  EXPECT_EQ(file.at("none").count(), 0U);
  EXPECT_EQ(file.at("early").shape_str(), "[2,2]");
  EXPECT_EQ(file.find("other"), nullptr);
  std::vector<float> values(4);
  file.read_floats(file.at("early"), values);
  EXPECT_THAT(values, ElementsAre(0, 1, 2, 3));
  std::vector<float> middle(2);
  file.read_floats(file.at("early"), middle, 1);
  EXPECT_THAT(middle, ElementsAre(1, 2));
}

TEST(Safetensors, ReadsValuesAtOddAddresses) {
  auto bytes =
      file_of("{" + tensor("a", "U8", "[1]", "[0,1]") + "," + tensor("b", "F32", "[1]", "[1,5]") +
                  "," + tensor("c", "U64", "[1]", "[5,13]") + "}",
              13);
  const float value = 1.5F;
  const std::uint64_t number = 0xfedcba9876543210;
  std::memcpy(bytes.data() + bytes.size() - 12, &value, 4);
  std::memcpy(bytes.data() + bytes.size() - 8, &number, 8);
  const Safetensors file(bytes, "x");
  float read = 0;
  file.read_floats(file.at("b"), {&read, 1});
  EXPECT_EQ(read, value);
  EXPECT_THAT(file.read_integers("c"), ElementsAre(number));
}

TEST(Safetensors, RefusesHostileFilesInOneLine) {
  const std::string good = tensor("w", "F32", "[2]", "[0,8]");
  EXPECT_EQ(refusal("{" + good + "}", 8), "accepted");

  EXPECT_EQ(refusal(std::vector<std::byte>{}),
            "x.safetensors: is 0 bytes long, too short for a safetensors file");
  EXPECT_EQ(refusal(std::vector<std::byte>(7)),
            "x.safetensors: is 7 bytes long, too short for a safetensors file");
  EXPECT_EQ(refusal(""), "x.safetensors: header is not valid JSON (at byte 1)");

  auto bytes = file_of("{" + good + "}", 8);
  bytes[0] = std::byte{200};
  EXPECT_EQ(refusal(bytes), "x.safetensors: header length is 200, but only 62 bytes follow");
  bytes[7] = std::byte{0xff};
  EXPECT_EQ(refusal(bytes),
            "x.safetensors: header length is 18374686479671623880, expected at most 100000000 (not "
            "a safetensors file?)");

  EXPECT_EQ(refusal("{" + good), "x.safetensors: header is not valid JSON (at byte 54)");
  EXPECT_EQ(refusal("[]"), "x.safetensors: header is not a JSON object");
  EXPECT_EQ(refusal("{} x"), "x.safetensors: header is not valid JSON (at byte 4)");
  EXPECT_EQ(refusal("{\"a\":1e999}"), "x.safetensors: header holds a number that is out of range");
  EXPECT_THAT(refusal("{\"a\xff\":1}"), HasSubstr("header is not valid JSON"));
  EXPECT_EQ(refusal(std::string(200'000, '[')),
            "x.safetensors: header is not valid JSON (at byte 200001)");

  EXPECT_EQ(refusal("{\"__metadata__\":[]}"), "x.safetensors: __metadata__ is not a JSON object");
  EXPECT_EQ(refusal("{\"__metadata__\":{\"n\":1}}"),
            "x.safetensors: __metadata__ key n is not a text");
  EXPECT_EQ(refusal("{" + good + "," + good + "}", 8), "x.safetensors: header has key w twice");

  EXPECT_EQ(refusal("{\"w\":3}"), "x.safetensors: tensor w is not described by a JSON object");
  EXPECT_EQ(refusal("{\"w\":{}}"), "x.safetensors: tensor w has no dtype");
  EXPECT_EQ(refusal("{\"w\":{\"dtype\":3}}"),
            "x.safetensors: tensor w has a dtype that is not a text");
  EXPECT_EQ(refusal("{" + tensor("w", "F32", "3", "[0,8]") + "}", 8),
            "x.safetensors: tensor w has a shape that is not a list");
  EXPECT_EQ(refusal("{" + tensor("w", "F32", "[-2]", "[0,8]") + "}", 8),
            "x.safetensors: tensor w has -2 in its shape, expected a whole number >= 0");
  EXPECT_EQ(refusal("{" + tensor("w", "F32", "[2.0]", "[0,8]") + "}", 8),
            "x.safetensors: tensor w has 2.0 in its shape, expected a whole number >= 0");
  EXPECT_EQ(
      refusal("{" + tensor("w", "F32", "[4294967296,4294967296]", "[0,8]") + "}", 8),
      "x.safetensors: tensor w has shape [4294967296,4294967296]..., which overflows 64 bits");
  EXPECT_EQ(refusal("{" + tensor("w", "F32", "[2]", "8") + "}", 8),
            "x.safetensors: tensor w has data_offsets that are not two numbers");
  EXPECT_EQ(refusal("{" + tensor("w", "F32", "[2]", "[0,\"8\"]") + "}", 8),
            "x.safetensors: tensor w has \"8\" in its data_offsets, expected a whole number >= 0");
  EXPECT_EQ(refusal("{" + tensor("w", "F32", "[2]", "[8,0]") + "}", 8),
            "x.safetensors: tensor w has data_offsets [8,0] that run backwards");
  EXPECT_EQ(
      refusal("{" + good + "}", 7),
      "x.safetensors: tensor w has data_offsets [0,8] beyond the 7 bytes of data in the file");
  EXPECT_EQ(refusal("{" + tensor("w", "F32", "[2]", "[0,7]") + "}", 8),
            "x.safetensors: tensor w has data_offsets [0,7], but F32 [2] takes 8 bytes");

  EXPECT_EQ(refusal("{" + good + "," + tensor("v", "F32", "[2]", "[4,12]") + "}", 12),
            "x.safetensors: tensor v starts at byte 4 of the data, expected 8 (it overlaps the "
            "tensor before it)");
  EXPECT_EQ(refusal("{" + good + "," + tensor("v", "F32", "[1]", "[12,16]") + "}", 16),
            "x.safetensors: tensor v starts at byte 12 of the data, expected 8 (there is a hole "
            "before it)");
  EXPECT_EQ(refusal("{" + good + "}", 9),
            "x.safetensors: holds 9 bytes of data, but its tensors end at 8");

  // Names made to break the line or to flood it are shown tamed.
  EXPECT_EQ(refusal("{\"a\\n\\u001bb\":3}"),
            "x.safetensors: tensor a??b is not described by a JSON object");
  EXPECT_LT(refusal("{\"" + std::string(5000, 'n') + "\":3}").size(), 200U);
}

TEST(Safetensors, RefusesWhatIsNestedTooDeep) {
  const auto nested = [](int levels) {
    return "{\"a\":{\"dtype\":\"F32\",\"shape\":[" + std::string(levels, '[') +
           std::string(levels, ']') + "],\"data_offsets\":[0,4]}}";
  };
  EXPECT_EQ(refusal(nested(13), 4),
            "x.safetensors: tensor a has [[[[[[[[[[[[[]]]]]]]]]]]]] in its shape, expected a whole "
            "number >= 0");
  for (const int levels : {14, 100'000, 1'000'000}) {
    EXPECT_EQ(refusal(nested(levels), 4),
              "x.safetensors: header is nested more than 16 levels deep");
  }
  EXPECT_EQ(
      refusal("{\"__metadata__\":" + std::string(50'000, '[') + std::string(50'000, ']') + "}"),
      "x.safetensors: header is nested more than 16 levels deep");
}

TEST(Safetensors, ATypeThatIsUnknownMattersToItsReadersOnly) {
  const auto bytes = file_of("{" + tensor("odd", "F8_\\u001b", "[8]", "[0,8]") + "," +
                                 tensor("w", "U8", "[2]", "[8,10]") + "}",
                             10);
  const Safetensors file(bytes, "x");
  EXPECT_EQ(file.at("odd").size, 8U);
  EXPECT_EQ(file.at("odd").count(), 8U);
  std::vector<float> values(8);
  EXPECT_THAT([&] { file.read_floats(file.at("odd"), values); },
              testing::ThrowsMessage<std::invalid_argument>(
                  "x: tensor odd has dtype F8_?, expected F32, F16, BF16, F64 or I8"));
  // Its bytes are part of the file all the same.
  EXPECT_EQ(refusal("{" + tensor("odd", "F4", "[8]", "[0,4]") + "}", 5),
            "x.safetensors: holds 5 bytes of data, but its tensors end at 4");
}

TEST(Safetensors, SaysWhatAFileOfAnotherKindIs) {
  const auto kind = [](std::string text) {
    text.resize(std::max<std::size_t>(text.size(), 200), ' ');
    const auto bytes = std::as_bytes(std::span(text));
    return refusal(std::vector<std::byte>(bytes.begin(), bytes.end()));
  };
  const std::string expected = "x.safetensors: expected a safetensors file, this is ";
  EXPECT_EQ(kind("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n"),
            expected + "a Git LFS pointer, not the file itself; fetch that with git lfs pull");
  EXPECT_THAT(kind("PK\x03\x04\x14"), HasSubstr(expected + "a zip archive"));
  EXPECT_THAT(kind("\x89HDF\r\n\x1a\n"), HasSubstr(expected + "an HDF5 file"));
  EXPECT_THAT(kind("\x80\x02\x8a\x0al\xfc\x9c\x46\xf9 "), HasSubstr(expected + "a Python pickle"));
  EXPECT_THAT(kind("\x08\x07\x12\x07pytorch\x1a\x03\x31.3"), HasSubstr(expected + "an ONNX model"));
  EXPECT_THAT(kind(std::string("\x1c\0\0\0TFL3", 8)),
              HasSubstr(expected + "a TensorFlow Lite model"));
  EXPECT_THAT(kind("<!DOCTYPE html><html>"), HasSubstr(expected + "an HTML or XML page"));
  EXPECT_THAT(kind("{\"metadata\": {\"total_size\": 1}}"), HasSubstr(expected + "JSON text"));
  EXPECT_THAT(kind("neither"), HasSubstr("not a safetensors file?"));
}

TEST(Safetensors, AFileThatIsCutShortMeanwhileIsAnError) {
  const fs::path path = temporary("cut.safetensors");
  const std::vector<float> values(100'000, 1.0F);
  SafetensorsWriter writer;
  writer.add("w", {values.size()}, values);
  writer.write(path);
  const Safetensors file(path);
  fs::resize_file(path, 1000);
  std::vector<float> read(values.size());
  EXPECT_THAT([&] { file.read_floats(file.at("w"), read); },
              testing::ThrowsMessage<std::runtime_error>(
                  path.string() + ": cannot be read: it ends at byte 1000; was it cut short?"));
}

TEST(Safetensors, RefusesFilesThatCannotBeRead) {
  const auto message = [](const fs::path& path) -> std::string {
    try {
      const Safetensors file(path);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message("/no/such.safetensors"),
            "/no/such.safetensors: cannot be opened: No such file or directory");
  EXPECT_EQ(message("/dev/null"), "/dev/null: is not a regular file");
  EXPECT_EQ(message(testing::TempDir()), testing::TempDir() + ": is not a regular file");
  const fs::path empty = temporary("empty.safetensors");
  std::ofstream(empty).close();
  EXPECT_EQ(message(empty), empty.string() + ": is empty, expected a safetensors file");
}

TEST(Safetensors, NamesTheTensorThatIsNotAsExpected) {
  const auto bytes = file_of(
      "{" + tensor("w", "U64", "[1]", "[0,8]") + "," + tensor("i", "I32", "[1]", "[8,12]") + "}",
      12);
  const Safetensors file(bytes, "x");
  const auto message = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  const std::uint64_t shape[] = {2, 3};
  std::vector<float> one(1);
  EXPECT_EQ(message([&] { file.at("v"); }), "x: tensor v is missing");
  EXPECT_EQ(message([&] { file.at("w", shape); }), "x: tensor w has shape [1], expected [2,3]");
  EXPECT_EQ(message([&] { file.read_floats(file.at("w"), one); }),
            "x: tensor w has dtype U64, expected F32, F16, BF16, F64 or I8");
  EXPECT_EQ(message([&] { file.read_floats(file.at("w"), one, 1); }),
            "x: tensor w has 1 values, asked for 1 from 1");
  EXPECT_EQ(message([&] { file.read_integers("i"); }),
            "x: tensor i has dtype I32, expected U64 or I64");
}

TEST(SafetensorsWriter, RoundTripsEveryKind) {
  const std::vector<float> floats{1.0F, -2.5F, 3e-40F, 4.0F, 5.0F, 6.0F};
  const std::vector<std::uint64_t> state{1, ~0ULL};
  const std::vector<std::int8_t> bytes{-127, 0, 127};
  SafetensorsWriter writer;
  writer.set_metadata("note", "quotes \" and \n lines");
  writer.add("f", {2, 3}, floats);
  writer.add("empty", {0}, std::span<const float>());
  writer.add("state", {2}, state);
  writer.add_bytes("q", DType::i8, {3}, std::as_bytes(std::span(bytes)));
  writer.add("made", DType::f16, {2}, [](const SafetensorsWriter::Sink& sink) {
    const std::uint16_t one = 0x3c00;
    for (int i = 0; i < 2; ++i) sink(std::as_bytes(std::span(&one, 1)));
  });
  const fs::path path = temporary("round.safetensors");
  writer.write(path);

  const Safetensors file(path);
  EXPECT_EQ(file.name(), path.string());
  EXPECT_EQ(file.metadata().at("note"), "quotes \" and \n lines");
  EXPECT_EQ(file.tensors().size(), 5U);
  const auto read = [&](const char* name) {
    std::vector<float> values(file.at(name).count());
    file.read_floats(file.at(name), values);
    return values;
  };
  EXPECT_EQ(read("f"), floats);
  EXPECT_EQ(file.at("f").shape_str(), "[2,3]");
  EXPECT_EQ(file.read_integers("state"), state);
  EXPECT_THAT(read("q"), ElementsAre(-127, 0, 127));
  EXPECT_THAT(read("made"), ElementsAre(1, 1));
  EXPECT_THAT(read("empty"), ElementsAre());

  const auto content = [&] {
    std::ifstream in(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const std::string first = content();
  writer.write(path);
  EXPECT_EQ(content(), first);
}

TEST(SafetensorsWriter, RefusesWhatWouldNotBeAFile) {
  const std::vector<float> three(3);
  SafetensorsWriter writer;
  writer.add("a", {3}, three);
  EXPECT_THROW(writer.add("a", {3}, three), std::invalid_argument);
  EXPECT_THROW(writer.add("b", {2}, three), std::invalid_argument);
  writer.add("short", DType::f32, {2},
             [&](const auto& sink) { sink(std::as_bytes(std::span(three).first(1))); });
  const fs::path path = temporary("short.safetensors");
  fs::remove(path);
  EXPECT_THROW(writer.write(path), std::logic_error);
  EXPECT_FALSE(fs::exists(path));
}

// Values by the definition of binary16 and bfloat16, not by our conversion.
TEST(Safetensors, WidensHalvesExactly) {
  std::vector<std::uint16_t> halves(0x10000);
  std::iota(halves.begin(), halves.end(), std::uint16_t{0});
  SafetensorsWriter writer;
  writer.add_bytes("f16", DType::f16, {halves.size()}, std::as_bytes(std::span(halves)));
  writer.add_bytes("bf16", DType::bf16, {halves.size()}, std::as_bytes(std::span(halves)));
  const fs::path path = temporary("halves.safetensors");
  writer.write(path);
  const Safetensors file(path);
  const auto expect_all = [&](const char* name, int mantissa_bits, int bias) {
    std::vector<float> values(halves.size());
    file.read_floats(file.at(name), values);
    const int exponent_bits = 15 - mantissa_bits;
    for (std::size_t i = 0; i < halves.size(); ++i) {
      const int exponent = static_cast<int>(i >> mantissa_bits) & ((1 << exponent_bits) - 1);
      const int mantissa = static_cast<int>(i) & ((1 << mantissa_bits) - 1);
      const double sign = (i & 0x8000U) != 0 ? -1 : 1;
      if (exponent == (1 << exponent_bits) - 1) {
        ASSERT_EQ(std::isnan(values[i]), mantissa != 0) << i;
        if (mantissa == 0) {
          ASSERT_EQ(values[i], sign * INFINITY);
        }
      } else {
        const double fraction = std::ldexp(mantissa, -mantissa_bits) + (exponent > 0 ? 1 : 0);
        ASSERT_EQ(values[i], sign * std::ldexp(fraction, std::max(exponent, 1) - bias)) << i;
      }
    }
  };
  expect_all("f16", 10, 15);
  expect_all("bf16", 7, 127);
}

}  // namespace
}  // namespace sdmt::io

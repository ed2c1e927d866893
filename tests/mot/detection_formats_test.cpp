// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/detection_formats.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "cli/run_command.h"

namespace sdmt::mot {
namespace {

using testing::HasSubstr;
using tests::write_file;
namespace fs = std::filesystem;

class DetectionFormats : public testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& text) {
    fs::create_directories((folder_ / name).parent_path());
    write_file(folder_ / name, text);
    return folder_ / name;
  }
  std::string refusal(const fs::path& path, const DetectionReading& reading = {}) {
    try {
      read_detections(path, reading);
      return "nothing";
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
  }

  tests::TemporaryFolder folder_;
};

// Two people in frame 1, one of them again in frame 3, in a picture of 640 x 480.
TEST_F(DetectionFormats, OneSetOfBoxesInEverySpelling) {
  const DetectionReading reading{.width = 640, .height = 480};
  std::vector<fs::path> files{
      write("mot.txt", "1,-1,65,49,32,96,0.5\n1,-1,129,49,64,192,1\n3,-1,65,97,32,96,0.75\n"),
      write("blanks.txt", "1 -1 65 49 32 96 0.5\n1  -1 129 49 64 192 1\n3\t-1 65 97 32 96 0.75\n"),
      write("csv.csv",
            "Frame,Label,xmin,ymin,xmax,ymax,Confidence\n1,person,65,49,97,145,0.5\n"
            "1,person,129,49,193,241,1\n1,car,1,1,99,99,1\n3,person,65,97,97,193,0.75\n"),
      write("semicolons.csv",
            "frame;left;top;w;h;score\n1;65;49;32;96;.5\n1;129;49;64;192;1\n3;65;97;32;96;.75\n"),
      write("lines.jsonl",
            "{\"frame\":1,\"boxes\":[[65,49,32,96],[1,2,3,4],[129,49,64,192]],\"scores\":[0.5,1,1],"
            "\"classes\":[\"person\",\"dog\",0]}\n\n"
            "{\"frame\":2,\"boxes\":[]}\n{\"boxes\":[[65,97,32,96]],\"scores\":[0.75]}\n"),
      write("kitti.txt",
            "0 1 Pedestrian 0 0 -10 64 48 96 144 -1 -1 -1 -1000 -1000 -1000 -10 0.5\n"
            "0 2 Pedestrian 0 0 -10 128 48 192 240 -1 -1 -1 -1000 -1000 -1000 -10 1\n"
            "0 3 Car 0 0 -10 1 4 19 24 -1 -1 -1 -1000 -1000 -1000 -10 1\n"
            "2 1 Pedestrian 0 0 -10 64 96 96 192 -1 -1 -1 -1000 -1000 -1000 -10 0.75\n"),
      write("results.json",
            "[{\"image_id\":3,\"category_id\":1,\"bbox\":[64,96,32,96],\"score\":0.75},\n"
            "{\"image_id\":1,\"category_id\":1,\"bbox\":[64,48,32,96],\"score\":0.5},\n"
            "{\"image_id\":1,\"category_id\":3,\"bbox\":[1,1,3,9],\"score\":0.5},\n"
            "{\"image_id\":1,\"category_id\":1,\"bbox\":[128,48,64,192],\"score\":1}]"),
      write("annotations.json",
            "{\"images\":[{\"id\":70,\"file_name\":\"a/000001.jpg\"},"
            "{\"id\":72,\"file_name\":\"a/000003.jpg\"}],"
            "\"categories\":[{\"id\":5,\"name\":\"Pedestrian\"}],\"annotations\":["
            "{\"image_id\":70,\"category_id\":5,\"bbox\":[64,48,32,96],\"score\":0.5},"
            "{\"image_id\":70,\"category_id\":5,\"iscrowd\":1,\"bbox\":[0,0,9,9]},"
            "{\"image_id\":70,\"category_id\":5,\"bbox\":[128,48,64,192]},"
            "{\"image_id\":72,\"category_id\":5,\"bbox\":[64,96,32,96],\"score\":0.75}]}")};
  write("yolo/labels/clip_1.txt",
        "0 0.125 0.2 0.05 0.2 0.5\n2 0.1 0.1 0.1 0.1 1\n0 0.25 0.3 0.1 0.4\n");
  write("yolo/labels/clip_3.txt", "0 0.125 0.3 0.05 0.2 0.75\n");
  write("yolo/labels/classes.txt", "person\nbicycle\ncar\n");
  files.push_back(folder_ / "yolo");
  for (const auto& path : files) {
    const auto file = read_detections(path, reading);
    ASSERT_EQ(file.size(), 3u) << path;
    EXPECT_EQ(file.last_frame(), 3) << path;
    const auto expect = [&](const Detection& detection, const Tlwh& box, double score) {
      EXPECT_NEAR(detection.box.left, box.left, 1e-9) << path;
      EXPECT_NEAR(detection.box.top, box.top, 1e-9) << path;
      EXPECT_NEAR(detection.box.width, box.width, 1e-9) << path;
      EXPECT_NEAR(detection.box.height, box.height, 1e-9) << path;
      EXPECT_EQ(detection.score, score) << path;
    };
    expect(file.frame(1)[0], {65, 49, 32, 96}, 0.5);
    expect(file.frame(1)[1], {129, 49, 64, 192}, 1);
    expect(file.frame(3)[0], {65, 97, 32, 96}, 0.75);
  }
}

TEST_F(DetectionFormats, FramesCanBeMovedAndClassesChosen) {
  const auto zero = write("zero.txt", "0,-1,1,1,5,5,1,2\n4,-1,2,1,5,5,1,0\n");
  EXPECT_THAT(refusal(zero), HasSubstr("zero.txt:1: frame is 0, expected >= 1"));
  EXPECT_EQ(read_detections(zero, {.frame_offset = 1}).last_frame(), 5);
  EXPECT_EQ(read_detections(zero, {.classes = ClassFilter("2"), .frame_offset = 1}).size(), 1u);
  EXPECT_THAT(refusal(zero, {.classes = ClassFilter("7"), .frame_offset = 1}),
              HasSubstr("no box has a wanted class (7)"));
  const auto cars = write("cars.csv", "frame,x,y,w,h,class\n0,1,1,5,5,car\n0,1,1,5,5,2\n");
  EXPECT_THAT(refusal(cars), HasSubstr("cars.csv:2: frame is 0, expected >= 1"));
  EXPECT_THAT(refusal(cars, {.frame_offset = 3}),
              HasSubstr("expected person,pedestrian; there are car (2), choose with --classes"));
  EXPECT_EQ(read_detections(cars, {.classes = ClassFilter("Car"), .frame_offset = 3}).size(), 2u);
}

TEST_F(DetectionFormats, EmbeddingsComeAlongAndHaveLengthOne) {
  const auto file = read_detections(write(
      "v.jsonl", "{\"frame\":2,\"boxes\":[[1,1,5,5],[9,9,5,5]],\"embeddings\":[[3,4],[0,-2]]}\n"));
  EXPECT_EQ(file.dimension(), 2);
  EXPECT_THAT(file.embeddings(2), testing::ElementsAre(0.6F, 0.8F, 0, -1));
  EXPECT_TRUE(file.embeddings(1).empty());
}

TEST_F(DetectionFormats, SayWhatIsWrongWhere) {
  const auto expect = [&](const std::string& name, const std::string& text,
                          const std::string& said) {
    EXPECT_THAT(refusal(write(name, text), {.width = 640, .height = 480}), HasSubstr(said)) << text;
  };
  expect("a.csv", "frame,x,y,w\n1,1,1,1\n",
         "a.csv:1: the header has no column 'height' or 'bottom'");
  expect("a.csv", "frame,x,y,w,h\n1,1,1,one,1\n", "a.csv:2: width is 'one', expected a number");
  expect("a.csv", "frame,x,y,w,h\n1,1,1\n", "a.csv:2: width is missing");
  expect("a.csv", "frame,x,y,x2,y2\n1,9,1,5,5\n", "a.csv:2: width is -4, expected > 0");
  expect("a.csv", "frame,x,y,w,h\n1.5,9,1,5,5\n", "a.csv:2: frame is 1.5, expected a whole number");
  expect("k.txt", "0 1 Pedestrian 0 0 -10 64 48 60 144 -1 -1 -1 0 0 0 0\n",
         "k.txt:1: width is -4, expected > 0");
  write("y/1.txt", "0 458.64 73.00 17.83 43.49 0.7\n");
  EXPECT_THAT(refusal(folder_ / "y", {.width = 640, .height = 480}),
              HasSubstr("1.txt:1: cx is 458.64, expected a fraction of the picture, 0..1"));
  expect("c.json", "[{\"image_id\":1,\"category_id\":1}]", "c.json: entry 1: bbox is missing");
  expect("c.json", "[{\"image_id\":1,\"category_id\":1,\"bbox\":[1,2,3]}]",
         "entry 1: bbox is [1,2,3], expected [left, top, width, height]");
  expect("c.json", "[{\"image_id\":1,\"category_id\":1,\"bbox\":[1,2,3,-3]}]",
         "entry 1: bbox: height is -3, expected > 0");
  expect("c.json", "[{\"image_id\":\"x\",\"category_id\":1,\"bbox\":[1,2,3,3]}]",
         "entry 1: image_id is \"x\", expected a whole number");
  expect("c.json", "[{\"image_id\":1,", "c.json");
  expect("c.json", "{\"info\": 1}", "c.json: is no COCO file");
  const std::string first = "{\"boxes\":[[1,1,5,5]],\"embeddings\":[[1,0]]}\n";
  expect("l.jsonl", "{\"boxes\":[[1,1,5,5]],\"scores\":[1,2]}\n",
         "l.jsonl:1: scores has 2 entries, expected 1, one a box");
  expect("l.jsonl", "{\"boxes\":[],\"score\":[]}\n", "l.jsonl:1: unknown key 'score'");
  expect("l.jsonl", "{\"frame\":1,\"bbox\":[]}\n{\"frame\":2,\"bbox\":[]}\n",
         "l.jsonl:1: has no boxes, expected {");
  expect("d.gz", "\x1f\x8b\x08\x01", "d.gz: is no text, expected boxes");
  expect("l.jsonl", "{\"frame\":2,\"boxes\":[]}\n{\"frame\":2,\"boxes\":[]}\n",
         "l.jsonl:2: frame 2 follows frame 2, expected a later one");
  expect("l.jsonl", "{\"boxes\":[],\"time\":2}\n{\"boxes\":[],\"time\":1}\n",
         "l.jsonl:2: time is 1, expected >= 2");
  expect("l.jsonl", first + "{\"boxes\":[[1,1,5,5]],\"embeddings\":[[1]]}\n",
         "l.jsonl:2: embeddings[0] has 1 values, expected 2");
  expect("l.jsonl", first + "{\"boxes\":[[1,1,5,5]]}\n", "l.jsonl:2: embeddings are missing");
  expect("l.jsonl", first + "{\"boxes\":[[1,1,5,5]],\"embeddings\":[[0,0]]}\n",
         "l.jsonl:2: embeddings[0] has no length");
  EXPECT_THAT(refusal(folder_ / "y"), HasSubstr("whose size is not known"));
  EXPECT_THAT(refusal(folder_ / "none.txt"), HasSubstr("none.txt: cannot be opened"));
  fs::create_directory(folder_ / "empty");
  EXPECT_THAT(refusal(folder_ / "empty", {.width = 9, .height = 9}), HasSubstr("holds no .txt"));
  EXPECT_THROW(ClassFilter("person,,car"), std::invalid_argument);
}

TEST_F(DetectionFormats, OneFileOfAYoloFolderIsKnown) {
  const std::string cure =
      "000001.txt: looks like YOLO's labels of one picture, expected the folder that holds such a "
      "file for each frame (or name its format with --detections-format)";
  for (const std::string row :
       {"0 0.5 0.5 0.1 0.3\n", "2 0.51 0.5 0.1 0.3 0.97\n", "0 -0.01 0.5 0.1 1.02\n"}) {
    EXPECT_THAT(refusal(write("000001.txt", row)), HasSubstr(cure)) << row;
  }
  EXPECT_THAT(refusal(write("000001.txt", "0 458.64 73.00 17.83 43.49 0.7766\n")),
              HasSubstr("000001.txt: has 6 columns, as YOLO's labels do, but they are no fractions "
                        "of the picture; expected a folder"));
  EXPECT_THAT(
      refusal(folder_ / "000001.txt", {.format = DetectionFormat::yolo}),
      HasSubstr("000001.txt: is no folder, expected the one that holds a text file for each "
                "frame (yolo)"));
  EXPECT_THAT(refusal(folder_ / "000001.txt", {.format = DetectionFormat::mot}),
              HasSubstr("000001.txt:1: frame is 0, expected >= 1"));
  EXPECT_EQ(refusal(write("blanks.txt", "1 -1 0.5 0.5 0.1 0.3 0.97\n")), "nothing");
}

TEST_F(DetectionFormats, TextOfWindowsIsRead) {
  const std::string row = "1,-1,65,49,32,96,0.5";
  EXPECT_EQ(refusal(write("crlf.txt", "\xEF\xBB\xBF" + row + "\r\n")), "nothing");
  std::string wide = "\xFF\xFE";
  for (const char c : row) wide += std::string{c, '\0'};
  EXPECT_THAT(refusal(write("wide.txt", wide)),
              HasSubstr("wide.txt: is UTF-16 text, expected UTF-8"));
}

TEST(ClassNames, AreThoseOfCoco) {
  EXPECT_EQ(coco_class_name(0), "person");
  EXPECT_EQ(coco_class_name(79), "toothbrush");
  EXPECT_EQ(coco_class_name(80), "");
  EXPECT_EQ(coco_category_name(1), "person");
  EXPECT_EQ(coco_category_name(13), "stop sign");
  EXPECT_EQ(coco_category_name(12), "");
  EXPECT_EQ(coco_category_name(90), "toothbrush");
  EXPECT_EQ(coco_category_name(91), "");
}

}  // namespace
}  // namespace sdmt::mot

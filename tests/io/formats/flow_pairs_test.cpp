#include "pade/io/formats/flow_pairs.hpp"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

class FlowFolders : public testing::Test {
 protected:
  /// An empty file: only names matter here.
  void touch(const std::string& name) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << "x";
  }
  /// One pair with these files, from every folder that may be named.
  void expect_pair(std::initializer_list<const char*> given, const char* name, const char* first,
                   const char* second, const char* truth) const {
    for (const char* folder : given) {
      const auto pairs = find_flow_pairs(folder_ / folder);
      ASSERT_TRUE(pairs) << folder << ": " << pairs.error().message;
      ASSERT_EQ(pairs->size(), 1U) << folder;
      EXPECT_EQ(pairs->front().name, name);
      EXPECT_TRUE(fs::equivalent(pairs->front().first, folder_ / first)) << pairs->front().first;
      EXPECT_TRUE(fs::equivalent(pairs->front().second, folder_ / second)) << pairs->front().second;
      EXPECT_TRUE(fs::equivalent(pairs->front().truth, folder_ / truth)) << pairs->front().truth;
    }
  }
  test::TemporaryFolder folder_;
};

TEST_F(FlowFolders, OfMiddleburyHaveDataAndTruthApart) {
  touch("other-data/Urban/frame10.png");
  touch("other-data/Urban/frame11.png");
  touch("other-data/Hidden/frame10.png");
  touch("other-gt-flow/Urban/flow10.flo");
  expect_pair({"", "other-data"}, "Urban", "other-data/Urban/frame10.png", "other-data/Urban/frame11.png",
              "other-gt-flow/Urban/flow10.flo");
}

TEST_F(FlowFolders, OfEightFramesHaveTheTruthOfTwo) {
  for (int i = 7; i < 15; ++i)
    touch("Urban/frame" + std::string(i < 10 ? "0" : "") + std::to_string(i) + ".png");
  touch("Urban/flow10.flo");
  expect_pair({"", "Urban"}, "Urban", "Urban/frame10.png", "Urban/frame11.png", "Urban/flow10.flo");
}

TEST_F(FlowFolders, OfKittiAre2012And2015) {
  for (const char* images : {"a/training/image_2", "b/training/image_0", "b/training/colored_0"}) {
    touch(std::string(images) + "/000004_10.png");
    touch(std::string(images) + "/000004_11.png");
    touch(std::string(images) + "/000004_12.png");
  }
  touch("a/training/flow_occ/000004_10.png");
  touch("b/training/flow_noc/000004_10.png");
  expect_pair({"a", "a/training"}, "000004", "a/training/image_2/000004_10.png",
              "a/training/image_2/000004_11.png", "a/training/flow_occ/000004_10.png");
  expect_pair({"b/training"}, "000004", "b/training/image_0/000004_10.png",
              "b/training/image_0/000004_11.png", "b/training/flow_noc/000004_10.png");
}

TEST_F(FlowFolders, OfSintelHaveOneTruthPerFrame) {
  for (const char* file :
       {"clean/alley/frame_0001.png", "clean/alley/frame_0002.png", "clean/alley/frame_0003.png",
        "final/alley/frame_0001.png", "flow/alley/frame_0001.flo", "flow/alley/frame_0002.flo"}) {
    touch("training/" + std::string(file));
  }
  const auto pairs = find_flow_pairs(folder_.path());
  ASSERT_TRUE(pairs) << pairs.error().message;
  ASSERT_EQ(pairs->size(), 2U);
  EXPECT_EQ(pairs->at(1).name, "alley/frame_0002");
  EXPECT_EQ(pairs->at(1).second.filename(), "frame_0003.png");
}

TEST_F(FlowFolders, MayHoldBitmaps) {
  touch("x/frame10.bmp");
  touch("x/frame11.bmp");
  touch("x/flow10.flo");
  expect_pair({"", "x"}, "x", "x/frame10.bmp", "x/frame11.bmp", "x/flow10.flo");
}

TEST_F(FlowFolders, WithoutPairsAreRefusedWithTheLayouts) {
  touch("x/frame10.png");
  const auto pairs = find_flow_pairs(folder_.path());
  ASSERT_FALSE(pairs);
  EXPECT_NE(pairs.error().message.find("Sintel"), std::string::npos);
}

}  // namespace
}  // namespace pade::io

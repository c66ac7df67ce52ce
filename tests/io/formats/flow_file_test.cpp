#include "pade/io/formats/flow_file.hpp"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include <gmock/gmock.h>

#include "pade/io/formats/flow_pairs.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

// Multiples of 1/64 px, which both formats hold exactly, with a hole.
cv::Mat some_flow() {
  cv::Mat flow(5, 7, CV_32FC2);
  for (int v = 0; v < flow.rows; ++v) {
    for (int u = 0; u < flow.cols; ++u) {
      flow.at<cv::Vec2f>(v, u) = {static_cast<float>(u * 37 - v) / 64.0F,
                                  static_cast<float>(v * 411 - 900) / 64.0F};
    }
  }
  flow.at<cv::Vec2f>(2, 3) = {kNone, kNone};
  return flow;
}

void expect_same(const cv::Mat& a, const cv::Mat& b) {
  ASSERT_EQ(a.size(), b.size());
  for (int v = 0; v < a.rows; ++v) {
    for (int u = 0; u < a.cols; ++u) {
      for (int c = 0; c < 2; ++c) {
        const float x = a.at<cv::Vec2f>(v, u)[c];
        const float y = b.at<cv::Vec2f>(v, u)[c];
        EXPECT_TRUE(x == y || (std::isnan(x) && std::isnan(y))) << u << ' ' << v << ": " << x << ' ' << y;
      }
    }
  }
}

class FlowFile : public ::testing::TestWithParam<const char*> {};

TEST_P(FlowFile, ReturnsWhatWasWritten) {
  const fs::path file = fs::path(::testing::TempDir()) / (std::string("pade_flow_roundtrip") + GetParam());
  const cv::Mat flow = some_flow();
  ASSERT_TRUE(write_flow(file, flow).ok());
  const auto read = read_flow(file);
  ASSERT_TRUE(read.ok()) << read.error().message;
  expect_same(*read, flow);
  fs::remove(file);
}

TEST_P(FlowFile, IsWrittenFromAViewOfALargerField) {
  cv::Mat large(20, 20, CV_32FC2, cv::Scalar::all(9));
  const cv::Mat view = large(cv::Rect(4, 5, 7, 5));
  some_flow().copyTo(view);
  const auto bytes = std::string(GetParam()) == ".flo" ? encode_flo(view) : encode_kitti_flow(view);
  const auto back =
      std::string(GetParam()) == ".flo" ? decode_flo(bytes, "x") : decode_kitti_flow(bytes, "x");
  ASSERT_TRUE(back.ok());
  expect_same(*back, some_flow());
}

TEST_P(FlowFile, CutShortAnywhereIsRefusedAndNamed) {
  const bool flo = std::string(GetParam()) == ".flo";
  auto bytes = flo ? encode_flo(some_flow()) : encode_kitti_flow(some_flow());
  for (std::size_t n = 0; n + (flo ? 1 : 20) < bytes.size(); n += 13) {
    const std::span<const std::uint8_t> part(bytes.data(), n);
    const auto read = flo ? decode_flo(part, "cut") : decode_kitti_flow(part, "cut");
    if (flo) {
      ASSERT_FALSE(read.ok()) << n;
    }
    if (!read.ok()) {
      EXPECT_THAT(read.error().message, ::testing::StartsWith("cut: "));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, FlowFile, ::testing::Values(".flo", ".png"),
                         [](const auto& format) { return std::string(format.param).substr(1); });

TEST(FloFile, RefusesSizesThatDoNotFitItsLength) {
  auto bytes = encode_flo(some_flow());
  for (const std::int32_t width : {0, -1, 6, 8, 40000, std::numeric_limits<std::int32_t>::max()}) {
    std::memcpy(bytes.data() + 4, &width, 4);
    EXPECT_FALSE(decode_flo(bytes, "x").ok()) << width;
  }
}

TEST(FloFile, UnknownIsAnyValueBeyondTheLimit) {
  cv::Mat flow(1, 3, CV_32FC2, cv::Scalar::all(1));
  flow.at<cv::Vec2f>(0, 0) = {2e9F, 0};
  flow.at<cv::Vec2f>(0, 1) = {0, -std::numeric_limits<float>::infinity()};
  const auto read = decode_flo(encode_flo(flow), "x");
  ASSERT_TRUE(read.ok());
  EXPECT_TRUE(std::isnan(read->at<cv::Vec2f>(0, 0)[1]));
  EXPECT_TRUE(std::isnan(read->at<cv::Vec2f>(0, 1)[0]));
  EXPECT_EQ(read->at<cv::Vec2f>(0, 2)[0], 1.0F);
}

TEST(KittiFlow, VectorsBeyondTheFormatAreUnknown) {
  cv::Mat flow(1, 4, CV_32FC2, cv::Scalar::all(0));
  flow.at<cv::Vec2f>(0, 0) = {600, 0};
  flow.at<cv::Vec2f>(0, 1) = {0, -512.1F};
  flow.at<cv::Vec2f>(0, 2) = {511.98F, -512};
  const auto read = decode_kitti_flow(encode_kitti_flow(flow), "x");
  ASSERT_TRUE(read.ok());
  EXPECT_TRUE(std::isnan(read->at<cv::Vec2f>(0, 0)[0]));
  EXPECT_TRUE(std::isnan(read->at<cv::Vec2f>(0, 1)[0]));
  EXPECT_NEAR(read->at<cv::Vec2f>(0, 2)[0], 511.98F, 1.0 / 128);
  EXPECT_EQ(read->at<cv::Vec2f>(0, 2)[1], -512.0F);
  EXPECT_EQ(read->at<cv::Vec2f>(0, 3)[1], 0.0F);
}

TEST(FlowPairs, AreFoundInTheMiddleburyAndKittiLayouts) {
  const fs::path data = fs::path(PADE_SOURCE_DIR) / "../shared/data/flow";
  if (!fs::exists(data)) GTEST_SKIP() << "no recordings at " << data;
  const auto middlebury = find_flow_pairs(data / "middlebury");
  ASSERT_TRUE(middlebury.ok()) << middlebury.error().message;
  EXPECT_EQ(middlebury->size(), 8U);
  EXPECT_EQ(middlebury->front().name, "Dimetrodon");
  EXPECT_EQ(middlebury->front().first.filename(), "frame10.png");
  const auto kitti = find_flow_pairs(data / "kitti");
  ASSERT_TRUE(kitti.ok());
  ASSERT_EQ(kitti->size(), 1U);
  EXPECT_TRUE(read_flow(kitti->front().truth).ok());
}

TEST(FlowPairs, AFolderWithoutPairsIsRefused) {
  EXPECT_FALSE(find_flow_pairs("/nowhere").ok());
  const fs::path empty = fs::path(::testing::TempDir()) / "pade_flow_no_pairs";
  fs::create_directories(empty);
  EXPECT_FALSE(find_flow_pairs(empty).ok());
  fs::remove(empty);
}

}  // namespace
}  // namespace pade::io

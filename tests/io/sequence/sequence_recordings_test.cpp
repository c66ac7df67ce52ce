// The recordings of the shared data, where they are present.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/io/sequence/sequence.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

struct Recording {
  const char* name;
  std::size_t frames;
  bool truth;
  const char* up;
  double valid_truth;  ///< share of pixels, from the recording's README
};

class Recordings : public testing::TestWithParam<Recording> {
 protected:
  const fs::path folder_ = fs::path(PADE_SOURCE_DIR) / "../shared/data/sequences" / GetParam().name;
  void SetUp() override {
    if (!fs::exists(folder_)) GTEST_SKIP() << folder_ << " is absent";
  }
};

TEST_P(Recordings, OpenWithoutComplaint) {
  SequenceOptions options;
  options.strict = true;
  const auto sequence = Sequence::open(folder_, options);
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->size(), GetParam().frames);
  EXPECT_EQ(sequence->listed_frames(), GetParam().frames);
  EXPECT_THAT(sequence->notes(), testing::IsEmpty());
  ASSERT_TRUE(sequence->world_up());
  EXPECT_EQ(to_text(sequence->world_up()->direction), GetParam().up);
  EXPECT_EQ(sequence->has_truth(), GetParam().truth);
  EXPECT_TRUE(sequence->frame(0));
  if (!GetParam().truth) return;
  const auto depth = sequence->truth(10);
  ASSERT_TRUE(depth);
  const double valid = cv::countNonZero(*depth == *depth) / static_cast<double>(depth->total());
  EXPECT_NEAR(valid, GetParam().valid_truth, 0.2);
}

TEST_P(Recordings, TheGuessedUpAxisIsTheStatedOneWhereTheCameraIsLevel) {
  const auto sequence = Sequence::open(folder_);
  ASSERT_TRUE(sequence);
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < sequence->size(); ++i) up -= sequence->pose(i).matrix3().col(1);
  EXPECT_GT(up.normalized().dot(sequence->world_up()->direction), 0.7);
}

INSTANTIATE_TEST_SUITE_P(All, Recordings,
                         testing::Values(Recording{"kitti01_ramp_forward", 51, true, "-y", 0.57},
                                         Recording{"redkitchen_sideways", 50, true, "-y", 0.67},
                                         Recording{"tartan_hospital", 55, true, "+z", 1.0},
                                         Recording{"mononav_crazyflie_forward_nodepth", 45, false, "-y", 0}),
                         [](const auto& kind) { return std::string(kind.param.name); });

TEST(Mononav, EveryPixelOfTheBlackBorderIsMaskedAndLittleElse) {
  const fs::path folder =
      fs::path(PADE_SOURCE_DIR) / "../shared/data/sequences/mononav_crazyflie_forward_nodepth";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is absent";
  SequenceOptions options;
  options.mask_growth = 0;
  const auto sequence = Sequence::open(folder, options);
  ASSERT_TRUE(sequence);
  cv::Mat brightest = cv::Mat::zeros(sequence->camera().size(), CV_8UC1);
  for (const auto& entry : fs::directory_iterator(folder / "rgb")) {
    cv::max(brightest, *load_image(entry.path(), Pixels::grey), brightest);
  }
  const cv::Mat black = brightest == 0;
  EXPECT_GT(cv::countNonZero(black), 0.03 * static_cast<double>(black.total()));
  EXPECT_LE(cv::countNonZero(black & sequence->mask()), 16) << "a speck inside the image may be kept";
  EXPECT_EQ(cv::countNonZero(~black & ~sequence->mask()), 0);
}

}  // namespace
}  // namespace pade::io

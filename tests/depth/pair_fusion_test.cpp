#include "pade/depth/pair_fusion.hpp"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

namespace pade::depth {
namespace {

constexpr float kNoDepth = std::numeric_limits<float>::quiet_NaN();

struct Pixel {
  DepthState state;
  float z = kNoDepth, variance = kNoDepth, bound = kNoDepth;
};

DepthImage image(const Pixel& pixel) {
  DepthImage out;
  out.depth = cv::Mat(1, 1, CV_32FC1, cv::Scalar(pixel.z));
  out.variance = cv::Mat(1, 1, CV_32FC1, cv::Scalar(2 * pixel.variance));
  out.own_variance = cv::Mat(1, 1, CV_32FC1, cv::Scalar(pixel.variance));
  out.bound = cv::Mat(1, 1, CV_32FC1, cv::Scalar(pixel.bound));
  out.state = cv::Mat(1, 1, CV_8UC1, cv::Scalar(static_cast<int>(pixel.state)));
  return out;
}

bool same(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

TEST(PairFusion, EachCaseOfTwoPixels) {
  using enum DepthState;
  struct Case {
    std::string name;
    Pixel shorter, longer, expected;
  };
  const Case cases[] = {
      {"agree", {measured, 5.3F, 0.04F, 4}, {measured, 5, 0.01F, 4.6F}, {measured, 5, 0.01F, 4.6F}},
      {"agree within a tenth, whatever sigma says",
       {measured, 5.4F, 1e-6F, 4},
       {measured, 5, 1e-6F, 4.6F},
       {measured, 5, 1e-6F, 4.6F}},
      {"agree within a large sigma",
       {measured, 9, 4, 3},
       {measured, 5, 0.01F, 4.6F},
       {measured, 5, 0.01F, 4.6F}},
      {"disagree, the shorter is nearer",
       {measured, 3, 1e-4F, 2.5F},
       {measured, 5, 1e-4F, 4.6F},
       {inconsistent, kNoDepth, kNoDepth, 2.5F}},
      {"disagree, the longer is nearer",
       {measured, 5, 1e-4F, 4.6F},
       {measured, 3, 1e-4F, 2.5F},
       {inconsistent, kNoDepth, kNoDepth, 2.5F}},
      {"disagree, one without a bound",
       {measured, 5, 1e-4F, kNoDepth},
       {measured, 3, 1e-4F, 2.5F},
       {inconsistent, kNoDepth, kNoDepth, kNoDepth}},
      {"only the shorter: the longer's match left the image",
       {measured, 2, 0.1F, 1.5F},
       {out_of_view},
       {measured, 2, 0.1F, 1.5F}},
      {"only the longer: too little parallax in the shorter",
       {low_parallax, kNoDepth, kNoDepth, 8},
       {measured, 12, 0.3F, 10},
       {measured, 12, 0.3F, 10}},
      {"only the longer, in front of the shorter's bound",
       {low_parallax, kNoDepth, kNoDepth, 8},
       {measured, 6, 0.3F, 5},
       {inconsistent, kNoDepth, kNoDepth, 5}},
      {"only the longer, and the shorter contradicts it",
       {inconsistent},
       {measured, 6, 0.3F, 5},
       {inconsistent, kNoDepth, kNoDepth, kNoDepth}},
      {"only the longer, whose match the shorter cannot see",
       {out_of_view},
       {measured, 6, 0.3F, 5},
       {inconsistent, kNoDepth, kNoDepth, kNoDepth}},
      {"neither, the longer reaches farther",
       {low_parallax, kNoDepth, kNoDepth, 8},
       {far, kNoDepth, kNoDepth, 30},
       {far, kNoDepth, kNoDepth, 30}},
      {"neither, the shorter reaches farther",
       {low_parallax, kNoDepth, kNoDepth, 8},
       {epipole, kNoDepth, kNoDepth, 3},
       {low_parallax, kNoDepth, kNoDepth, 8}},
      {"neither, only the shorter has a bound",
       {low_parallax, kNoDepth, kNoDepth, 8},
       {out_of_view},
       {low_parallax, kNoDepth, kNoDepth, 8}},
      {"neither, only the longer has a bound",
       {no_texture},
       {low_parallax, kNoDepth, kNoDepth, 8},
       {low_parallax, kNoDepth, kNoDepth, 8}},
  };
  for (const Case& c : cases) {
    const DepthImage shorter = image(c.shorter);
    DepthImage fused = image(c.longer);
    fuse_pairs(shorter, fused);
    EXPECT_EQ(static_cast<int>(fused.state.at<std::uint8_t>(0, 0)), static_cast<int>(c.expected.state))
        << c.name;
    EXPECT_TRUE(same(fused.depth.at<float>(0, 0), c.expected.z)) << c.name;
    EXPECT_TRUE(same(fused.own_variance.at<float>(0, 0), c.expected.variance)) << c.name;
    EXPECT_TRUE(same(fused.variance.at<float>(0, 0), 2 * c.expected.variance)) << c.name;
    EXPECT_TRUE(same(fused.bound.at<float>(0, 0), c.expected.bound)) << c.name;
    EXPECT_TRUE(same(shorter.depth.at<float>(0, 0), c.shorter.z)) << "the shorter one is only read";
  }
}

}  // namespace
}  // namespace pade::depth

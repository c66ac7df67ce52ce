// The lower bound of depth against its promise: with normal noise, Z < Z_min in no more than the one-sided
// share of k sigma.
#include <cmath>

#include <gtest/gtest.h>

#include "pade/simulation/analytic/analytic_render.hpp"

#include "depth/depth_scene.hpp"

namespace pade::depth {
namespace {

const Camera kBoundCamera = simulation::analytic_camera(160, 120);

double one_sided(double k) { return 0.5 * std::erfc(k / std::sqrt(2.0)); }

/// Pixels with a bound, and those of them that lie before it.
struct Count {
  double bounded = 0;
  double broken = 0;
  void add(const DepthImage& image, const cv::Mat& truth) {
    for (int v = 0; v < truth.rows; ++v) {
      for (int u = 0; u < truth.cols; ++u) {
        const float bound = image.bound.at<float>(v, u);
        const float z = truth.at<float>(v, u);
        if (std::isnan(bound) || std::isnan(z)) continue;
        bounded += 1;
        broken += z < bound ? 1 : 0;
      }
    }
  }
  [[nodiscard]] double share() const { return broken / bounded; }
  /// Three standard deviations of the share that would be counted of `expected`.
  [[nodiscard]] double slack(double expected) const { return 3 * std::sqrt(expected / bounded); }
};

class Bound : public ::testing::TestWithParam<Eigen::Vector3d> {};

TEST_P(Bound, IsBrokenNoMoreOftenThanNormalFlowNoiseAllows) {
  const ScenePair pair(kBoundCamera, GetParam(), {0.004, -0.006, 0.005});
  for (const double k : {1.0, 2.0, 3.0}) {
    Count count;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      DepthOptions options;
      options.flow_sigma = 0.3;
      options.bound_sigmas = k;
      count.add(DepthEstimator(options).estimate({pair.camera, pair.motion, pair.noisy_flow(0.3, seed)}),
                pair.truth);
    }
    EXPECT_GT(count.bounded, 0.6 * 5 * static_cast<double>(pair.truth.total()));
    EXPECT_LT(count.share(), one_sided(k) + count.slack(one_sided(k))) << k;
    if (k < 3) {
      EXPECT_GT(count.share(), 0.3 * one_sided(k)) << "tighter is useless: " << k;
    }
  }
}

TEST_P(Bound, KeepsItsPromiseWithPosesAsUncertainAsTheirCovariance) {
  const ScenePair pair(kBoundCamera, GetParam(), {0.004, -0.006, 0.005});
  RelativeMotion motion = pair.motion;
  const double sigma_t = 0.03 * motion.t_reference_other.norm();
  constexpr double kSigmaTheta = 0.0005;
  motion.covariance.diagonal() << Eigen::Vector3d::Constant(sigma_t * sigma_t),
      Eigen::Vector3d::Constant(kSigmaTheta * kSigmaTheta);
  Random random(8);
  Count count;
  DepthOptions options;
  options.flow_sigma = 0.2;
  options.bound_sigmas = 2;
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    RelativeMotion wrong = motion;
    wrong.t_reference_other += sigma_t * random.normal3();
    wrong.R_reference_other =
        rotation_exp(kSigmaTheta * random.normal3()).toRotationMatrix() * motion.R_reference_other;
    count.add(DepthEstimator(options).estimate({pair.camera, wrong, pair.noisy_flow(0.2, seed)}), pair.truth);
  }
  EXPECT_GT(count.bounded, 0.6 * 25 * static_cast<double>(pair.truth.total()));
  // The errors of a pose are common to its image: 25 draws, not 25 images of pixels.
  EXPECT_LT(count.share(), 2 * one_sided(2));
}

INSTANTIATE_TEST_SUITE_P(EachMotion, Bound,
                         ::testing::Values(Eigen::Vector3d(0, 0, 0.3), Eigen::Vector3d(0, 0, -0.3),
                                           Eigen::Vector3d(0.2, 0, 0), Eigen::Vector3d(0.05, -0.03, 0.2)));

TEST(BoundAtTheEpipole, NeedsTexture) {
  // Forward to a wall: around the epipole the flow is nearly zero at any depth of interest.
  const cv::Size size = kBoundCamera.size();
  const RelativeMotion motion{Eigen::Matrix3d::Identity(), {0, 0, 0.3}};
  Random random(3);
  cv::Mat textured(size, CV_8UC1);
  for (auto& value : cv::Mat_<std::uint8_t>(textured))
    value = cv::saturate_cast<std::uint8_t>(random.uniform(0, 255));
  const cv::Point centre(static_cast<int>(kBoundCamera.cx), static_cast<int>(kBoundCamera.cy));
  const cv::Rect middle(centre.x - 20, centre.y - 20, 40, 40);
  cv::Mat blank = textured.clone();
  blank(middle) = 120;
  cv::Mat stripes = textured.clone();
  for (int u = middle.x; u < middle.br().x; ++u)
    stripes(cv::Rect(u, middle.y, 1, middle.height)) = 128 + 60 * std::sin(0.6 * u);
  const FlowField still{cv::Mat::zeros(size, CV_32FC2), {}};
  DepthOptions options;
  options.flow_sigma = 0.1;
  const auto bounds_near_the_epipole = [&](const cv::Mat& image) {
    const DepthImage depth = DepthEstimator(options).estimate(
        {kBoundCamera, motion, still, Derotation::flow, image, image.clone()});
    EXPECT_GT(cv::countNonZero(depth.bound == depth.bound),
              static_cast<int>(0.8 * (size.area() - middle.area())));
    const cv::Mat around = depth.bound(cv::Rect(centre.x - 3, centre.y - 3, 8, 8));
    return cv::countNonZero(around == around);
  };
  EXPECT_GT(bounds_near_the_epipole(textured), 50);
  EXPECT_EQ(bounds_near_the_epipole(blank), 0);
  EXPECT_EQ(bounds_near_the_epipole(stripes), 0) << "flow along the stripes is not seen";
}

TEST(BoundOfAMask, EndsWhereTheOtherFrameSeesNothing) {
  const ScenePair pair(kBoundCamera, {0.2, 0, 0}, Eigen::Vector3d::Zero());
  cv::Mat valid(kBoundCamera.size(), CV_8UC1, cv::Scalar(255));
  valid.colRange(60, 90) = 0;
  DepthOptions options;
  options.flow_sigma = 0.1;
  DepthInput input{pair.camera, pair.motion, pair.exact.flow};
  input.valid = valid;
  const DepthImage depth = DepthEstimator(options).estimate(input);
  int beside = 0;
  for (int v = 0; v < kBoundCamera.height; ++v) {
    for (int u = 0; u < kBoundCamera.width; ++u) {
      const auto& w = pair.exact.flow.vectors.at<cv::Vec2f>(v, u);
      const long x = std::lround(static_cast<double>(u) + static_cast<double>(w[0]));
      const bool hidden = valid.at<std::uint8_t>(v, u) == 0 || (x >= 60 && x < 90);
      if (hidden) {
        EXPECT_TRUE(std::isnan(depth.bound.at<float>(v, u))) << u << ' ' << v;
      }
      beside += hidden && valid.at<std::uint8_t>(v, u) != 0 ? 1 : 0;
    }
  }
  EXPECT_GT(beside, 100);
}

}  // namespace
}  // namespace pade::depth

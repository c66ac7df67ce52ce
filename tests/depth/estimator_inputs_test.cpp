// Combinations of what the depth estimator is given: turns, derotation, masks, windows, sigmas, the focus of
// expansion.
#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "depth/depth_scene.hpp"

namespace pade::depth {
namespace {

const Camera kInputCamera = simulation::analytic_camera(320, 240);

DepthOptions unlimited() {
  DepthOptions options;
  options.range = 1000;
  return options;
}

TEST(DepthInputs, WhatTheOtherFrameDoesNotSeeIsOutOfViewHoweverItIsTurned) {
  struct Case {
    Eigen::Vector3d t, turn;
  };
  const Case cases[] = {{{0.3, 0, 0}, {0, 0, 0}},
                        {{0.3, 0, 0}, {0, 0.12, 0}},
                        {{0, 0.3, 0}, {0.1, 0, 0}},
                        {{0.2, 0, 0.1}, {0, 0, 0.3}},
                        {{0.2, -0.1, 0.2}, {0.05, -0.08, 0.1}}};
  const cv::Rect hidden(60, 40, 90, 70);
  cv::Mat valid(kInputCamera.size(), CV_8UC1, cv::Scalar(255));
  valid(hidden).setTo(0);
  for (const Case& c : cases) {
    const ScenePair pair(kInputCamera, c.t, c.turn);
    const ScenePair unturned(kInputCamera, c.t, Eigen::Vector3d::Zero());
    const Pose T_other_reference = pair.T_world_other.inverse() * pair.T_world_reference;
    for (const Derotation derotation : {Derotation::image, Derotation::flow}) {
      const FlowField& flow = derotation == Derotation::image ? unturned.exact.flow : pair.exact.flow;
      const DepthImage depth =
          DepthEstimator(unlimited()).estimate({pair.camera, pair.motion, flow, derotation, {}, {}, valid});
      int wrong = 0;
      int out = 0;
      int masked = 0;
      int seen = 0;
      for (int v = 0; v < kInputCamera.height; ++v) {
        for (int u = 0; u < kInputCamera.width; ++u) {
          const double Z = pair.truth.at<float>(v, u);
          if (!(Z > 0) || !(pair.parallax(v, u) > 1)) continue;
          const Eigen::Vector3d there =
              T_other_reference * Eigen::Vector3d(Z * (u - kInputCamera.cx) / kInputCamera.fx,
                                                  Z * (v - kInputCamera.cy) / kInputCamera.fy, Z);
          const double x = kInputCamera.fx * there.x() / there.z() + kInputCamera.cx;
          const double y = kInputCamera.fy * there.y() / there.z() + kInputCamera.cy;
          const auto within = [&](double left, double top, double right, double bottom, double margin) {
            return x >= left + margin && x <= right - margin && y >= top + margin && y <= bottom - margin;
          };
          const auto in_image = [&](double margin) {
            return within(0, 0, kInputCamera.width - 1, kInputCamera.height - 1, margin);
          };
          const auto in_mask = [&](double margin) {
            return within(hidden.x, hidden.y, hidden.br().x - 1, hidden.br().y - 1, margin);
          };
          const bool measured = is_measured(depth, v, u);
          if (!in_image(-0.1)) {
            ++out;
            wrong += depth.state.at<std::uint8_t>(v, u) == static_cast<int>(DepthState::out_of_view) ? 0 : 1;
          } else if (valid.at<std::uint8_t>(v, u) == 0 || in_mask(1)) {
            ++masked;
            wrong += measured || !std::isnan(depth.bound.at<float>(v, u)) ? 1 : 0;
          } else if (in_image(0.1) && !in_mask(-1) && pair.exact.visible.at<std::uint8_t>(v, u) != 0) {
            ++seen;
            wrong += measured ? 0 : 1;
          }
        }
      }
      EXPECT_EQ(wrong, 0) << "turn " << c.turn.transpose() << ", derotation " << to_name(derotation);
      EXPECT_GT(out, 500);
      EXPECT_GT(masked, 3000);
      EXPECT_GT(seen, 15000);
    }
  }
}

TEST(DepthInputs, TheEpipolesDiscEndsWhereFarThingsHaveParallaxOrAQuarterOfTheFocalLengthAway) {
  const FlowField still{cv::Mat::zeros(kInputCamera.size(), CV_32FC2), {}};
  for (const double tz : {0.02, 0.1, 0.2, 0.4}) {
    RelativeMotion motion;
    motion.t_reference_other = {0, 0, tz};
    DepthOptions options = unlimited();
    options.flow_sigma = 0.2;
    const DepthImage depth = DepthEstimator(options).estimate({kInputCamera, motion, still});
    const double with_parallax = options.parallax_gate * options.flow_sigma * (options.far - tz) / tz;
    const double radius = std::min(with_parallax, 0.25 * kInputCamera.fx);
    for (int v = 0; v < kInputCamera.height; v += 3) {
      for (int u = 0; u < kInputCamera.width; ++u) {
        const double r = std::hypot(u - kInputCamera.cx, v - kInputCamera.cy);
        const bool epipole = depth.state.at<std::uint8_t>(v, u) == static_cast<int>(DepthState::epipole);
        if (r < radius - 0.5) {
          ASSERT_TRUE(epipole) << tz << ": " << u << ' ' << v;
        }
        if (r > radius + 0.5) {
          ASSERT_FALSE(epipole) << tz << ": " << u << ' ' << v;
        }
      }
    }
  }
}

TEST(DepthInputs, AWindowIsAsSureAsTheMeanOfItsPixels) {
  const ScenePair pair(kInputCamera, {0.2, 0, 0}, Eigen::Vector3d::Zero());
  Random random(4);
  for (const int n : {2, 4, 8}) {
    FlowField flow = {pair.exact.flow.vectors, cv::Mat(kInputCamera.size(), CV_32FC1)};
    for (float& sigma : cv::Mat_<float>(flow.sigma)) {
      sigma = static_cast<float>(random.uniform(0.05, 0.3));
      if (random.uniform() < 0.1) sigma = std::numeric_limits<float>::quiet_NaN();
    }
    DepthOptions options = unlimited();
    options.window = n;
    const DepthImage cells = DepthEstimator(options).estimate({pair.camera, pair.motion, flow});
    int checked = 0;
    for (int r = 0; r < cells.depth.rows; ++r) {
      for (int c = 0; c < cells.depth.cols; ++c) {
        const double z = cells.depth.at<float>(r, c);
        if (!(z < 8)) continue;  // where the second order is small
        double sum = 0;
        int used = 0;
        for (const float sigma : cv::Mat_<float>(flow.sigma(cv::Rect(c * n, r * n, n, n)))) {
          if (std::isnan(sigma)) continue;
          sum += static_cast<double>(sigma * sigma);
          ++used;
        }
        if (used == 0) continue;
        const double expected = std::pow(z * z / (kInputCamera.fx * 0.2), 2) * sum / (used * used);
        EXPECT_NEAR(cells.own_variance.at<float>(r, c) / expected, 1, 0.03) << n << ": " << c << ' ' << r;
        ++checked;
      }
    }
    EXPECT_GT(checked, 100);
  }
}

TEST(TtcInputs, TheUncertaintyOfTheFocusEntersTheVarianceInFull) {
  // Flow with noise that the options do not own up to: what is left is the error of the focus.
  const ScenePair pair(kInputCamera, {0.01, -0.02, 0.2}, Eigen::Vector3d::Zero());
  DepthOptions options = unlimited();
  options.method = Method::ttc;
  options.gates = Gates::off;
  options.flow_sigma = 0.002;
  const FlowField flow = pair.noisy_flow(0.3, 3);
  DepthEstimator estimator(options);
  const DepthImage depth = estimator.estimate({pair.camera, pair.motion, flow});
  ASSERT_TRUE(estimator.diagnostics().focus);
  const FocusOfExpansion& focus = *estimator.diagnostics().focus;
  const double tz = pair.motion.t_reference_other.z();
  const double axis = 0.5 * focus.covariance.trace() * tz * tz;
  int decided_by_it = 0;
  for (int v = 0; v < kInputCamera.height; v += 2) {
    for (int u = 0; u < kInputCamera.width; u += 2) {
      if (!is_measured(depth, v, u)) continue;
      const auto& w = flow.vectors.at<cv::Vec2f>(v, u);
      const Eigen::Vector2d a =
          tz * (Eigen::Vector2d(u - kInputCamera.cx, v - kInputCamera.cy) - focus.position);
      const double along = a.dot(Eigen::Vector2d(w[0], w[1]));
      const double s = a.squaredNorm() / along;
      const double e2 = std::pow(options.flow_sigma, 2) * a.squaredNorm() / (along * along);
      const double by_flow = std::pow(s * options.flow_sigma, 2) * (1 + e2 * (18 + 400 * e2));
      if (!(along > 1e-2)) continue;  // single precision
      EXPECT_NEAR(depth.own_variance.at<float>(v, u) / (s * s * (by_flow + axis) / a.squaredNorm()), 1, 0.01)
          << u << ' ' << v;
      if (axis > by_flow) ++decided_by_it;
    }
  }
  EXPECT_GT(decided_by_it, 1000);
}

TEST(TtcInputs, WithoutAFocusEveryPixelIsTheEpipole) {
  DepthOptions options = unlimited();
  options.method = Method::ttc;
  const ScenePair pair(kInputCamera, {0.2, 0, 0}, {0, 0.01, 0});
  DepthEstimator estimator(options);
  const DepthImage depth = estimator.estimate({pair.camera, pair.motion, pair.noisy_flow(0.2, 3)});
  ASSERT_FALSE(estimator.diagnostics().focus);
  EXPECT_EQ(cv::countNonZero(depth.state != static_cast<int>(DepthState::epipole)), 0);
}

}  // namespace
}  // namespace pade::depth

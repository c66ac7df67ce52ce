#include "pade/depth/depth_estimator.hpp"

#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "pade/depth/derotation.hpp"
#include "pade/flow/flow_estimator.hpp"

#include "depth/depth_scene.hpp"

namespace pade::depth {
namespace {

const Camera kCamera = simulation::analytic_camera(320, 240);

DepthOptions far_range() {
  DepthOptions options;
  options.range = 1000;
  return options;
}

struct Motion {
  const char* name;
  Eigen::Vector3d translation;
  Eigen::Vector3d rotation;
};
constexpr double kTurn = 0.02;
const Motion kMotions[] = {
    {"Sideways", {0.2, 0, 0}, {0, 0, 0}},
    {"Vertical", {0, -0.2, 0}, {0, 0, 0}},
    {"Forward", {0, 0, 0.2}, {0, 0, 0}},
    {"Backward", {0, 0, -0.2}, {0, 0, 0}},
    {"SidewaysWithPitch", {0.2, 0, 0}, {kTurn, 0, 0}},
    {"SidewaysWithYaw", {0.2, 0, 0}, {0, kTurn, 0}},
    {"SidewaysWithRoll", {0.2, 0, 0}, {0, 0, kTurn}},
    {"VerticalWithPitch", {0, 0.2, 0}, {-kTurn, 0, 0}},
    {"ForwardWithPitch", {0, 0, 0.2}, {kTurn, 0, 0}},
    {"ForwardWithYaw", {0, 0, 0.2}, {0, -kTurn, 0}},
    {"ForwardWithRoll", {0, 0, 0.2}, {0, 0, kTurn}},
    {"DiagonalWithAll", {0.15, -0.1, 0.2}, {kTurn, -kTurn, 0.5 * kTurn}},
};

class EachMotion : public testing::TestWithParam<Motion> {};
std::string motion_name(const testing::TestParamInfo<Motion>& motion) { return motion.param.name; }
INSTANTIATE_TEST_SUITE_P(PadeDepth, EachMotion, testing::ValuesIn(kMotions), motion_name);

TEST_P(EachMotion, FromExactFlowGivesDepthToOnePartInTenThousand) {
  const ScenePair pair(kCamera, GetParam().translation, GetParam().rotation);
  const DepthImage depth = DepthEstimator(far_range()).estimate({pair.camera, pair.motion, pair.exact.flow});
  int checked = 0;
  int of = 0;
  for (int v = 0; v < depth.depth.rows; ++v) {
    for (int u = 0; u < depth.depth.cols; ++u) {
      const double truth = pair.truth.at<float>(v, u);
      if (!(truth > 0) || pair.parallax(v, u) < 1 || pair.exact.visible.at<std::uint8_t>(v, u) == 0) continue;
      ++of;
      if (!is_measured(depth, v, u)) continue;
      ++checked;
      EXPECT_NEAR(depth.depth.at<float>(v, u), truth, 1e-4 * truth) << u << ' ' << v;
    }
  }
  EXPECT_GT(of, 20000);
  EXPECT_EQ(checked, of);  // with this much parallax every pixel that both frames see is measured
}

TEST_P(EachMotion, DerotatingTheImageOrTheFlowIsTheSameForExactFlow) {
  // An image derotated exactly is what a camera in the other place with the reference's orientation sees.
  const ScenePair pair(kCamera, GetParam().translation, GetParam().rotation);
  const ScenePair unturned(kCamera, GetParam().translation, Eigen::Vector3d::Zero());
  const DepthImage from_image =
      DepthEstimator(far_range())
          .estimate({pair.camera, pair.motion, unturned.exact.flow, Derotation::image});
  const DepthImage from_flow =
      DepthEstimator(far_range()).estimate({pair.camera, pair.motion, pair.exact.flow});
  int compared = 0;
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      if (!is_measured(from_image, v, u) || !is_measured(from_flow, v, u) || pair.parallax(v, u) < 1)
        continue;
      const float z = from_flow.depth.at<float>(v, u);
      EXPECT_NEAR(from_image.depth.at<float>(v, u), z, 2e-4F * z) << u << ' ' << v;
      ++compared;
    }
  }
  EXPECT_GT(compared, 15000);
}

TEST_P(EachMotion, TheErrorOfNoisyFlowHasTheStatedVarianceInEachRange) {
  for (const double sigma : {0.1, 0.3, 0.5}) {
    const ScenePair pair(kCamera, GetParam().translation, GetParam().rotation);
    const DepthImage depth =
        DepthEstimator(far_range()).estimate({pair.camera, pair.motion, pair.noisy_flow(sigma, 7)});
    std::array<double, 5> sum{};
    std::array<int, 5> count{};
    for (int v = 0; v < kCamera.height; ++v) {
      for (int u = 0; u < kCamera.width; ++u) {
        if (!is_measured(depth, v, u) || !(pair.truth.at<float>(v, u) > 0)) continue;
        const float truth = pair.truth.at<float>(v, u);
        const auto range = static_cast<std::size_t>(std::min(4.0F, truth / 4));
        const double error = depth.depth.at<float>(v, u) - truth;
        sum[range] += error * error / depth.variance.at<float>(v, u);
        ++count[range];
      }
    }
    for (std::size_t i = 0; i < 4; ++i) {
      if (count[i] < 500) continue;
      const double rms = std::sqrt(sum[i] / count[i]);
      EXPECT_GT(rms, 0.8) << "range " << i << ", noise " << sigma;
      EXPECT_LT(rms, 1.25) << "range " << i << ", noise " << sigma;
    }
    EXPECT_GT(count[0] + count[1] + count[2], 1000);
  }
}

TEST(PadeDepth, TheVarianceAtLowParallaxIsTheIntegralOverALogUniformPriorOnDepth) {
  // Flow of parallax p_hat, noise 1: posterior of p is N(p_hat, 1) / p, and Z = 1 / p. Least p: half the
  // noise.
  for (const double p_hat : {4.0, 5.0, 6.0, 8.0, 12.0, 20.0}) {
    double weight = 0;
    double squared = 0;
    for (double p = 0.5; p < p_hat + 8; p += 1e-3) {
      const double w = std::exp(-0.5 * (p - p_hat) * (p - p_hat)) / p;
      weight += w;
      squared += w * std::pow(1 / p - 1 / p_hat, 2);
    }
    RelativeMotion motion;
    motion.t_reference_other = {1 / kCamera.fx, 0, 0};  // |a| = 1
    FlowField flow{cv::Mat(kCamera.size(), CV_32FC2, cv::Scalar(-p_hat, 0)), {}};
    DepthOptions options = far_range();
    options.flow_sigma = 1;
    options.nearest = 0.01;
    const DepthImage depth = DepthEstimator(options).estimate({kCamera, motion, flow});
    ASSERT_TRUE(is_measured(depth, 120, 160));
    EXPECT_NEAR(depth.variance.at<float>(120, 160) / (squared / weight), 1, 0.35) << p_hat;
  }
}

TEST(PadeDepth, WithoutRotationTheLiteralEquationDiffersByExactlyTheForwardTranslation) {
  for (const double tz : {0.2, -0.2, 0.05}) {
    const ScenePair pair(kCamera, {0.1, 0.05, tz}, Eigen::Vector3d::Zero());
    DepthOptions literal = far_range();
    literal.model = Model::instantaneous;
    const DepthInput input{pair.camera, pair.motion, pair.exact.flow};
    const DepthImage exact = DepthEstimator(far_range()).estimate(input);
    const DepthImage paper = DepthEstimator(literal).estimate(input);
    int compared = 0;
    for (int v = 0; v < kCamera.height; ++v) {
      for (int u = 0; u < kCamera.width; ++u) {
        if (!is_measured(exact, v, u) || !is_measured(paper, v, u)) continue;
        const float z = exact.depth.at<float>(v, u);
        EXPECT_NEAR(z - paper.depth.at<float>(v, u), tz, 1e-6 * static_cast<double>(z) + 1e-6);
        ++compared;
      }
    }
    EXPECT_GT(compared, 20000);
  }
}

TEST(PadeDepth, PureRotationGivesNoDepthAnywhere) {
  for (const Eigen::Vector3d& rotation :
       {Eigen::Vector3d(0.02, 0, 0), Eigen::Vector3d(0, 0.02, 0), Eigen::Vector3d(0, 0, 0.02)}) {
    for (const double tiny : {0.0, 1e-5}) {  // a hovering vehicle is never quite still
      const ScenePair pair(kCamera, {tiny, 0, 0}, rotation);
      for (const auto& flow : {pair.exact.flow, pair.noisy_flow(0.3, 1)}) {
        const DepthImage depth = DepthEstimator(far_range()).estimate({pair.camera, pair.motion, flow});
        EXPECT_EQ(cv::countNonZero(depth.state == static_cast<int>(DepthState::measured)), 0);
        EXPECT_EQ(cv::countNonZero(depth.depth == depth.depth), 0);  // all NaN
      }
    }
  }
}

TEST(PadeDepth, DepthIsMissingExactlyWhereTheStateIsNotMeasured) {
  const ScenePair pair(kCamera, {0.02, 0, 0.2}, {0, 0.02, 0});
  const DepthImage depth =
      DepthEstimator(DepthOptions{}).estimate({pair.camera, pair.motion, pair.noisy_flow(0.5, 3)});
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      EXPECT_EQ(is_measured(depth, v, u), std::isfinite(depth.depth.at<float>(v, u)));
      EXPECT_EQ(is_measured(depth, v, u), depth.variance.at<float>(v, u) > 0);
      if (is_measured(depth, v, u)) {
        EXPECT_GT(depth.depth.at<float>(v, u), 0);
        EXPECT_LE(depth.depth.at<float>(v, u), 20);
      }
    }
  }
}

TEST(PadeDepth, SamelsonIsLeastSquaresTimesTheSquaredCosineOfTheFlowsAngle) {
  const ScenePair pair(kCamera, {0.2, 0, 0}, Eigen::Vector3d::Zero());
  DepthOptions samelson = far_range();
  samelson.reading = Reading::samelson;
  const FlowField flow = pair.noisy_flow(0.3, 5);
  const DepthInput input{pair.camera, pair.motion, flow};
  const DepthImage ls = DepthEstimator(far_range()).estimate(input);
  const DepthImage literal = DepthEstimator(samelson).estimate(input);
  int compared = 0;
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      if (!is_measured(ls, v, u) || !is_measured(literal, v, u)) continue;
      const auto& w = flow.vectors.at<cv::Vec2f>(v, u);  // a points along -x
      const double cosine2 = w[0] * w[0] / (w[0] * w[0] + w[1] * w[1]);
      EXPECT_NEAR(literal.depth.at<float>(v, u), ls.depth.at<float>(v, u) * cosine2,
                  1e-4 * ls.depth.at<float>(v, u));
      ++compared;
    }
  }
  EXPECT_GT(compared, 10000);
}

TEST(PadeDepth, AWindowHoldsTheDepthOfItsMeanFlow) {
  const ScenePair pair(kCamera, {0.2, 0, 0}, {0, 0.01, 0});
  FlowField flow = pair.noisy_flow(0.3, 9);
  flow.vectors.at<cv::Vec2f>(101, 41) =
      cv::Vec2f::all(std::numeric_limits<float>::quiet_NaN());  // is left out
  DepthOptions windowed = far_range();
  windowed.window = 4;
  windowed.flow_sigma = 0.3;
  const DepthImage cells = DepthEstimator(windowed).estimate({pair.camera, pair.motion, flow});
  ASSERT_EQ(cells.depth.size(), cv::Size(80, 60));
  EXPECT_EQ(at_full_size(cells, kCamera.size()).depth.size(), kCamera.size());

  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (int v = 100; v < 104; ++v) {
    for (int u = 40; u < 44; ++u) {
      const auto& w = flow.vectors.at<cv::Vec2f>(v, u);
      if (!(v == 101 && u == 41)) mean += Eigen::Vector2d(w[0], w[1]) / 15;
    }
  }
  const Eigen::Vector2d p(41.5 - kCamera.cx, 101.5 - kCamera.cy);
  const Eigen::Vector2d d = Derotator(kCamera, pair.motion, Model::exact, Derotation::flow)(p, mean);
  const Eigen::Vector2d a = -times_A(kCamera, p, pair.motion.t_reference_other);
  const double z = a.squaredNorm() / a.dot(d) + pair.motion.t_reference_other.z();
  ASSERT_TRUE(is_measured(cells, 25, 10));
  EXPECT_NEAR(cells.depth.at<float>(25, 10), z, 1e-4 * z);
  EXPECT_NEAR(cells.variance.at<float>(25, 10), std::pow(z, 4) * 0.09 / 15 / a.squaredNorm(), 1e-3 * z);
}

TEST(PadeDepth, TheCovarianceOfThePoseEntersTheVariance) {
  // Monte Carlo: exact flow read with poses drawn from the stated covariance scatters as the variance says.
  const ScenePair pair(kCamera, {0.2, 0.05, 0.1}, {0.01, 0.02, -0.01});
  RelativeMotion stated = pair.motion;
  Matrix6d root = Matrix6d::Zero();
  root.diagonal() << 0.002, 0.003, 0.004, 0.0003, 0.0002, 0.0004;
  root(3, 1) = 1e-4;
  stated.covariance = root * root.transpose();
  DepthOptions options = far_range();
  options.flow_sigma = 1e-3;
  const DepthImage prediction = DepthEstimator(options).estimate({pair.camera, stated, pair.exact.flow});

  constexpr int kDraws = 400;
  options.flow_sigma = 0.5;  // so that the scatter is not gated away
  options.residual_angle = 1.2;
  Random random(11);
  cv::Mat sum = cv::Mat::zeros(kCamera.size(), CV_64F);
  cv::Mat squares = sum.clone();
  for (int draw = 0; draw < kDraws; ++draw) {
    Vector6d normal;
    for (double& value : normal) value = random.normal();
    const Vector6d error = root * normal;
    RelativeMotion wrong = pair.motion;
    wrong.t_reference_other += error.head<3>();
    wrong.R_reference_other = rotation_exp(error.tail<3>()).toRotationMatrix() * wrong.R_reference_other;
    const DepthImage depth = DepthEstimator(options).estimate({pair.camera, wrong, pair.exact.flow});
    cv::Mat z;
    depth.depth.convertTo(z, CV_64F);
    sum += z;
    squares += z.mul(z);
  }
  int compared = 0;
  for (int v = 10; v < kCamera.height; v += 20) {
    for (int u = 10; u < kCamera.width; u += 20) {
      const double mean = sum.at<double>(v, u) / kDraws;
      const double variance = squares.at<double>(v, u) / kDraws - mean * mean;
      const float stated_variance = prediction.variance.at<float>(v, u);
      if (!std::isfinite(variance) || !std::isfinite(stated_variance)) continue;
      if (std::sqrt(static_cast<double>(stated_variance)) > 0.1 * mean) continue;  // beyond first order
      EXPECT_NEAR(variance / static_cast<double>(stated_variance), 1, 0.35) << u << ' ' << v;
      ++compared;
    }
  }
  EXPECT_GT(compared, 60);
}

TEST(PadeDepth, AMaskedPixelIsOutOfViewInEitherFrame) {
  const ScenePair pair(kCamera, {0.3, 0, 0}, Eigen::Vector3d::Zero());
  cv::Mat valid(kCamera.size(), CV_8UC1, cv::Scalar(255));
  valid(cv::Rect(100, 0, 30, kCamera.height)).setTo(0);
  const DepthImage depth =
      DepthEstimator(far_range())
          .estimate({pair.camera, pair.motion, pair.exact.flow, Derotation::flow, {}, {}, valid});
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      const auto& w = pair.exact.flow.vectors.at<cv::Vec2f>(v, u);
      const int x = static_cast<int>(std::lround(static_cast<float>(u) + w[0]));
      const bool hidden = (u >= 100 && u < 130) || (x >= 100 && x < 130);
      if (hidden) {
        EXPECT_FALSE(is_measured(depth, v, u)) << u << ' ' << v;
      }
    }
  }
  EXPECT_EQ(depth.state.at<std::uint8_t>(200, 110), static_cast<int>(DepthState::out_of_view));
}

/// Images of the facade scene with sensor noise, through the default flow method.
struct Seen {
  DepthImage depth;
  DepthDiagnostics diagnostics;
};
Seen see(const ScenePair& pair, const DepthOptions& options, double noise) {
  simulation::AnalyticRenderOptions sensor;
  sensor.noise_sigma = noise;
  sensor.noise_seed = 1;
  const cv::Mat reference =
      simulation::render_image(pair.flight.scene, pair.camera, pair.T_world_reference, sensor);
  sensor.noise_seed = 2;
  const cv::Mat other = simulation::render_image(pair.flight.scene, pair.camera, pair.T_world_other, sensor);
  const cv::Mat turned = derotate_image(other, pair.camera, pair.motion);
  const auto method = std::move(flow::make_flow_estimator("dis-medium")).value();
  const FlowField flow = method->estimate(reference, turned);
  DepthEstimator estimator(options);
  Seen seen;
  estimator.estimate({pair.camera, pair.motion, flow, Derotation::image, reference, turned, {}}, seen.depth);
  seen.diagnostics = estimator.diagnostics();
  return seen;
}

/// Share of the pixels of `where` that have the state.
double share(const DepthImage& depth, const cv::Mat& where, DepthState state) {
  const cv::Mat has = depth.state == static_cast<int>(state);
  return static_cast<double>(cv::countNonZero(has & where)) / cv::countNonZero(where);
}

class EachNoise : public testing::TestWithParam<double> {};
std::string noise_name(const testing::TestParamInfo<double>& noise) {
  return "Sigma" + std::to_string(static_cast<int>(noise.param));
}
INSTANTIATE_TEST_SUITE_P(DepthStates, EachNoise, testing::Values(0.0, 1.0, 3.0), noise_name);

TEST_P(EachNoise, ABlankWallAndTheSkyAreNoTextureAndTheEpipoleIsTheEpipole) {
  const Camera camera = simulation::analytic_camera();
  const ScenePair pair(camera, {0, 0, -0.2}, {0, 0.01, 0});
  const DepthImage depth = see(pair, DepthOptions{}, GetParam()).depth;

  // A pixel counts as blank where nothing textured lies within the neighbourhood that the state looks at.
  const cv::Mat labels = simulation::exact_labels(pair.flight.scene, camera, pair.T_world_reference);
  const cv::Mat blank = simulation::textured_mask(pair.flight.scene, labels) == 0;
  const cv::Mat around = cv::Mat::ones(17, 17, CV_8UC1);
  cv::Mat wall;
  cv::Mat sky;
  cv::erode(blank & (labels != 0), wall, around);
  cv::erode(labels == 0, sky, around);
  cv::Mat epipole = cv::Mat::zeros(camera.size(), CV_8UC1);
  cv::circle(epipole, {320, 240}, 3, 255, cv::FILLED);

  ASSERT_GT(cv::countNonZero(wall), 1000);
  ASSERT_GT(cv::countNonZero(sky), 10000);
  for (const cv::Mat& region : {wall, sky, epipole})
    EXPECT_LE(share(depth, region, DepthState::measured), 0.001);
  EXPECT_GE(share(depth, wall, DepthState::no_texture), 0.95);
  EXPECT_GE(share(depth, sky, DepthState::no_texture), 0.95);
  EXPECT_GE(share(depth, epipole, DepthState::epipole), 0.95);
  const cv::Mat rest = (simulation::textured_mask(pair.flight.scene, labels) != 0) & (epipole == 0);
  EXPECT_GT(share(depth, rest, DepthState::measured), 0.7);  // the gates do not simply refuse everything
}

TEST(DepthStates, WithoutGatesEveryPixelWithAPositiveDepthIsPublished) {
  const ScenePair pair(simulation::analytic_camera(), {0.2, 0, 0}, Eigen::Vector3d::Zero());
  DepthOptions all;
  all.gates = Gates::off;
  const DepthImage depth = see(pair, all, 1.0).depth;
  EXPECT_EQ(cv::countNonZero(depth.state == static_cast<int>(DepthState::no_texture)), 0);
  EXPECT_GT(share(depth, cv::Mat(pair.truth < 15), DepthState::measured),
            share(see(pair, DepthOptions{}, 1.0).depth, cv::Mat(pair.truth < 15), DepthState::measured));
}

TEST(DepthStates, TexturedThingsAtInfinityAreFarAndOverAShortBaselineLowParallax) {
  // Flow of a textured far field: derotated flow is noise alone.
  for (const bool large : {true, false}) {
    const ScenePair pair(kCamera, {large ? 0.2 : 0.02, 0, 0}, Eigen::Vector3d::Zero());
    FlowField flow = pair.noisy_flow(0.2, 2);
    Random random(4);
    for (int v = 0; v < 60; ++v) {
      for (int u = 0; u < kCamera.width; ++u) {
        flow.vectors.at<cv::Vec2f>(v, u) = {static_cast<float>(0.2 * random.normal()),
                                            static_cast<float>(0.2 * random.normal())};
      }
    }
    DepthOptions options;
    options.flow_sigma = 0.2;
    const DepthImage depth = DepthEstimator(options).estimate({pair.camera, pair.motion, flow});
    cv::Mat far = cv::Mat::zeros(kCamera.size(), CV_8UC1);
    far.rowRange(0, 60).setTo(255);
    EXPECT_GE(share(depth, far, large ? DepthState::far : DepthState::low_parallax), 0.95);
    EXPECT_LE(share(depth, far, DepthState::measured), 0.003);  // one-sided 3 sigma is 0.0013
    cv::Mat bound = depth.bound.rowRange(0, 60).clone();
    cv::patchNaNs(bound, 0);
    EXPECT_EQ(cv::countNonZero((bound >= options.range) &
                               (depth.state.rowRange(0, 60) == static_cast<int>(DepthState::low_parallax))),
              0);
  }
}

TEST(DepthStates, FlowAcrossTheEpipolarLineIsInconsistent) {
  const ScenePair pair(kCamera, {0.2, 0, 0}, Eigen::Vector3d::Zero());
  FlowField flow = pair.noisy_flow(0.1, 2);
  cv::Mat moving(flow.vectors, cv::Rect(100, 150, 40, 40));
  moving += cv::Scalar(0, 6);
  const DepthImage depth = DepthEstimator(DepthOptions{}).estimate({pair.camera, pair.motion, flow});
  EXPECT_EQ(depth.state.at<std::uint8_t>(170, 120), static_cast<int>(DepthState::inconsistent));
  EXPECT_TRUE(is_measured(depth, 170, 200));
}

TEST(Ttc, ForwardAndBackwardFlightGivesDepthFromTheFlowsOwnFocusOfExpansion) {
  for (const double tz : {0.2, -0.2}) {
    const ScenePair pair(kCamera, {0.01, -0.02, tz}, {0.005, 0.01, 0});
    DepthOptions ttc = far_range();
    ttc.method = Method::ttc;
    DepthEstimator estimator(ttc);
    const DepthImage depth = estimator.estimate({pair.camera, pair.motion, pair.noisy_flow(0.1, 3)});
    ASSERT_TRUE(estimator.diagnostics().focus);
    const Eigen::Vector3d& t = pair.motion.t_reference_other;
    const Eigen::Vector2d epipole(kCamera.fx * t.x() / t.z(), kCamera.fy * t.y() / t.z());
    EXPECT_LT((estimator.diagnostics().focus->position - epipole).norm(), 2);
    double sum = 0;
    int count = 0;
    for (int v = 0; v < kCamera.height; ++v) {
      for (int u = 0; u < kCamera.width; ++u) {
        if (!is_measured(depth, v, u) || !(pair.parallax(v, u) >= 1)) continue;
        sum += std::abs(depth.depth.at<float>(v, u) / pair.truth.at<float>(v, u) - 1);
        ++count;
      }
    }
    EXPECT_GT(count, 15000);
    EXPECT_LT(sum / count, 0.06);
  }
}

TEST(Ttc, MotionWithoutForwardComponentHasNoAnswer) {
  DepthOptions ttc = far_range();
  ttc.method = Method::ttc;
  for (const Eigen::Vector3d& t :
       {Eigen::Vector3d(0.2, 0, 0), Eigen::Vector3d(0, 0.2, 0), Eigen::Vector3d(-0.2, 0.1, 0.002)}) {
    const ScenePair pair(kCamera, t, {0, 0.01, 0});
    DepthEstimator estimator(ttc);
    const DepthImage depth = estimator.estimate({pair.camera, pair.motion, pair.noisy_flow(0.2, 3)});
    EXPECT_FALSE(estimator.diagnostics().focus);
    EXPECT_EQ(cv::countNonZero(depth.state == static_cast<int>(DepthState::measured)), 0);
  }
}

TEST(Ttc, WithTheFocusAtThePosesEpipoleItIsPade) {
  // The two methods differ only through the focus of expansion and the forward speed.
  const ScenePair pair(kCamera, {0, 0, 0.2}, Eigen::Vector3d::Zero());
  DepthOptions ttc = far_range();
  ttc.method = Method::ttc;
  const DepthInput input{pair.camera, pair.motion,
                         pair.exact.flow};  // exact flow: the focus is found exactly
  const DepthImage a = DepthEstimator(ttc).estimate(input);
  const DepthImage b = DepthEstimator(far_range()).estimate(input);
  int compared = 0;
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      if (!is_measured(a, v, u) || !is_measured(b, v, u)) continue;
      EXPECT_NEAR(a.depth.at<float>(v, u), b.depth.at<float>(v, u), 2e-3F * b.depth.at<float>(v, u));
      ++compared;
    }
  }
  EXPECT_GT(compared, 15000);
}

}  // namespace
}  // namespace pade::depth

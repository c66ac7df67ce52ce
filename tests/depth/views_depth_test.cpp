#include "pade/depth/multi_view/views_depth.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "pade/core/random.hpp"

#include "depth/depth_scene.hpp"

namespace pade::depth {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kScale = 1000;  // px m
constexpr auto code(DepthState state) { return static_cast<std::uint8_t>(state); }

/// One pixel of a pair that knows `state` and a depth of 9 m, and of the views.
struct Pixel {
  DepthImage image;
  ParallaxField field;

  Pixel(DepthState state, float d, float information, float matching = 3, float spread = 0) {
    const bool measured = state == DepthState::measured;
    const auto one = [](float value) { return cv::Mat(9, 9, CV_32FC1, cv::Scalar(value)); };
    image.depth = one(measured ? 9 : kNan);
    image.variance = one(measured ? 1.5F : kNan);
    image.own_variance = one(measured ? 1 : kNan);
    image.bound = one(state == DepthState::measured ? 5 : kNan);
    image.state = cv::Mat(9, 9, CV_8UC1, cv::Scalar(code(state)));
    field = {one(d), one(information), one(spread), one(0), one(matching), one(100)};
  }
  void read(const DepthOptions& depth = {}, const ViewsDepthOptions& options = {},
            const CommonError& common = {}) {
    read_views(field, kScale, common, depth, options, image);
  }
  [[nodiscard]] float z() const { return image.depth.at<float>(4, 4); }
  [[nodiscard]] float own() const { return image.own_variance.at<float>(4, 4); }
  [[nodiscard]] float variance() const { return image.variance.at<float>(4, 4); }
  [[nodiscard]] float bound() const { return image.bound.at<float>(4, 4); }
  [[nodiscard]] std::uint8_t state() const { return image.state.at<std::uint8_t>(4, 4); }
};

TEST(ViewsDepth, TakesThePlaceOfThePairWithItsOwnVariance) {
  Pixel p(DepthState::measured, 125, 100);
  p.read({}, {.sigma_scale = 1, .relative_sigma = 0});
  EXPECT_FLOAT_EQ(p.z(), 8);
  // sigma of d is 0.1 px: sigma_Z = Z^2 / scale * 0.1
  EXPECT_NEAR(std::sqrt(p.own()), 64 / kScale * 0.1, 1e-5);
  // exact motions have no error for the pixels to share
  EXPECT_FLOAT_EQ(p.variance(), p.own());
  EXPECT_EQ(p.state(), code(DepthState::measured));
}

TEST(ViewsDepth, WhatTheMotionsErrIsCommonToThePixelsAndShortensTheirBounds) {
  Camera camera{};
  camera.fx = camera.fy = 100;
  camera.cx = camera.cy = 4;
  camera.width = camera.height = 9;
  RelativeMotion motion;
  motion.t_reference_other = {-1, 0, 0};
  motion.covariance(0, 0) = 0.02 * 0.02;  // 2 % of the baseline
  const CommonError common(camera, {motion}, 48);
  Pixel p(DepthState::measured, 125, 100);
  p.read({}, {.sigma_scale = 1, .relative_sigma = 0}, common);
  EXPECT_NEAR(std::sqrt(p.variance() - p.own()), 0.02 * 8, 1e-4);
  DepthOptions options;
  Pixel far(DepthState::low_parallax, 20, 1);
  far.read(options, {.sigma_scale = 1, .relative_sigma = 0}, common);
  EXPECT_NEAR(far.bound(), kScale / (20 + options.bound_sigmas * std::hypot(1, 0.02 * 20)), 1e-3);
}

/// Where no pixel around has texture, what the pair took for some was noise, and so is its bound.
TEST(ViewsDepth, WithoutTextureTheBoundOfThePairGoesToo) {
  for (const DepthState before :
       {DepthState::measured, DepthState::low_parallax, DepthState::far, DepthState::epipole}) {
    Pixel p(before, 20, 100);
    p.image.bound = cv::Scalar(12);
    p.field.texture = cv::Scalar(0);
    p.read();
    EXPECT_EQ(p.state(), code(DepthState::no_texture));
    EXPECT_TRUE(std::isnan(p.bound()));
    EXPECT_TRUE(std::isnan(p.z()));
  }
  Pixel unseen(DepthState::low_parallax, 20, 0, 0);  // by any view: the pair is all there is
  unseen.image.bound = cv::Scalar(12);
  unseen.field.texture = cv::Scalar(0);
  unseen.read();
  EXPECT_FLOAT_EQ(unseen.bound(), 12);
}

/// What the texture around shows lies at another depth: the pixel's own is as uncertain as the two differ.
TEST(ViewsDepth, DepthFromTextureAtAnotherDepthIsUncertain) {
  Pixel p(DepthState::measured, 125, 100);
  p.field.offset.setTo(10);
  p.read({}, {.sigma_scale = 1, .relative_sigma = 0});
  EXPECT_NEAR(std::sqrt(p.own()) / p.z(), 10.0 / 125, 0.01);
}

TEST(ViewsDepth, TextureAsFaintAsTheNoiseSaysNothing) {
  Pixel p(DepthState::measured, 125, 100);
  p.field.texture.setTo(1);
  p.read();
  EXPECT_EQ(p.state(), code(DepthState::no_texture));
  EXPECT_TRUE(std::isnan(p.z()));
}

TEST(ViewsDepth, ViewsThatContradictEachOtherAreLessCertain) {
  Pixel agree(DepthState::measured, 125, 100, 3, 2);
  Pixel contradict(DepthState::measured, 125, 100, 3, 32);
  agree.read({}, {.sigma_scale = 1, .relative_sigma = 0});
  contradict.read({}, {.sigma_scale = 1, .relative_sigma = 0});
  EXPECT_NEAR(contradict.own() / agree.own(), 16, 0.1);
}

TEST(ViewsDepth, TheBoundKeepsSomeSigmasAndNeverExceedsThoseAround) {
  DepthOptions options;
  Pixel p(DepthState::low_parallax, 20, 1);
  p.read(options, {.sigma_scale = 1, .relative_sigma = 0});
  EXPECT_NEAR(p.bound(), kScale / (20 + options.bound_sigmas), 1e-3);
  Pixel beside(DepthState::low_parallax, 20, 1);
  beside.field.distance.at<float>(4, 6) = 100;
  beside.read(options, {.sigma_scale = 1, .relative_sigma = 0});
  EXPECT_NEAR(beside.bound(), kScale / (100 + options.bound_sigmas), 1e-3);
  // of the pair, where it is greater
  Pixel greater(DepthState::measured, 300, 100);
  greater.read();
  EXPECT_GE(greater.bound(), 3.2F);
}

TEST(ViewsDepth, StatesSayWhyThereIsNoDepth) {
  Pixel far(DepthState::measured, 20, 100);  // 50 m
  far.read();
  EXPECT_TRUE(std::isnan(far.z()));
  EXPECT_EQ(far.state(), code(DepthState::far));
  Pixel blank(DepthState::measured, 125, 0);
  blank.read();
  EXPECT_TRUE(std::isnan(blank.z()));
  EXPECT_TRUE(std::isnan(blank.variance()));
  EXPECT_EQ(blank.state(), code(DepthState::no_texture));
  Pixel vague(DepthState::measured, 2, 1);  // 2 +- 1 px
  vague.read();
  EXPECT_EQ(vague.state(), code(DepthState::no_texture));
}

/// A pixel that no view sees, and one that the pair knows to be doubtful, keep what they have.
TEST(ViewsDepth, LeavesAloneWhatTheViewsDoNotKnowBetter) {
  Pixel unseen(DepthState::measured, 125, 0, 0);
  unseen.read();
  EXPECT_FLOAT_EQ(unseen.z(), 9);
  for (const DepthState state : {DepthState::inconsistent, DepthState::out_of_view, DepthState::no_texture}) {
    Pixel p(state, 125, 100);
    p.read();
    EXPECT_EQ(p.state(), code(state));
    EXPECT_TRUE(std::isnan(p.z()));
    EXPECT_TRUE(std::isnan(p.bound()));
  }
}

/// Exact flow and exact depth of the frame before: the start is the depth, to a tenth of a per cent where
/// both frames see the same surface.
TEST(ViewsDepth, TheSearchStartsWhereTheLastFrameHasEnded) {
  const ScenePair pair(simulation::analytic_camera(160, 120), {0.02, 0.01, -0.2}, {0.01, -0.02, 0.005});
  DepthImage none;
  none.depth = cv::Mat(pair.truth.size(), CV_32FC1, cv::Scalar(kNan));
  const cv::Mat last_truth = simulation::exact_depth(pair.flight.scene, pair.camera, pair.T_world_other);
  const InverseDepthImage last{pair.T_world_other, 1 / last_truth};
  const cv::Mat flow(pair.truth.size(), CV_32FC2);
  const Eigen::Vector3d t = pair.motion.t_reference_other;
  for (int v = 0; v < flow.rows; ++v) {
    for (int u = 0; u < flow.cols; ++u) {
      const double z = pair.truth.at<float>(v, u) - t.z();
      const double x = u - pair.camera.cx;
      const double y = v - pair.camera.cy;
      const_cast<cv::Mat&>(flow).at<cv::Vec2f>(v, u) = {
          static_cast<float>(0.9 * (x * t.z() - pair.camera.fx * t.x()) / z),
          static_cast<float>(0.9 * (y * t.z() - pair.camera.fy * t.y()) / z)};
    }
  }
  const auto right = [&](const InverseDepthImage& from) {
    const cv::Mat rho =
        start_of_views(none, flow, pair.camera, pair.motion, pair.T_world_reference, from, 1, {});
    EXPECT_TRUE(cv::checkRange(rho));
    int count = 0;
    int all = 0;
    for (int v = 2; v < flow.rows - 2; ++v) {
      for (int u = 2; u < flow.cols - 2; ++u) {
        const float z = pair.truth.at<float>(v, u);
        if (!std::isfinite(z)) continue;
        ++all;
        if (std::abs(z * rho.at<float>(v, u) - 1) < 1e-2F) ++count;
      }
    }
    return static_cast<double>(count) / all;
  };
  EXPECT_LT(right({}), 0.1);
  EXPECT_GT(right(last), 0.6);
  // One that disagrees is not taken.
  EXPECT_LT(right({pair.T_world_other, 2 / last_truth}), 0.1);
}

/// A camera that stands or creeps: the flow of the pair is noise, which says nothing against what was found
/// over baselines of before. Where the pair has measured a depth, or sees parallax, it does.
TEST(ViewsDepth, APairWithoutParallaxDoesNotGainsayWhatWasFound) {
  for (const double step : {0.0, 0.0005, 0.003}) {
    const ScenePair pair(simulation::analytic_camera(160, 120), {0, 0, -step}, {0.01, -0.02, 0.005});
    const cv::Mat last_truth = simulation::exact_depth(pair.flight.scene, pair.camera, pair.T_world_other);
    const InverseDepthImage last{pair.T_world_other, 1 / last_truth};
    cv::Mat flow(pair.truth.size(), CV_32FC2);
    cv::RNG random(1);
    random.fill(flow, cv::RNG::NORMAL, 0, 0.2);
    DepthImage two_view;
    const auto right = [&] {
      const cv::Mat rho =
          start_of_views(two_view, flow, pair.camera, pair.motion, pair.T_world_reference, last, 3, {});
      EXPECT_TRUE(cv::checkRange(rho));
      const cv::Mat inner = cv::abs(rho.mul(pair.truth) - 1) < 1e-2;
      return cv::countNonZero(inner) / static_cast<double>(cv::countNonZero(pair.truth > 0));
    };
    two_view.depth = cv::Mat(pair.truth.size(), CV_32FC1, cv::Scalar(kNan));
    EXPECT_GT(right(), 0.8) << step;
    two_view.depth.setTo(3.5);  // measured, and far from what was found
    EXPECT_LT(right(), 0.2) << step;
  }
}

/// read_views() pixel by pixel, but for what the bounds around do to a bound.
void read_pixel(const ParallaxField& field, int u, int v, const CommonError& common, DepthImage& image,
                cv::Mat& of_views) {
  const DepthOptions depth;
  const ViewsDepthOptions options;
  const auto range = static_cast<float>(depth.range);
  const auto at = [&](const cv::Mat& plane) { return plane.at<float>(v, u); };
  auto& state = image.state.at<std::uint8_t>(v, u);
  auto& bound = image.bound.at<float>(v, u);
  const auto drop = [&](DepthState why) {
    for (cv::Mat* plane : {&image.depth, &image.variance, &image.own_variance}) plane->at<float>(v, u) = kNan;
    state = code(why);
  };
  for (const DepthState blind : {DepthState::inconsistent, DepthState::out_of_view, DepthState::no_texture}) {
    if (state == code(blind)) return;
  }
  if (at(field.matching) > 0 && at(field.texture) == 0) bound = kNan;
  if (!(at(field.information) > 0) || !(at(field.texture) > 1.6F)) {
    if (at(field.matching) > 0) drop(DepthState::no_texture);
    return;
  }
  const float d = at(field.distance);
  const float n = at(field.matching);
  const float contradiction = n > 1 ? std::max(1.0F, at(field.spread) / (n - 1)) : 1.0F;
  const auto scale2 = static_cast<float>(options.sigma_scale * options.sigma_scale);
  const auto relative2 = static_cast<float>(options.relative_sigma * options.relative_sigma);
  const float offset = at(field.offset);
  const float sigma2 = scale2 * contradiction / at(field.information) + relative2 * d * d + offset * offset;
  const auto gate2 = static_cast<float>(depth.parallax_gate * depth.parallax_gate);
  const auto scale = static_cast<float>(kScale);
  const bool measured = d > 0 && sigma2 * gate2 < d * d && scale <= range * d;
  if (!measured && !(at(field.texture) > 2.4F)) return drop(DepthState::no_texture);
  const float rho = std::max(d, 0.0F) * static_cast<float>(1 / kScale);
  const float shared = static_cast<float>(kScale * kScale) * common(u, v, rho);
  const float found =
      scale / (std::max(d, 0.0F) + static_cast<float>(depth.bound_sigmas) * std::sqrt(sigma2 + shared));
  of_views.at<float>(v, u) = found;
  if (!(bound >= found)) bound = found;
  if (measured) {
    const float z = scale / d;
    const float e2 = sigma2 / (d * d);
    const float own = z * z * e2 * (1 + e2 * (18 + 400 * e2));
    image.depth.at<float>(v, u) = z;
    image.own_variance.at<float>(v, u) = own;
    image.variance.at<float>(v, u) = own + z * z * shared / (d * d);
    state = code(DepthState::measured);
    return;
  }
  if (state == code(DepthState::epipole)) return;
  const bool vague = sigma2 > 0.25F;
  if (state == code(DepthState::measured) || vague)
    drop(vague ? DepthState::no_texture : DepthState::low_parallax);
  if (state == code(DepthState::low_parallax) && bound >= range) state = code(DepthState::far);
}

/// To the last bit, whatever the width leaves over of a vector.
TEST(ViewsDepth, EveryPixelIsReadAsOneByItself) {
  Random random(5);
  const Camera camera = [] {
    Camera c;
    c.width = 45;
    c.height = 31;
    c.fx = c.fy = 40;
    c.cx = 22;
    c.cy = 15;
    return c;
  }();
  std::vector<RelativeMotion> motions(3);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    motions[i].t_reference_other = Eigen::Vector3d(0.3, 0.1, -0.4) * static_cast<double>(i + 1);
    motions[i].covariance = 1e-5 * static_cast<double>(i + 1) * Matrix6d::Identity();
  }
  for (const bool exact : {false, true}) {
    const CommonError common = exact ? CommonError() : CommonError(camera, motions, 8);
    const auto some = [&](double low, double high, double none) {
      cv::Mat plane(camera.size(), CV_32FC1);
      for (auto& value : cv::Mat_<float>(plane)) {
        value = random.uniform() < none ? 0.0F : static_cast<float>(random.uniform(low, high));
      }
      return plane;
    };
    const ParallaxField field = {some(-20, 300, 0.1), some(0, 3, 0.2), some(0, 9, 0.2),
                                 some(-1, 1, 0.5),    some(0, 4, 0.2), some(0, 5, 0.1)};
    DepthImage image;
    image.depth = some(1, 20, 0);
    image.variance = some(0, 1, 0);
    image.own_variance = some(0, 1, 0);
    image.bound = some(1, 40, 0);
    image.bound.setTo(kNan, image.bound > 30);
    image.state = cv::Mat(camera.size(), CV_8UC1);
    for (auto& value : cv::Mat_<std::uint8_t>(image.state))
      value = static_cast<std::uint8_t>(random.uniform(0, 7));
    DepthImage expected = image;
    for (cv::Mat* plane :
         {&expected.depth, &expected.variance, &expected.own_variance, &expected.bound, &expected.state}) {
      *plane = plane->clone();
    }
    cv::Mat of_views(camera.size(), CV_32FC1, cv::Scalar(std::numeric_limits<float>::infinity()));
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) read_pixel(field, u, v, common, expected, of_views);
    }
    cv::Mat least;
    cv::erode(of_views, least, cv::Mat::ones(5, 5, CV_8UC1));
    least.copyTo(expected.bound, expected.bound > least);
    read_views(field, kScale, common, {}, {}, image);
    const auto same = [](const cv::Mat& a, const cv::Mat& b) {
      return std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
    };
    EXPECT_TRUE(same(image.depth, expected.depth));
    EXPECT_TRUE(same(image.variance, expected.variance));
    EXPECT_TRUE(same(image.own_variance, expected.own_variance));
    EXPECT_TRUE(same(image.bound, expected.bound));
    EXPECT_TRUE(same(image.state, expected.state));
  }
}

}  // namespace
}  // namespace pade::depth

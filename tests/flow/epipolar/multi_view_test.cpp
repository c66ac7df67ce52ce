#include "pade/flow/epipolar/multi_view.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "pade/core/random.hpp"

namespace pade::flow {
namespace {

constexpr int kWidth = 200;
constexpr int kHeight = 140;

/// Parallax, px, of the pixels of the reference at a camera step of 1.
using Parallax = std::function<double(int x, int y)>;

/// Texture without a grid: grey values of a surface at column `x`.
double surface(double x, double y, double phase) {
  return 128 + 28 * std::sin(0.55 * x + 0.21 * y + phase) + 22 * std::sin(0.31 * x - 0.47 * y + 2 * phase) +
         18 * std::sin(0.93 * x + 0.71 * y + 3 * phase);
}

struct Surface {
  double parallax;     ///< px per step
  double left, right;  ///< columns of the reference between which it is
  double phase;
};

/// What a camera sees that has gone `step` to the right: surfaces shift left by step * parallax; the nearest
/// in front.
cv::Mat seen(const std::vector<Surface>& surfaces, double step, double noise, std::uint64_t seed) {
  Random random(seed);
  cv::Mat image(kHeight, kWidth, CV_8UC1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      double grey = 128;
      double nearest = -1;
      for (const Surface& s : surfaces) {
        const double on = x + step * s.parallax;  // column of the reference
        if (on < s.left || on >= s.right || s.parallax <= nearest) continue;
        nearest = s.parallax;
        grey = surface(on, y, s.phase);
      }
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(grey + noise * random.normal());
    }
  }
  return image;
}

/// The view at `step`: p' = p - d * step * (1, 0).
View view(const std::vector<Surface>& surfaces, double step, double noise, std::uint64_t seed) {
  View v;
  v.image = seen(surfaces, step, noise, seed);
  v.e = {static_cast<float>(-step), 0, 0};
  return v;
}

cv::Mat constant(double value) { return {kHeight, kWidth, CV_32FC1, cv::Scalar(value)}; }

/// Of |d - truth| over the columns [from, to), 20 px away from the borders.
double median_error(const cv::Mat& distance, double truth, int from = 40, int to = kWidth - 20) {
  std::vector<double> errors;
  for (int y = 20; y < kHeight - 20; ++y) {
    for (int x = from; x < to; ++x) errors.push_back(std::abs(distance.at<float>(y, x) - truth));
  }
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2),
                   errors.end());
  return errors[errors.size() / 2];
}

double mean_over(const cv::Mat& values) {
  return cv::mean(values(cv::Rect(40, 20, kWidth - 60, kHeight - 40)))[0];
}

const std::vector<Surface> kWall = {{2.5, -1e3, 1e3, 0.3}};

TEST(MultiView, FindsTheParallaxThatAllViewsShare) {
  const cv::Mat reference = seen(kWall, 0, 0, 1);
  MultiViewOptions options;
  options.warps = 4;
  MultiViewEstimator estimator(options);
  const ParallaxField& field =
      estimator.estimate(reference, {view(kWall, 1, 0, 2), view(kWall, 2, 0, 3)}, constant(2.1));
  ASSERT_FALSE(field.empty());
  EXPECT_LT(median_error(field.distance, 2.5), 0.03);
  EXPECT_GT(mean_over(field.matching), 1.99);
}

TEST(MultiView, LongerBaselinesAreMorePrecise) {
  const cv::Mat reference = seen(kWall, 0, 3, 1);
  MultiViewEstimator estimator;
  const auto error = [&](std::vector<double> steps) {
    std::vector<View> views;
    for (const double step : steps) views.push_back(view(kWall, step, 3, 7 + views.size()));
    return median_error(estimator.estimate(reference, views, constant(2.4)).distance, 2.5);
  };
  const double one = error({1});
  EXPECT_LT(error({1, 2}), 0.75 * one);
  EXPECT_LT(error({1, 2, 4}), 0.45 * one);
}

/// A wall without texture, seen with noise: as often as noise may look like faint texture, it counts only
/// beside what has plain one.
TEST(MultiView, NoiseAloneIsNoTexture) {
  for (const double noise : {1.0, 2.0, 4.0}) {
    std::vector<cv::Mat> images;
    for (std::uint64_t i = 0; i < 4; ++i) {
      cv::Mat image = seen(kWall, static_cast<double>(i), noise, 10 + i);
      Random random(20 + i);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < 120; ++x)
          image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(128.4 + noise * random.normal());
      }
      images.push_back(image);
    }
    std::vector<View> views(3);
    for (std::size_t i = 0; i < views.size(); ++i) {
      views[i].image = images[i + 1];
      views[i].e[0] = -1 - static_cast<float>(i);
    }
    MultiViewEstimator estimator;
    const ParallaxField& field = estimator.estimate(images[0], views, constant(2.5), noise);
    EXPECT_EQ(cv::countNonZero(field.texture(cv::Rect(0, 0, 80, kHeight)) > 0), 0) << noise;
    const cv::Mat on = field.texture(cv::Rect(130, 10, 60, kHeight - 20));
    EXPECT_GT(cv::countNonZero(on > 1.6F), 0.9 * static_cast<double>(on.total())) << noise;
  }
}

/// Monte-Carlo: errors of the smoothed field are no larger than the information says, nor much smaller; and
/// information falls with the square of the noise.
TEST(MultiView, InformationIsTheInverseOfTheVariance) {
  const auto measure = [](double noise) {
    const cv::Mat reference = seen(kWall, 0, noise, 1);
    MultiViewEstimator estimator;
    const ParallaxField& field = estimator.estimate(
        reference, {view(kWall, 1, noise, 2), view(kWall, 2, noise, 3), view(kWall, 4, noise, 4)},
        constant(2.5), noise);
    double squares = 0;
    int count = 0;
    for (int y = 20; y < kHeight - 20; ++y) {
      for (int x = 40; x < kWidth - 20; ++x) {
        const double error = field.distance.at<float>(y, x) - 2.5;
        const double information = field.information.at<float>(y, x);
        if (!(information > 0)) continue;
        squares += std::min(error * error * information, 25.0);
        ++count;
      }
    }
    EXPECT_GT(count, 5000);
    return std::pair(std::sqrt(squares / count), mean_over(field.information));
  };
  const auto [error_of_3, information_of_3] = measure(3);
  const auto [error_of_6, information_of_6] = measure(6);
  for (const double error : {error_of_3, error_of_6}) {
    EXPECT_GT(error, 0.3);
    EXPECT_LT(error, 1.5);
  }
  EXPECT_NEAR(information_of_3 / information_of_6, 4, 1);
}

TEST(MultiView, AViewOfSomethingElseIsOutvotedAndDoesNotMatch) {
  const cv::Mat reference = seen(kWall, 0, 1, 1);
  const std::vector<Surface> other = {{2.5, -1e3, 1e3, 2.2}};
  MultiViewEstimator estimator;
  const std::vector<View> good = {view(kWall, 1, 1, 2), view(kWall, 2, 1, 3)};
  std::vector<View> mixed = good;
  mixed.push_back(view(other, 4, 1, 4));
  const ParallaxField& field = estimator.estimate(reference, mixed, constant(2.4));
  EXPECT_LT(median_error(field.distance, 2.5), 0.12);
  EXPECT_NEAR(mean_over(field.matching), 2, 0.2);
}

TEST(MultiView, NoiseIsNoTexture) {
  const std::vector<Surface> nothing;
  const cv::Mat reference = seen(nothing, 0, 1.5, 1);
  MultiViewEstimator estimator;
  const ParallaxField& field =
      estimator.estimate(reference, {view(nothing, 2, 1.5, 2), view(nothing, 4, 1.5, 3)}, constant(1), 1.5);
  EXPECT_EQ(cv::countNonZero(field.texture), 0);
}

/// The noise is that of the place: in a clean part of the image fainter texture is clear, and the image's
/// noise, where it is known, is the most that it is.
TEST(MultiView, NoiseIsTakenFromThePlace) {
  const std::vector<Surface> nothing;
  const auto half_noisy = [&](std::uint64_t seed) {
    cv::Mat image = seen(nothing, 0, 0, 1);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(128 + 2.5 * std::sin(0.9 * x) +
                                                                       2.5 * std::sin(0.8 * y + 0.5 * x));
      }
    }
    const cv::Mat noisy = seen(nothing, 0, 6, seed);
    noisy.colRange(0, kWidth / 2).copyTo(image.colRange(0, kWidth / 2));
    return image;
  };
  View still;
  still.image = half_noisy(2);
  still.e = {1, 0, 0};
  MultiViewEstimator estimator;
  const auto clear = [&](double noise, int from, int to) {
    const cv::Mat texture = estimator.estimate(half_noisy(1), {still}, constant(0), noise).texture > 2.5;
    return cv::mean(texture.colRange(from, to))[0] / 255;
  };
  EXPECT_LT(clear(0, 20, 80), 0.15);
  EXPECT_GT(clear(0, 120, 180), 0.95);
  EXPECT_GT(clear(0.5, 20, 80), 0.5);
}

/// Beside an edge the texture in the window is that of the other side.
TEST(MultiView, TextureOfAnotherDepthIsTold) {
  std::vector<Surface> scene = kWall;
  scene[0].left = 1e4;  // nothing behind the pole
  scene.push_back({9, 90, 102, 1.4});
  MultiViewOptions options;
  options.warps = 0;
  options.reach = 0;
  MultiViewEstimator estimator(options);
  cv::Mat start = constant(0);
  start.colRange(90, 102) = 9;
  const std::vector<View> views = {view(scene, 0.5, 1, 2), view(scene, 1, 1, 3)};
  const ParallaxField& field = estimator.estimate(seen(scene, 0, 1, 1), views, start);
  const auto offset = [&](int x) {
    const cv::Rect column(x, 20, 1, 100);
    return cv::mean(field.offset(column), field.information(column) > 0)[0];
  };
  EXPECT_NEAR(offset(95), 0, 0.1);
  EXPECT_GT(offset(89), 4);
}

/// A start that has let a pole grow by 4 px on both sides: gradients do not find the way back, neighbours do.
TEST(MultiView, BesideAnEdgeTheOtherSideMayWin) {
  std::vector<Surface> scene = kWall;
  scene.push_back({9, 90, 102, 1.4});
  const cv::Mat reference = seen(scene, 0, 1, 1);
  const std::vector<View> views = {view(scene, 0.5, 1, 2), view(scene, 1, 1, 3), view(scene, 2, 1, 4)};
  cv::Mat start = constant(2.5);
  start.colRange(86, 106) = 9;
  const auto wrong = [&](int reach) {
    MultiViewOptions options;
    options.reach = reach;
    MultiViewEstimator estimator(options);
    const cv::Mat d = estimator.estimate(reference, views, start).distance;
    int count = 0;
    for (int y = 20; y < kHeight - 20; ++y) {
      for (int x = 80; x < 112; ++x) {
        const double truth = x >= 90 && x < 102 ? 9 : 2.5;
        if (std::abs(d.at<float>(y, x) - truth) > 0.25 * truth) ++count;
      }
    }
    return count;
  };
  EXPECT_LT(wrong(5), 0.6 * wrong(0));
}

/// Points that have moved too far for a view, or come too near, are left to others.
TEST(MultiView, AViewIsUsedUpToALimitOfParallaxAndOfScale) {
  const cv::Mat reference = seen(kWall, 0, 1, 1);
  const std::vector<View> views = {view(kWall, 1, 1, 2), view(kWall, 4, 1, 3)};
  MultiViewOptions options;
  options.largest_parallax = 8;
  MultiViewEstimator near(options);
  EXPECT_NEAR(mean_over(near.estimate(reference, views, constant(2.5)).matching), 1, 0.02);
  options.largest_parallax = 12;
  MultiViewEstimator both(options);
  EXPECT_NEAR(mean_over(both.estimate(reference, views, constant(2.5)).matching), 2, 0.02);

  View forward;
  forward.image = reference;
  forward.e = {0, 0, 0.2F};  // at d = 1: Z' / Z = 1.2
  options.largest_scale = 1.1;
  options.warps = 0;
  MultiViewEstimator scaled(options);
  const ParallaxField& field = scaled.estimate(reference, {forward}, constant(1));
  EXPECT_EQ(cv::countNonZero(field.matching), 0);
  EXPECT_EQ(cv::countNonZero(field.information), 0);
}

TEST(MultiView, ViewsAndStartThatDoNotFitGiveNothing) {
  const cv::Mat reference = seen(kWall, 0, 0, 1);
  const View good = view(kWall, 1, 0, 2);
  View small = good;
  small.image = good.image(cv::Rect(0, 0, 50, 50)).clone();
  MultiViewEstimator estimator;
  EXPECT_TRUE(estimator.estimate(reference, {}, constant(1)).empty());
  EXPECT_TRUE(estimator.estimate(reference, {small}, constant(1)).empty());
  EXPECT_TRUE(estimator.estimate(reference, {good}, cv::Mat()).empty());
  EXPECT_TRUE(estimator.estimate(cv::Mat(), {good}, constant(1)).empty());
}

TEST(MultiView, AStartThatIsNoNumberCountsAsInfinity) {
  const cv::Mat reference = seen(kWall, 0, 0, 1);
  MultiViewEstimator estimator;
  const ParallaxField& field = estimator.estimate(reference, {view(kWall, 0.4, 0, 2)},
                                                  constant(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_TRUE(cv::checkRange(field.distance));
  EXPECT_LT(median_error(field.distance, 2.5), 0.4);
}

}  // namespace
}  // namespace pade::flow

#include "pade/flow/epipolar.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "flow/flow_scene.hpp"

namespace pade::flow {
namespace {

// A camera that flies along its optical axis toward a slanted plane, the focus of expansion inside the image.
struct ForwardFlight {
  static constexpr double kFocal = 250, kX = 165, kY = 117, kStep = 0.4, kDistance = 8;
  cv::Mat first, second, truth;
  EpipolarField lines;

  ForwardFlight() : truth(240, 320, CV_32FC2) {
    const cv::Size size = truth.size();
    lines.direction.create(size, CV_32FC2);
    const auto slant = [](double x, double y) {
      return 0.15 * (x - kX) / kFocal + 0.6 * (y - kY) / kFocal + 1;
    };
    const testing::Waves waves(7);
    first = testing::render(size, waves);
    second = testing::render(size, waves, [&](double x, double y) {
      const double z = (kDistance - kStep) / slant(x, y);
      return cv::Point2d(kX, kY) + (cv::Point2d(x, y) - cv::Point2d(kX, kY)) * (z / (z + kStep));
    });
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const double z = kDistance / slant(x, y);
        const cv::Point2d from(x - kX, y - kY);
        const double radius = std::max(cv::norm(from), 1e-9);
        truth.at<cv::Vec2f>(y, x) = cv::Vec2d(from.x, from.y) * (kStep / (z - kStep));
        lines.direction.at<cv::Vec2f>(y, x) = cv::Vec2d(from.x, from.y) * (1 / radius);
      }
    }
  }
};

double median_error(const cv::Mat& vectors, const cv::Mat& truth) {
  std::vector<double> errors;
  for (int y = 8; y < truth.rows - 8; ++y) {
    for (int x = 8; x < truth.cols - 8; ++x) {
      errors.push_back(cv::norm(vectors.at<cv::Vec2f>(y, x) - truth.at<cv::Vec2f>(y, x)));
    }
  }
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2),
                   errors.end());
  return errors[errors.size() / 2];
}

class EpipolarMethods : public ::testing::TestWithParam<std::string> {
 protected:
  static std::unique_ptr<EpipolarEstimator> make(FlowConfidence confidence = FlowConfidence::none) {
    if (GetParam() == "lucas-kanade") {
      LucasKanadeOptions options = epipolar_lucas_kanade_options();
      options.pyramid.confidence = confidence;
      return make_epipolar_lucas_kanade(options);
    }
    ClgOptions options = clg_fast_options();
    options.pyramid.confidence = confidence;
    return make_epipolar_clg(options);
  }
};

TEST_P(EpipolarMethods, KnowingTheLinesHalvesTheErrorOfForwardFlight) {
  const ForwardFlight flight;
  const cv::Mat noise_free = make()->estimate(flight.first, flight.second, flight.lines).flow.vectors;
  const auto general = make_flow_estimator(GetParam());
  ASSERT_TRUE(general.ok());
  cv::Mat first = flight.first.clone();
  cv::Mat second = flight.second.clone();
  for (cv::Mat* image : {&first, &second}) {
    cv::Mat noise(image->size(), CV_8SC1);
    cv::randn(noise, 0, 4);
    cv::add(*image, noise, *image, cv::noArray(), CV_8U);
  }
  const double aided = median_error(make()->estimate(first, second, flight.lines).flow.vectors, flight.truth);
  const double free = median_error((*general)->estimate(first, second).vectors, flight.truth);
  EXPECT_LT(aided, 0.65 * free);
  EXPECT_LT(median_error(noise_free, flight.truth), 0.06);
}

TEST_P(EpipolarMethods, ResultsLieOnTheLine) {
  const ForwardFlight flight;
  EpipolarField lines = flight.lines;
  lines.base = cv::Mat(flight.first.size(), CV_32FC2, cv::Scalar(0.5, -0.25));
  const EpipolarFlow flow = make()->estimate(flight.first, flight.second, lines);
  for (int y = 0; y < flow.distance.rows; y += 3) {
    for (int x = 0; x < flow.distance.cols; x += 3) {
      const cv::Vec2f expected = lines.base.at<cv::Vec2f>(y, x) +
                                 lines.direction.at<cv::Vec2f>(y, x) * flow.distance.at<float>(y, x);
      ASSERT_LT(cv::norm(flow.flow.vectors.at<cv::Vec2f>(y, x) - expected), 1e-4);
    }
  }
}

TEST_P(EpipolarMethods, TheBaseFlowTakesTheRotationAway) {
  // What the rotation adds to every vector can be given as base, or taken out of the second image.
  const testing::Waves waves(2);
  const cv::Size size(200, 160);
  const cv::Mat first = testing::render(size, waves);
  const cv::Mat second =
      testing::render(size, waves, [](double x, double y) { return cv::Point2d(x - 14.5, y + 9); });
  EpipolarField lines;
  lines.base = cv::Mat(size, CV_32FC2, cv::Scalar(12, -9));
  lines.direction = cv::Mat(size, CV_32FC2, cv::Scalar(1, 0));
  const EpipolarFlow flow = make()->estimate(first, second, lines);
  EXPECT_LT(median_error(flow.flow.vectors, cv::Mat(size, CV_32FC2, cv::Scalar(14.5, -9))), 0.06);
}

TEST_P(EpipolarMethods, StartFromThePredictedDistance) {
  const testing::Waves waves(4);
  const cv::Size size(192, 160);
  const cv::Mat first = testing::render(size, waves);
  const cv::Mat second =
      testing::render(size, waves, [](double x, double y) { return cv::Point2d(x - 75, y); });
  EpipolarField lines;
  lines.direction = cv::Mat(size, CV_32FC2, cv::Scalar(1, 0));
  const cv::Mat predicted(size, CV_32FC1, cv::Scalar(74));
  const EpipolarFlow flow = make()->estimate(first, second, lines, predicted);
  const cv::Rect seen(10, 10, 90, 140);
  EXPECT_LT(median_error(flow.flow.vectors(seen), cv::Mat(seen.size(), CV_32FC2, cv::Scalar(75, 0))), 0.1);
}

TEST_P(EpipolarMethods, WhatMovesAcrossTheLineIsSeen) {
  const testing::Waves waves(6);
  const cv::Size size(200, 160);
  const cv::Rect mover(80, 50, 50, 50);
  const cv::Mat first = testing::render(size, waves);
  const cv::Mat second = testing::render(size, waves, [&](double x, double y) {
    return mover.contains(cv::Point(static_cast<int>(x), static_cast<int>(y))) ? cv::Point2d(x - 3, y - 1)
                                                                               : cv::Point2d(x - 3, y);
  });
  EpipolarField lines;
  lines.direction = cv::Mat(size, CV_32FC2, cv::Scalar(1, 0));
  const EpipolarFlow flow = make(FlowConfidence::local)->estimate(first, second, lines);
  const double still = cv::mean(flow.across(cv::Rect(15, 20, 45, 100)))[0];
  const double moving = cv::mean(flow.across(cv::Rect(90, 60, 30, 30)))[0];
  EXPECT_LT(still, 0.1);
  EXPECT_GT(moving, 0.5);
  EXPECT_EQ(flow.flow.sigma.size(), size);
}

TEST_P(EpipolarMethods, SurviveEverySizeAndUndefinedLines) {
  auto method = make(FlowConfidence::local);
  for (const cv::Size size :
       {cv::Size(1, 1), cv::Size(1, 19), cv::Size(23, 1), cv::Size(33, 17), cv::Size(64, 65)}) {
    const testing::ShiftedPair pair = testing::shifted_pair(size, {0.5, 0});
    EpipolarField lines;
    const float none = std::numeric_limits<float>::quiet_NaN();
    lines.direction = cv::Mat(size, CV_32FC2, cv::Scalar(none, none));
    const EpipolarFlow still = method->estimate(pair.first, pair.second, lines);
    EXPECT_EQ(cv::norm(still.flow.vectors, cv::NORM_INF), 0) << "without a line the flow is that of infinity";
    lines.direction = cv::Mat(size, CV_32FC2, cv::Scalar(0.6, 0.8));
    EXPECT_TRUE(cv::checkRange(method->estimate(pair.first, pair.second, lines).distance));
  }
  EXPECT_TRUE(method->estimate(cv::Mat(), cv::Mat(), {}).empty());
  const cv::Mat image(9, 9, CV_8UC1, cv::Scalar(3));
  EXPECT_TRUE(method->estimate(image, image, {cv::Mat(), cv::Mat(8, 9, CV_32FC2)}).empty());
}

INSTANTIATE_TEST_SUITE_P(Methods, EpipolarMethods, ::testing::Values("lucas-kanade", "clg-fast"),
                         [](const auto& name) { return name.param == "clg-fast" ? "clg" : "lucas_kanade"; });

}  // namespace
}  // namespace pade::flow

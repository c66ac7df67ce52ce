#include "pade/flow/epipolar.hpp"

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "flow/flow_scene.hpp"
#include "flow/forward_flight.hpp"

namespace pade::flow {
namespace {

class EpipolarMethods : public ::testing::TestWithParam<std::string> {
 protected:
  static std::unique_ptr<EpipolarEstimator> make(FlowConfidence confidence = FlowConfidence::none) {
    if (GetParam() == "lucas-kanade") {
      LucasKanadeOptions options = epipolar_lucas_kanade_options();
      options.pyramid.confidence = confidence;
      return make_epipolar_lucas_kanade(options);
    }
    ClgOptions options = epipolar_clg_options();
    options.pyramid.confidence = confidence;
    return make_epipolar_clg(options);
  }
};

TEST_P(EpipolarMethods, KnowingTheLinesHalvesTheErrorOfForwardFlight) {
  const testing::ForwardFlight flight;
  const testing::ForwardFlight noisy(1, 4);
  const cv::Mat noise_free = make()->estimate(flight.first, flight.second, flight.lines).flow.vectors;
  const auto general = make_flow_estimator(GetParam());
  ASSERT_TRUE(general.ok());
  const double aided = testing::median_error(
      make()->estimate(noisy.first, noisy.second, flight.lines).flow.vectors, flight.truth);
  const double free =
      testing::median_error((*general)->estimate(noisy.first, noisy.second).vectors, flight.truth);
  EXPECT_LT(aided, 0.65 * free);
  EXPECT_LT(testing::median_error(noise_free, flight.truth), 0.06);
}

TEST_P(EpipolarMethods, ResultsLieOnTheLine) {
  const testing::ForwardFlight flight;
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
  EXPECT_LT(testing::median_error(flow.flow.vectors, cv::Mat(size, CV_32FC2, cv::Scalar(14.5, -9))), 0.06);
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
  EXPECT_LT(testing::median_error(flow.flow.vectors(seen), cv::Mat(seen.size(), CV_32FC2, cv::Scalar(75, 0))),
            0.1);
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

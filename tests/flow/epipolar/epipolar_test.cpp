#include "pade/flow/epipolar/epipolar.hpp"

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "flow/epipolar/forward_flight.hpp"
#include "flow/flow_scene.hpp"
#include "support/nan.hpp"

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

TEST_P(EpipolarMethods, SurviveImagesThatSayNothing) {
  auto method = make(FlowConfidence::local);
  const cv::Size size(75, 61);
  const std::vector<cv::Mat> images = testing::difficult_images(size);
  EpipolarField lines;
  lines.direction = cv::Mat(size, CV_32FC2, cv::Scalar(-0.8, 0.6));
  for (const cv::Mat& first : images) {
    for (const cv::Mat& second : images) {
      const EpipolarFlow flow = method->estimate(first, second, lines);
      EXPECT_TRUE(cv::checkRange(flow.flow.vectors));
      EXPECT_TRUE(cv::checkRange(flow.distance));
      EXPECT_EQ(test::count_nan(flow.flow.sigma), 0);
      EXPECT_EQ(test::count_nan(flow.across), 0);
      EXPECT_LT(cv::norm(flow.distance, cv::NORM_INF), 1000);
    }
  }
  EXPECT_EQ(cv::norm(method->estimate(images[0], images[0], lines).distance, cv::NORM_INF), 0)
      << "nothing moves in a black image";
}

TEST_P(EpipolarMethods, DoNotDependOnStridesNorOnThePastNorOnTheDepthOfGreyValues) {
  const testing::ForwardFlight flight;
  const cv::Rect part(31, 17, 201, 143);
  EpipolarField lines;
  lines.direction = flight.lines.direction(part);
  lines.base = cv::Mat(flight.first.size(), CV_32FC2, cv::Scalar(0.25, 0.5))(part);
  auto method = make(FlowConfidence::local);
  const EpipolarFlow view = method->estimate(flight.first(part), flight.second(part), lines);
  method->estimate(flight.second, flight.first, flight.lines);
  const EpipolarFlow copy = method->estimate(flight.first(part).clone(), flight.second(part).clone(),
                                             {lines.base.clone(), lines.direction.clone()});
  EXPECT_EQ(cv::norm(view.distance, copy.distance, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(view.flow.vectors, copy.flow.vectors, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(view.across, copy.across, cv::NORM_INF), 0);
  cv::Mat first;
  cv::Mat second;
  flight.first(part).convertTo(first, CV_16U, 257);
  flight.second(part).convertTo(second, CV_16U, 257);
  const EpipolarFlow wide = method->estimate(first, second, lines);
  EXPECT_LT(cv::norm(wide.distance, view.distance, cv::NORM_L1) / static_cast<double>(wide.distance.total()),
            1e-3);
}

TEST_P(EpipolarMethods, RefuseWhatDoesNotFitAndIgnoreAWildPrediction) {
  auto method = make();
  const cv::Size size(90, 70);
  const testing::ShiftedPair pair = testing::shifted_pair(size, {1, 0});
  EpipolarField lines;
  lines.direction = cv::Mat(size, CV_32FC2, cv::Scalar(1, 0));
  EXPECT_TRUE(method->estimate(pair.first, cv::Mat(70, 91, CV_8UC1), lines).empty());
  EXPECT_TRUE(method->estimate(pair.first, cv::Mat(size, CV_16UC1), lines).empty());
  EXPECT_TRUE(method->estimate(cv::Mat(size, CV_8UC3), cv::Mat(size, CV_8UC3), lines).empty());
  EXPECT_TRUE(method->estimate(pair.first, pair.second, {cv::Mat(size, CV_32FC1), lines.direction}).empty());
  cv::Mat predicted(size, CV_32FC1, cv::Scalar(1));
  predicted.rowRange(0, 20) = std::numeric_limits<float>::quiet_NaN();
  predicted.rowRange(20, 40) = std::numeric_limits<float>::infinity();
  predicted.rowRange(40, 50) = std::numeric_limits<float>::max();
  EXPECT_TRUE(cv::checkRange(method->estimate(pair.first, pair.second, lines, predicted).flow.vectors));
  EXPECT_FALSE(
      method->estimate(pair.first, pair.second, lines, cv::Mat(3, 3, CV_32FC1, cv::Scalar(9))).empty());
}

INSTANTIATE_TEST_SUITE_P(Methods, EpipolarMethods, ::testing::Values("lucas-kanade", "clg-fast"),
                         [](const auto& name) { return name.param == "clg-fast" ? "clg" : "lucas_kanade"; });

}  // namespace
}  // namespace pade::flow

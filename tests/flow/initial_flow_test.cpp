// What a given initial flow is to the search: FlowOptions::initial_level and FlowOptions::initial.
#include <cmath>
#include <cstring>
#include <string>

#include <gtest/gtest.h>

#include "pade/flow/flow_estimator.hpp"

#include "flow/flow_scene.hpp"

namespace pade::flow {
namespace {

using testing::Waves;

FlowField flow_of(const std::string& name, const FlowOptions& options, const cv::Mat& first,
                  const cv::Mat& second, const cv::Mat& initial) {
  return make_flow_estimator(name, options).value()->estimate(first, second, initial);
}

FlowOptions taken_up(InitialFlow initial, int level) {
  FlowOptions options;
  options.initial = initial;
  options.initial_level = level;
  return options;
}

/// A bar that is thinner than it moves, before a background that hardly moves.
struct FastBar {
  const int width;
  static constexpr int kLeft = 150;
  const cv::Size size{240, 120};
  const cv::Vec2f bar_flow{-22, 0};
  const cv::Vec2f background_flow{-1.5F, 0};
  cv::Mat first, second, truth;

  explicit FastBar(int wide)
      : width(wide), truth(size, CV_32FC2, cv::Scalar(background_flow[0], background_flow[1])) {
    const Waves background(3);
    const Waves bar(11);
    const auto draw = [&](double moved_background, double moved_bar) {
      cv::Mat image = testing::render(
          size, background, [&](double x, double y) { return cv::Point2d(x - moved_background, y); });
      const int left = kLeft + static_cast<int>(moved_bar);
      testing::render({width, size.height}, bar, [](double x, double y) {
        return cv::Point2d(4 * x, y);
      }).copyTo(image(cv::Rect(left, 0, width, size.height)));
      return image;
    };
    first = draw(0, 0);
    second = draw(background_flow[0], bar_flow[0]);
    truth.colRange(kLeft, kLeft + width) = cv::Scalar(bar_flow[0], bar_flow[1]);
  }

  /// Share of the bar's pixels, away from the upper and lower border, whose flow is the bar's within 1 px.
  [[nodiscard]] double found(const cv::Mat& vectors) const {
    int right = 0;
    for (int y = 15; y < size.height - 15; ++y) {
      for (int x = kLeft + 1; x < kLeft + width - 1; ++x)
        right += cv::norm(vectors.at<cv::Vec2f>(y, x) - bar_flow) < 1 ? 1 : 0;
    }
    return right / static_cast<double>((size.height - 30) * (width - 2));
  }

  /// Mean error far from the bar and from what it hides.
  [[nodiscard]] double background_error(const cv::Mat& vectors) const {
    cv::Mat difference = vectors - truth;
    const cv::Mat left = difference(cv::Rect(30, 15, 70, 90));
    return cv::norm(left, cv::NORM_L1) / static_cast<double>(left.total());
  }
};
const FastBar& thin() {
  static const FastBar bar(6);
  return bar;
}
const FastBar& thicker() {  // still thinner than it moves
  static const FastBar bar(16);
  return bar;
}

TEST(InitialFlow, ThatIsExactStaysWhereItReplacesCoarserLevels) {
  const FastBar& bar = thin();
  for (const std::string name : {"clg-fast", "clg-accurate"}) {
    const double without = bar.found(flow_of(name, {}, bar.first, bar.second, {}).vectors);
    EXPECT_LT(without, 0.3) << name << ": the scene shows nothing";
    for (const int level : {0, 1}) {
      const cv::Mat vectors =
          flow_of(name, taken_up(InitialFlow::replaces, level), bar.first, bar.second, bar.truth).vectors;
      EXPECT_GT(bar.found(vectors), 0.9) << name << ' ' << level;
      EXPECT_LT(bar.background_error(vectors), 0.1) << name << ' ' << level;
    }
  }
}

TEST(InitialFlow, ThatCompetesFindsWhatItKnowsAndLosesNothingWhereItIsWrong) {
  const FastBar& bar = thicker();
  for (const std::string name : {"clg-fast", "clg-fast-half"}) {
    const cv::Mat unaided = flow_of(name, {}, bar.first, bar.second, {}).vectors;
    EXPECT_LT(bar.found(unaided), 0.3) << name << ": the scene shows nothing";
    for (const int level : {1, 2, 3}) {  // on level 3 the bar is 2 px wide: finer levels must find it
      const FlowOptions options = taken_up(InitialFlow::competes, level);
      const cv::Mat helped = flow_of(name, options, bar.first, bar.second, bar.truth).vectors;
      EXPECT_GT(bar.found(helped), 0.85) << name << ' ' << level;
      EXPECT_LT(bar.background_error(helped), bar.background_error(unaided) + 0.02) << name << ' ' << level;
      // Wrong everywhere, and in either direction.
      for (const cv::Scalar& wrong : {cv::Scalar(9, -7), cv::Scalar(-60, 30), cv::Scalar(1e9, 0)}) {
        const cv::Mat initial(bar.size, CV_32FC2, wrong);
        const cv::Mat vectors = flow_of(name, options, bar.first, bar.second, initial).vectors;
        EXPECT_LT(bar.background_error(vectors), bar.background_error(unaided) + 0.02)
            << name << ' ' << level << wrong;
      }
    }
  }
}

TEST(InitialFlow, IsTakenUpAlikeByAnyNumberOfThreads) {
  const FastBar& bar = thin();
  for (const InitialFlow initial : {InitialFlow::replaces, InitialFlow::competes}) {
    for (const std::string name : {"clg-fast", "clg-fast-half"}) {
      FlowOptions options = taken_up(initial, 1);
      options.confidence = FlowConfidence::local;
      const FlowField one = flow_of(name, options, bar.first, bar.second, bar.truth);
      for (const int threads : {2, 3}) {
        options.threads = threads;
        const FlowField many = flow_of(name, options, bar.first, bar.second, bar.truth);
        EXPECT_EQ(std::memcmp(one.vectors.data, many.vectors.data, one.vectors.total() * 8), 0) << name;
        EXPECT_EQ(std::memcmp(one.sigma.data, many.sigma.data, one.sigma.total() * 4), 0) << name;
      }
    }
  }
}

TEST(InitialFlow, ThatDoesNotFitTheImagesIsNone) {
  const testing::ShiftedPair pair = testing::shifted_pair({160, 120}, {2, 1});
  const FlowOptions options = taken_up(InitialFlow::replaces, 0);
  for (const char* name : {"lucas-kanade", "farneback", "clg-fast"}) {
    const cv::Mat without = flow_of(name, options, pair.first, pair.second, {}).vectors;
    for (const cv::Mat& initial :
         {cv::Mat(30, 40, CV_32FC2, cv::Scalar(9, 9)), cv::Mat(120, 161, CV_32FC2, cv::Scalar(9, 9)),
          cv::Mat(pair.first.size(), CV_64FC2, cv::Scalar(9, 9)),
          cv::Mat(pair.first.size(), CV_32FC1, cv::Scalar(9))}) {
      const cv::Mat with = flow_of(name, options, pair.first, pair.second, initial).vectors;
      EXPECT_EQ(cv::norm(with, without, cv::NORM_INF), 0)
          << name << " " << initial.size() << " " << initial.type();
    }
  }
}

TEST(InitialFlow, IsTurnedAroundOnTheWayBack) {
  // Too far for the finest level alone: both ways must begin where they are told to.
  const cv::Vec2f shift(-19, 7);
  const testing::ShiftedPair pair = testing::shifted_pair({160, 120}, cv::Point2d(shift[0], shift[1]));
  FlowOptions options = taken_up(InitialFlow::replaces, 0);
  options.confidence = FlowConfidence::forward_backward;
  const cv::Mat initial(pair.first.size(), CV_32FC2, cv::Scalar(shift[0], shift[1]));
  for (const char* name : {"lucas-kanade", "clg-fast"}) {
    const FlowField field = flow_of(name, options, pair.first, pair.second, initial);
    const cv::Rect inside(50, 30, 70, 60);
    EXPECT_LT(cv::mean(field.sigma(inside))[0], 0.2) << name;
  }
}

TEST(InitialFlow, OfTheCoarsestLevelHasNothingToCompeteWith) {
  // As the only start of the search it is used as it is: a shift that the pyramid cannot find.
  const cv::Point2d shift(70, -55);
  const testing::ShiftedPair pair = testing::shifted_pair({192, 160}, shift);
  const cv::Mat initial(pair.first.size(), CV_32FC2, cv::Scalar(shift.x, shift.y));
  for (const int level : {0, 1, 2, 16}) {
    for (const InitialFlow kind : {InitialFlow::replaces, InitialFlow::competes}) {
      const cv::Mat vectors =
          flow_of("clg-fast", taken_up(kind, level), pair.first, pair.second, initial).vectors;
      EXPECT_LT(cv::norm(cv::Vec2d(vectors.at<cv::Vec2f>(110, 60)) - cv::Vec2d(shift.x, shift.y)), 0.2)
          << level << ' ' << to_name(kind);
    }
  }
}

}  // namespace
}  // namespace pade::flow

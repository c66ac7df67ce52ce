// What every one of our own methods owes its users, whatever it does inside.
#include "pade/flow/flow_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pade/flow/methods/opencv_adapter.hpp"

#include "flow/flow_scene.hpp"
#include "support/guarded_image.hpp"

namespace pade::flow {
namespace {

using testing::shifted_pair;
using testing::ShiftedPair;

std::unique_ptr<FlowEstimator> make(const std::string& name, const FlowOptions& options = {}) {
  auto method = make_flow_estimator(name, options);
  EXPECT_TRUE(method.ok());
  return std::move(method.value());
}

bool finite(const cv::Mat& vectors) { return cv::checkRange(vectors); }

// Infinite values are equal too.
bool same_bits(const cv::Mat& a, const cv::Mat& b) {
  if (a.empty() || a.size() != b.size() || a.type() != b.type()) return false;
  for (int y = 0; y < a.rows; ++y) {
    if (std::memcmp(a.ptr(y), b.ptr(y), static_cast<std::size_t>(a.cols) * a.elemSize()) != 0) return false;
  }
  return true;
}

double median_error(const cv::Mat& vectors, cv::Point2d truth, int border) {
  std::vector<double> errors;
  for (int y = border; y < vectors.rows - border; ++y) {
    for (int x = border; x < vectors.cols - border; ++x) {
      const auto& w = vectors.at<cv::Vec2f>(y, x);
      errors.push_back(std::hypot(w[0] - truth.x, w[1] - truth.y));
    }
  }
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2),
                   errors.end());
  return errors[errors.size() / 2];
}

class OwnFlow : public ::testing::TestWithParam<std::string> {
 protected:
  // A small part of a pixel of the grid that the method works on.
  static double small_part() { return GetParam().ends_with("-half") ? 0.16 : 0.08; }
};

TEST_P(OwnFlow, FindsAShiftToASmallPartOfAPixel) {
  for (const cv::Point2d shift : {cv::Point2d(0, 0), cv::Point2d(0.4, -0.3), cv::Point2d(-2.7, 1.6),
                                  cv::Point2d(7.3, 4.2), cv::Point2d(-4, -12)}) {
    const ShiftedPair pair = shifted_pair({160, 120}, shift);
    const FlowField field = make(GetParam())->estimate(pair.first, pair.second);
    EXPECT_LT(median_error(field.vectors, shift, 20), small_part()) << shift;
  }
}

TEST_P(OwnFlow, FindsAZoom) {
  const testing::Waves waves(3);
  const cv::Size size(200, 160);
  const cv::Point2d centre(99.5, 79.5);
  // second(p + w) = first(p) with w = 0.03 (p - centre), so second(q) = first(centre + (q - centre) / 1.03).
  const cv::Mat first = testing::render(size, waves);
  const cv::Mat second = testing::render(
      size, waves, [&](double x, double y) { return centre + (cv::Point2d(x, y) - centre) / 1.03; });
  const FlowField field = make(GetParam())->estimate(first, second);
  std::vector<double> errors;
  for (int y = 10; y < size.height - 10; ++y) {
    for (int x = 10; x < size.width - 10; ++x) {
      const cv::Point2d truth = (cv::Point2d(x, y) - centre) * 0.03;
      const auto& w = field.vectors.at<cv::Vec2f>(y, x);
      errors.push_back(std::hypot(w[0] - truth.x, w[1] - truth.y));
    }
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.08);
  EXPECT_LT(errors[errors.size() * 95 / 100], 0.3);
}

TEST_P(OwnFlow, UsesTheInitialFlow) {
  const cv::Point2d shift(70, -55);  // far beyond what the pyramid of so small an image can find
  const ShiftedPair pair = shifted_pair({192, 160}, shift);
  const cv::Mat initial(pair.first.size(), CV_32FC2, cv::Scalar(shift.x + 1.5, shift.y - 1));
  const FlowField field = make(GetParam())->estimate(pair.first, pair.second, initial);
  const cv::Mat seen = field.vectors(cv::Rect(20, 75, 80, 65));
  EXPECT_LT(median_error(seen, shift, 0), 0.1);
}

TEST_P(OwnFlow, SurvivesAnyInitialFlow) {
  const ShiftedPair pair = shifted_pair({90, 70}, {1, 0.5});
  cv::Mat initial(pair.first.size(), CV_32FC2, cv::Scalar(0, 0));
  const float wild[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                        -std::numeric_limits<float>::infinity(), std::numeric_limits<float>::max(), -1e9F};
  for (int i = 0; i < 5; ++i) initial.rowRange(10 * i, 10 * i + 5) = cv::Scalar(wild[i], wild[(i + 1) % 5]);
  FlowOptions options;
  options.confidence = FlowConfidence::forward_backward;
  const FlowField field = make(GetParam(), options)->estimate(pair.first, pair.second, initial);
  EXPECT_TRUE(finite(field.vectors));
  EXPECT_EQ(cv::countNonZero(field.sigma != field.sigma), 0) << "sigma may be infinite, but is a number";
}

TEST_P(OwnFlow, SurvivesEverySize) {
  auto method = make(GetParam());
  for (const cv::Size size : {cv::Size(1, 1), cv::Size(2, 1), cv::Size(1, 2), cv::Size(1, 37),
                              cv::Size(37, 1), cv::Size(3, 5), cv::Size(16, 16), cv::Size(17, 33),
                              cv::Size(31, 64), cv::Size(65, 47), cv::Size(129, 3), cv::Size(101, 99)}) {
    const ShiftedPair pair = shifted_pair(size, {0.5, 0.25});
    const FlowField field = method->estimate(pair.first, pair.second);
    ASSERT_EQ(field.vectors.size(), size);
    EXPECT_TRUE(finite(field.vectors)) << size;
  }
}

TEST_P(OwnFlow, SurvivesImagesThatSayNothing) {
  auto method = make(GetParam());
  const std::vector<cv::Mat> images = testing::difficult_images({75, 61});
  for (const cv::Mat& first : images) {
    for (const cv::Mat& second : images) {
      const FlowField field = method->estimate(first, second);
      EXPECT_TRUE(finite(field.vectors));
      EXPECT_LT(cv::norm(field.vectors, cv::NORM_INF), 1000);
    }
  }
  const FlowField still = method->estimate(images[0], images[0]);
  EXPECT_EQ(cv::norm(still.vectors, cv::NORM_INF), 0) << "nothing moves in a black image";
}

TEST_P(OwnFlow, IsTheSameForAViewAndItsCopy) {
  const ShiftedPair pair = shifted_pair({150, 130}, {1.5, -0.5});
  const cv::Rect part(13, 7, 101, 93);
  auto method = make(GetParam());
  const FlowField of_view = method->estimate(pair.first(part), pair.second(part));
  const FlowField of_copy = method->estimate(pair.first(part).clone(), pair.second(part).clone());
  EXPECT_TRUE(same_bits(of_view.vectors, of_copy.vectors));
}

TEST_P(OwnFlow, TakesSixteenBitImages) {
  const ShiftedPair pair = shifted_pair({96, 80}, {1.25, 0.75});
  cv::Mat first;
  cv::Mat second;
  pair.first.convertTo(first, CV_16U, 257);
  pair.second.convertTo(second, CV_16U, 257);
  auto method = make(GetParam());
  const cv::Mat wide = method->estimate(first, second).vectors;
  const cv::Mat narrow = method->estimate(pair.first, pair.second).vectors;
  cv::Mat difference;
  cv::absdiff(wide, narrow, difference);
  EXPECT_LT(cv::mean(difference)[0] + cv::mean(difference)[1], 1e-3);
}

TEST_P(OwnFlow, RefusesImagesThatDoNotFit) {
  auto method = make(GetParam());
  const cv::Mat image(40, 40, CV_8UC1, cv::Scalar(7));
  EXPECT_TRUE(method->estimate(image, cv::Mat(40, 41, CV_8UC1)).empty());
  EXPECT_TRUE(method->estimate(image, cv::Mat()).empty());
  EXPECT_TRUE(method->estimate(cv::Mat(), cv::Mat()).empty());
  EXPECT_TRUE(method->estimate(image, cv::Mat(40, 40, CV_8UC3)).empty());
  EXPECT_FALSE(method->estimate(image, image, cv::Mat(3, 3, CV_32FC2)).empty())
      << "a misfit guess is ignored";
}

TEST_P(OwnFlow, DoesNotDependOnTheNumberOfThreadsNorOnThePast) {
  const ShiftedPair pair = shifted_pair({203, 151}, {3.5, -2.25});
  FlowOptions options;
  options.confidence = FlowConfidence::forward_backward;
  auto one = make(GetParam(), options);
  const FlowField expected = one->estimate(pair.first, pair.second);
  one->estimate(pair.second, pair.first);
  one->estimate(pair.first(cv::Rect(0, 0, 40, 50)), pair.second(cv::Rect(0, 0, 40, 50)));
  EXPECT_TRUE(same_bits(one->estimate(pair.first, pair.second).vectors, expected.vectors));
  for (const int threads : {2, 3, 4}) {
    options.threads = threads;
    const FlowField field = make(GetParam(), options)->estimate(pair.first, pair.second);
    EXPECT_TRUE(same_bits(field.vectors, expected.vectors)) << threads;
    EXPECT_TRUE(same_bits(field.sigma, expected.sigma)) << threads;
  }
}

TEST_P(OwnFlow, OfAStreamIsThatOfItsPairs) {
  const testing::Waves waves(5);
  std::vector<cv::Mat> images;
  for (int i = 0; i < 4; ++i) {
    images.push_back(testing::render(
        {110, 90}, waves, [i](double x, double y) { return cv::Point2d(x - 1.3 * i, y + 0.4 * i * i); }));
  }
  auto stream = make(GetParam());
  auto pairs = make(GetParam());
  EXPECT_TRUE(stream->next(images[0]).empty());
  for (std::size_t i = 1; i < images.size(); ++i) {
    const bool newest = i % 2 == 0;
    const FlowField field = stream->next(images[i], newest ? FlowReference::newest : FlowReference::previous);
    const FlowField expected =
        newest ? pairs->estimate(images[i], images[i - 1]) : pairs->estimate(images[i - 1], images[i]);
    EXPECT_TRUE(same_bits(field.vectors, expected.vectors)) << i;
  }
  EXPECT_TRUE(stream->next(images[0](cv::Rect(0, 0, 50, 50))).empty())
      << "another size begins another stream";
  stream->restart();
  EXPECT_TRUE(stream->next(images[0]).empty());
}

TEST_P(OwnFlow, LeavesMaskedPixelsOutAndLearnsNothingFromThem) {
  const cv::Point2d shift(1.5, -1);
  const ShiftedPair pair = shifted_pair({160, 120}, shift);
  cv::Mat mask(pair.first.size(), CV_8UC1, cv::Scalar(255));
  const cv::Rect hidden(60, 40, 40, 40);
  mask(hidden) = 0;
  cv::Mat painted = pair.first.clone();
  cv::randu(painted(hidden), 0, 256);
  auto method = make(GetParam());
  method->set_mask(mask);
  const cv::Mat vectors = method->estimate(painted, pair.second).vectors;
  EXPECT_TRUE(std::isnan(vectors.at<cv::Vec2f>(60, 80)[0]));
  EXPECT_TRUE(std::isnan(vectors.at<cv::Vec2f>(40, 60)[1]));
  EXPECT_LT(median_error(vectors(cv::Rect(102, 40, 12, 40)), shift, 0), 0.15);
  method->set_mask(cv::Mat());
  EXPECT_TRUE(finite(method->estimate(painted, pair.second).vectors));
}

TEST_P(OwnFlow, OfARegionIsThatOfThePictureThere) {
  const ShiftedPair pair = shifted_pair({200, 160}, {1.2, 0.7});
  auto method = make(GetParam());
  const cv::Rect region(70, 60, 50, 40);
  const FlowField part = estimate_region(*method, pair.first, pair.second, region);
  ASSERT_EQ(part.vectors.size(), pair.first.size());
  EXPECT_TRUE(std::isnan(part.vectors.at<cv::Vec2f>(59, 70)[0]));
  EXPECT_LT(median_error(part.vectors(region), {1.2, 0.7}, 0), small_part());
  EXPECT_TRUE(estimate_region(*method, pair.first, pair.second, cv::Rect(900, 0, 5, 5)).empty());
}

TEST_P(OwnFlow, OfASmallRegionIsFoundAroundIt) {
  const cv::Point2d shift(6, 4);
  const ShiftedPair pair = shifted_pair({200, 160}, shift);
  const cv::Rect region(90, 70, 14, 10);
  const FlowField part = estimate_region(*make(GetParam()), pair.first, pair.second, region);
  EXPECT_LT(median_error(part.vectors(region), shift, 0), small_part());
}

TEST_P(OwnFlow, OfAMaskThatLeavesOneOfFourPixelsReachesFarAllTheSame) {
  const cv::Point2d shift(9.3, -6.2);
  const ShiftedPair pair = shifted_pair({200, 160}, shift);
  for (const cv::Point corner : {cv::Point(0, 0), cv::Point(1, 0), cv::Point(0, 1), cv::Point(1, 1)}) {
    cv::Mat mask(pair.first.size(), CV_8UC1, cv::Scalar(0));
    for (int y = corner.y; y < mask.rows; y += 2) {
      for (int x = corner.x; x < mask.cols; x += 2) mask.at<std::uint8_t>(y, x) = 255;
    }
    auto method = make(GetParam());
    method->set_mask(mask);
    const cv::Mat vectors = method->estimate(pair.first, pair.second).vectors;
    std::vector<double> errors;
    for (int y = 40 + corner.y; y < 120; y += 2) {
      for (int x = 40 + corner.x; x < 160; x += 2)
        errors.push_back(cv::norm(vectors.at<cv::Vec2f>(y, x) - cv::Vec2f(cv::Vec2d(shift.x, shift.y))));
    }
    std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2),
                     errors.end());
    EXPECT_LT(errors[errors.size() / 2], 0.5) << corner;
  }
}

TEST_P(OwnFlow, ReadsNothingBehindTheImages) {
  const ShiftedPair pair = shifted_pair({67, 43}, {1.2, 0.7});
  const test::GuardedImage first(pair.first);
  const test::GuardedImage second(pair.second);
  const FlowField guarded = make(GetParam())->estimate(first.get(), second.get());
  EXPECT_TRUE(same_bits(guarded.vectors, make(GetParam())->estimate(pair.first, pair.second).vectors));
}

TEST_P(OwnFlow, IsLessSureWhereThereIsNothingToSeeOrNothingToMatch) {
  const ShiftedPair pair = shifted_pair({160, 120}, {2, 1});
  cv::Mat first = pair.first.clone();
  cv::Mat second = pair.second.clone();
  first(cv::Rect(0, 0, 50, 120)) = 128;
  second(cv::Rect(0, 0, 50, 120)) = 128;
  cv::randu(second(cv::Rect(100, 20, 40, 80)), 0, 256);
  for (const FlowConfidence confidence : {FlowConfidence::local, FlowConfidence::forward_backward}) {
    FlowOptions options;
    options.confidence = confidence;
    const FlowField field = make(GetParam(), options)->estimate(first, second);
    ASSERT_EQ(field.sigma.size(), first.size());
    ASSERT_EQ(field.sigma.type(), CV_32FC1);
    const double sure = cv::mean(field.sigma(cv::Rect(65, 30, 20, 60)))[0];
    EXPECT_LT(sure, 0.2);
    EXPECT_GT(cv::mean(field.sigma(cv::Rect(15, 30, 15, 60)))[0], 5 * sure);
    EXPECT_GT(cv::mean(field.sigma(cv::Rect(110, 40, 20, 40)))[0], 3 * sure);
    EXPECT_GE(cv::norm(field.sigma.row(119), cv::NORM_INF), 1e30) << "what leaves the image is unknown";
  }
  EXPECT_TRUE(make(GetParam())->estimate(first, second).sigma.empty());
}

TEST_P(OwnFlow, AtHalfResolutionStillFindsTheShift) {
  const ShiftedPair pair = shifted_pair({200, 160}, {3.3, -1.8}, 9);
  FlowOptions options;
  options.half_resolution = true;
  const FlowField field = make(GetParam(), options)->estimate(pair.first, pair.second);
  ASSERT_EQ(field.vectors.size(), pair.first.size());
  EXPECT_LT(median_error(field.vectors, {3.3, -1.8}, 20), 0.2);
}

TEST_P(OwnFlow, IsTheSameThroughOpenCvsInterface) {
  const ShiftedPair pair = shifted_pair({90, 70}, {1, 2});
  const cv::Ptr<cv::DenseOpticalFlow> adapter = create_dense_optical_flow(GetParam());
  ASSERT_TRUE(adapter);
  cv::Mat vectors;
  adapter->calc(pair.first, pair.second, vectors);
  EXPECT_TRUE(same_bits(vectors, make(GetParam())->estimate(pair.first, pair.second).vectors));
  const cv::Mat guess(pair.first.size(), CV_32FC2, cv::Scalar(1, 2));
  vectors = guess.clone();
  adapter->calc(pair.first, pair.second, vectors);
  EXPECT_TRUE(same_bits(vectors, make(GetParam())->estimate(pair.first, pair.second, guess).vectors));
  EXPECT_THROW(adapter->calc(pair.first, cv::Mat(3, 3, CV_8UC1), vectors), cv::Exception);
  EXPECT_FALSE(create_dense_optical_flow("no such method"));
}

INSTANTIATE_TEST_SUITE_P(Methods, OwnFlow,
                         ::testing::Values("lucas-kanade", "farneback", "clg-linear", "clg-fast",
                                           "clg-accurate", "lucas-kanade-half", "farneback-half",
                                           "clg-fast-half"),
                         [](const auto& name) {
                           std::string text = name.param;
                           std::replace(text.begin(), text.end(), '-', '_');
                           return text;
                         });

TEST(OpenCvFlow, OfDisIsTheSameForAViewAndItsCopy) {
  const ShiftedPair pair = shifted_pair({150, 130}, {1.5, -0.5});
  const cv::Rect part(13, 7, 101, 93);
  for (const std::string name : {"dis-ultrafast", "dis-fast", "dis-medium"}) {
    auto method = make(name);
    const FlowField of_view = method->estimate(pair.first(part), pair.second(part));
    const FlowField of_copy = method->estimate(pair.first(part).clone(), pair.second(part).clone());
    EXPECT_FALSE(std::isnan(of_view.vectors.at<cv::Vec2f>(45, 50)[0])) << name;
    EXPECT_TRUE(same_bits(of_view.vectors, of_copy.vectors)) << name;
  }
}

TEST(OpenCvFlow, SurvivesEverySizeAndRefusesImagesThatDoNotFit) {
  for (const std::string name :
       {"dis-ultrafast", "dis-fast", "dis-medium", "opencv-farneback", "opencv-pyrlk"}) {
    auto method = make(name);
    for (const cv::Size size :
         {cv::Size(1, 1), cv::Size(37, 1), cv::Size(1, 37), cv::Size(11, 9), cv::Size(65, 47)}) {
      const ShiftedPair pair = shifted_pair(size, {0.5, 0.25});
      EXPECT_EQ(method->estimate(pair.first, pair.second).vectors.size(), size) << name;
    }
    const cv::Mat image(40, 40, CV_8UC1, cv::Scalar(7));
    EXPECT_TRUE(method->estimate(image, cv::Mat(40, 41, CV_8UC1)).empty()) << name;
    EXPECT_TRUE(method->estimate(image, cv::Mat()).empty()) << name;
    EXPECT_TRUE(method->estimate(cv::Mat(40, 40, CV_8UC3), image).empty()) << name;
    EXPECT_FALSE(method->estimate(image, image, cv::Mat(3, 3, CV_32FC2)).empty()) << name;
  }
}

TEST(FlowEstimatorNames, AllCanBeMadeAndKnowTheirName) {
  for (const std::string& name : flow_estimator_names()) {
    const auto method = make_flow_estimator(name);
    ASSERT_TRUE(method.ok()) << name;
    EXPECT_EQ((*method)->name(), name);
  }
  const auto unknown = make_flow_estimator("horn-schunk");
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().message.find("clg-fast"), std::string::npos);
}

}  // namespace
}  // namespace pade::flow

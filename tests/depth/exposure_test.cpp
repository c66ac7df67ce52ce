#include "pade/depth/multi_view/exposure.hpp"

#include <cmath>
#include <utility>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace pade::depth {
namespace {

/// A texture, and the same as a camera sees it that stands `shift` px aside, with noise.
struct Views {
  cv::Mat reference, view;
  cv::Mat d{120, 160, CV_32FC1, cv::Scalar(6)};
  cv::Vec3f e{1, 0, 0};
  explicit Views(double gain, double offset, double deviation = 30) {
    cv::RNG random(3);
    cv::Mat texture(120, 180, CV_32FC1);
    random.fill(texture, cv::RNG::NORMAL, 0, 1);
    cv::GaussianBlur(texture, texture, {}, 2);
    cv::Scalar mean;
    cv::Scalar sigma;
    cv::meanStdDev(texture, mean, sigma);
    texture = (texture - mean[0]) * (deviation / sigma[0]) + 110;
    reference = seen(texture(cv::Rect(6, 0, 160, 120)), 1, 0, random);
    view = seen(texture(cv::Rect(0, 0, 160, 120)), gain, offset, random);
  }
  [[nodiscard]] cv::Mat even() const { return at_exposure_of(reference, view, d, cv::Matx33f::eye(), e); }
  [[nodiscard]] double difference(const cv::Mat& of) const {
    const cv::Rect common(0, 0, 150, 120);
    return cv::mean(reference(common))[0] - cv::mean(of(common + cv::Point(6, 0)))[0];
  }

 private:
  static cv::Mat seen(const cv::Mat& scene, double gain, double offset, cv::RNG& random) {
    cv::Mat noise(scene.size(), CV_32FC1);
    random.fill(noise, cv::RNG::NORMAL, 0, 1);
    cv::Mat image;
    cv::Mat(scene * gain + offset + noise).convertTo(image, CV_8U);
    return image;
  }
};

TEST(Exposure, AViewOfTheSameExposureStaysAsItIs) {
  for (const double deviation : {30.0, 5.0}) {
    const Views views(1, 0, deviation);
    EXPECT_EQ(views.even().data, views.view.data);
  }
}

TEST(Exposure, AnotherExposureIsTakenOut) {
  for (const auto& [gain, offset] : {std::pair{1.5, 0.0}, {0.6, 0.0}, {1.03, 0.0}, {1.0, 8.0}, {0.8, 30.0}}) {
    const Views views(gain, offset);
    const cv::Mat even = views.even();
    EXPECT_NE(even.data, views.view.data) << gain;
    EXPECT_LT(std::abs(views.difference(even)), 0.5) << gain << " " << offset;
    cv::Scalar mean;
    cv::Scalar of_reference;
    cv::Scalar of_view;
    cv::meanStdDev(views.reference, mean, of_reference);
    cv::meanStdDev(even, mean, of_view);
    EXPECT_NEAR(of_view[0] / of_reference[0], 1, 0.03) << gain << " " << offset;
  }
}

/// Matches that are off by some pixels blur the relation, but tell no other exposure.
TEST(Exposure, WrongMatchesAreNoExposure) {
  Views views(1, 0);
  views.d.setTo(7.5);
  EXPECT_EQ(views.even().data, views.view.data);
  views.d.setTo(60);  // nothing fits
  EXPECT_EQ(views.even().data, views.view.data);
}

/// A third of the image is covered in one of the two.
TEST(Exposure, WhatOnlyOneImageShowsDoesNotCount) {
  Views views(1.2, 0);
  views.view.rowRange(0, 40).setTo(20);
  cv::Mat even = views.even();
  const cv::Rect common(0, 50, 150, 70);
  EXPECT_LT(std::abs(cv::mean(views.reference(common))[0] - cv::mean(even(common + cv::Point(6, 0)))[0]), 2);
}

}  // namespace
}  // namespace pade::depth

#include "pade/evaluation/flow_accuracy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace pade::evaluation {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

bool known(const cv::Vec2f& w) { return std::abs(w[0]) <= 1e9F && std::abs(w[1]) <= 1e9F; }

double angle(const cv::Vec2d& a, const cv::Vec2d& b) {
  const cv::Vec3d p(a[0], a[1], 1);
  const cv::Vec3d q(b[0], b[1], 1);
  return std::atan2(cv::norm(p.cross(q)), p.dot(q)) * 180 / std::numbers::pi;
}

}  // namespace

FlowAccuracy flow_accuracy(const cv::Mat& estimate, const cv::Mat& truth) {
  CV_Assert(estimate.type() == CV_32FC2 && truth.type() == CV_32FC2 && estimate.size() == truth.size());
  FlowAccuracy sum;
  std::size_t compared = 0;
  for (int v = 0; v < truth.rows; ++v) {
    for (int u = 0; u < truth.cols; ++u) {
      const auto& expected = truth.at<cv::Vec2f>(v, u);
      if (!known(expected)) continue;
      ++sum.known;
      const auto& found = estimate.at<cv::Vec2f>(v, u);
      double error = std::numeric_limits<double>::infinity();
      if (known(found)) {
        error = cv::norm(cv::Vec2d(found) - cv::Vec2d(expected));
        sum.endpoint_error += error;
        sum.angular_error += angle(found, expected);
        ++compared;
      }
      sum.over_half += error > 0.5 ? 1 : 0;
      sum.over_one += error > 1 ? 1 : 0;
      sum.over_three += error > 3 ? 1 : 0;
      sum.outliers += error > 3 && error > 0.05 * cv::norm(cv::Vec2d(expected)) ? 1 : 0;
    }
  }
  const double all = sum.known > 0 ? static_cast<double>(sum.known) : kNone;
  const double some = compared > 0 ? static_cast<double>(compared) : kNone;
  sum.coverage = static_cast<double>(compared) / all;
  sum.endpoint_error /= some;
  sum.angular_error /= some;
  for (double* share : {&sum.over_half, &sum.over_one, &sum.over_three, &sum.outliers}) *share /= all;
  return sum;
}

cv::Mat endpoint_errors(const cv::Mat& estimate, const cv::Mat& truth) {
  CV_Assert(estimate.type() == CV_32FC2 && truth.type() == CV_32FC2 && estimate.size() == truth.size());
  cv::Mat errors(truth.size(), CV_32FC1);
  for (int v = 0; v < truth.rows; ++v) {
    for (int u = 0; u < truth.cols; ++u) {
      const auto& expected = truth.at<cv::Vec2f>(v, u);
      const auto& found = estimate.at<cv::Vec2f>(v, u);
      errors.at<float>(v, u) = known(expected) && known(found)
                                   ? static_cast<float>(cv::norm(found - expected))
                                   : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return errors;
}

}  // namespace pade::evaluation

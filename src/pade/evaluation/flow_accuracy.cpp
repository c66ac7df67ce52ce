#include "pade/evaluation/flow_accuracy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

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

namespace {

struct JudgedPixel {
  float sigma;
  float error;
};

// Mean error of the first `kept` pixels.
double mean_error(const std::vector<JudgedPixel>& pixels, std::size_t kept) {
  double sum = 0;
  for (std::size_t i = 0; i < kept; ++i) sum += static_cast<double>(pixels[i].error);
  return kept > 0 ? sum / static_cast<double>(kept) : kNone;
}

// AEE of what remains of pixels in this order without the last 0, 5, ... 95 %.
std::vector<double> remaining_errors(const std::vector<JudgedPixel>& pixels) {
  constexpr std::size_t kStep = 5;
  std::vector<double> errors;
  for (std::size_t left_out = 0; left_out < 100; left_out += kStep)
    errors.push_back(mean_error(pixels, pixels.size() * (100 - left_out) / 100));
  return errors;
}

}  // namespace

FlowConfidenceAccuracy flow_confidence_accuracy(const cv::Mat& estimate, const cv::Mat& sigma,
                                                const cv::Mat& truth) {
  CV_Assert(sigma.type() == CV_32FC1 && sigma.size() == truth.size());
  constexpr float kWrong = 3;
  constexpr std::size_t kKeptPercent = 70;
  const cv::Mat errors = endpoint_errors(estimate, truth);
  std::vector<JudgedPixel> pixels;
  double wrong = 0;
  double right = 0;
  FlowConfidenceAccuracy result;
  for (int v = 0; v < errors.rows; ++v) {
    for (int u = 0; u < errors.cols; ++u) {
      const float error = errors.at<float>(v, u);
      if (std::isnan(error)) continue;
      float deviation = sigma.at<float>(v, u);
      if (std::isnan(deviation)) deviation = std::numeric_limits<float>::infinity();
      const bool doubtful = deviation > kDoubtfulSigma;
      pixels.push_back({deviation, error});
      (error > kWrong ? wrong : right) += 1;
      result.flagged += error > kWrong && doubtful ? 1 : 0;
      result.trusted += error <= kWrong && !doubtful ? 1 : 0;
      const cv::Vec2f difference = estimate.at<cv::Vec2f>(v, u) - truth.at<cv::Vec2f>(v, u);
      for (int c = 0; c < 2; ++c) result.within += std::abs(difference[c]) <= deviation ? 0.5 : 0;
    }
  }
  result.flagged /= wrong > 0 ? wrong : kNone;
  result.trusted /= right > 0 ? right : kNone;
  result.within /= pixels.empty() ? kNone : static_cast<double>(pixels.size());
  std::stable_sort(pixels.begin(), pixels.end(), [](auto& a, auto& b) { return a.sigma < b.sigma; });
  result.kept_endpoint_error = mean_error(pixels, pixels.size() * kKeptPercent / 100);
  result.remaining = remaining_errors(pixels);
  std::sort(pixels.begin(), pixels.end(), [](auto& a, auto& b) { return a.error < b.error; });
  result.best_remaining = remaining_errors(pixels);
  return result;
}

}  // namespace pade::evaluation

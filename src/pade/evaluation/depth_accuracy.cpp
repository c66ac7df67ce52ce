#include "pade/evaluation/depth_accuracy.hpp"

#include <algorithm>
#include <cmath>

namespace pade::evaluation {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kOutlier = 0.25;  // relative error

double share(double part, std::uint64_t whole) {
  return whole > 0 ? part / static_cast<double>(whole) : kNaN;
}
double share(std::uint64_t part, std::uint64_t whole) { return share(static_cast<double>(part), whole); }

// Every figure that is averaged over sequences.
constexpr std::array kFigures = {&RangeAccuracy::coverage,       &RangeAccuracy::mean,
                                 &RangeAccuracy::deviation,      &RangeAccuracy::median,
                                 &RangeAccuracy::relative_mean,  &RangeAccuracy::relative_median,
                                 &RangeAccuracy::outliers,       &RangeAccuracy::within_1_sigma,
                                 &RangeAccuracy::within_2_sigma, &RangeAccuracy::rms_of_sigma};

template <class Select>
RangeAccuracy average_range(std::span<const DepthAccuracy> sequences, Select select) {
  RangeAccuracy mean = select(sequences.front());
  mean.truth_pixels = mean.pixels = mean.sigma_pixels = 0;
  for (const DepthAccuracy& sequence : sequences) {
    mean.truth_pixels += select(sequence).truth_pixels;
    mean.pixels += select(sequence).pixels;
    mean.sigma_pixels += select(sequence).sigma_pixels;
  }
  for (double RangeAccuracy::*figure : kFigures) {
    double sum = 0;
    std::uint64_t count = 0;
    for (const DepthAccuracy& sequence : sequences) {
      const double value = select(sequence).*figure;
      if (std::isnan(value)) continue;
      sum += value;
      ++count;
    }
    mean.*figure = share(sum, count);
  }
  return mean;
}

}  // namespace

bool is_truth(float depth) { return depth > 0 && std::isfinite(depth); }

std::size_t range_of(float true_depth) {
  const auto* const limit = std::upper_bound(range_limits.begin(), range_limits.end(), true_depth);
  return static_cast<std::size_t>(limit - range_limits.begin());
}

void Accumulator::Sums::add(float depth, float variance, float true_depth) {
  ++pixels;
  const float signed_error = depth - true_depth;
  const float absolute = std::abs(signed_error);
  const float over_truth = absolute / true_depth;
  error += absolute;
  error2 += static_cast<double>(absolute) * absolute;
  relative += over_truth;
  errors.add(absolute);
  relatives.add(over_truth);
  outliers += over_truth > kOutlier ? 1 : 0;
  if (!(variance > 0) || std::isinf(variance)) return;
  const double normalised = absolute / std::sqrt(static_cast<double>(variance));
  ++with_sigma;
  in_1_sigma += normalised <= 1 ? 1 : 0;
  in_2_sigma += normalised <= 2 ? 1 : 0;
  normalised2 += normalised * normalised;
}

void Accumulator::Sums::add(const Sums& other) {
  truth += other.truth;
  pixels += other.pixels;
  outliers += other.outliers;
  with_sigma += other.with_sigma;
  in_1_sigma += other.in_1_sigma;
  in_2_sigma += other.in_2_sigma;
  error += other.error;
  error2 += other.error2;
  relative += other.relative;
  normalised2 += other.normalised2;
  errors.add(other.errors);
  relatives.add(other.relatives);
}

RangeAccuracy Accumulator::Sums::result(double from, double to) const {
  RangeAccuracy accuracy;
  accuracy.from = from;
  accuracy.to = to;
  accuracy.truth_pixels = truth;
  accuracy.pixels = pixels;
  accuracy.coverage = share(pixels, truth);
  accuracy.mean = share(error, pixels);
  accuracy.deviation = std::sqrt(std::max(0.0, share(error2, pixels) - accuracy.mean * accuracy.mean));
  if (pixels == 0) accuracy.deviation = kNaN;
  accuracy.median = errors.median();
  accuracy.relative_mean = share(relative, pixels);
  accuracy.relative_median = relatives.median();
  accuracy.outliers = share(outliers, pixels);
  accuracy.sigma_pixels = with_sigma;
  accuracy.within_1_sigma = share(in_1_sigma, with_sigma);
  accuracy.within_2_sigma = share(in_2_sigma, with_sigma);
  accuracy.rms_of_sigma = std::sqrt(share(normalised2, with_sigma));
  return accuracy;
}

Accumulator::Accumulator(double max_depth, int grid) : max_depth_(max_depth), grid_(grid) {}

void Accumulator::add(const DepthImage& estimate, const cv::Mat& truth) {
  if (truth.empty() || estimate.empty()) return;
  ++frames_;
  const float limit = max_depth_ > 0 ? static_cast<float>(max_depth_) : std::numeric_limits<float>::max();
  const int n = estimate.window;
  for (int y = grid_ / 2; y < truth.rows; y += grid_) {
    const auto* true_row = truth.ptr<float>(y);
    const auto* depth_row = estimate.depth.ptr<float>(y / n);
    const float* variance_row = estimate.variance.empty() ? nullptr : estimate.variance.ptr<float>(y / n);
    for (int x = grid_ / 2; x < truth.cols; x += grid_) {
      if (!is_truth(true_row[x])) continue;
      Sums& sums = ranges_[range_of(true_row[x])];
      ++sums.truth;
      const float depth = depth_row[x / n];
      if (!(depth > 0 && depth <= limit)) continue;  // NaN as well
      sums.add(depth, variance_row != nullptr ? variance_row[x / n] : 0.0F, true_row[x]);
    }
  }
}

DepthAccuracy Accumulator::result() const {
  DepthAccuracy accuracy;
  accuracy.frames = frames_;
  accuracy.max_depth = max_depth_;
  Sums all;
  for (std::size_t i = 0; i < range_count; ++i) {
    const double from = i == 0 ? 0 : range_limits[i - 1];
    const double to = i < range_limits.size() ? range_limits[i] : std::numeric_limits<double>::infinity();
    accuracy.ranges[i] = ranges_[i].result(from, to);
    all.add(ranges_[i]);
  }
  accuracy.all = all.result(0, std::numeric_limits<double>::infinity());
  return accuracy;
}

cv::Mat relative_error(const DepthImage& estimate, const cv::Mat& truth) {
  cv::Mat error(truth.size(), CV_32FC1, cv::Scalar(kNaN));
  const int n = estimate.window;
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      const float depth = estimate.depth.at<float>(y / n, x / n);
      const float true_depth = truth.at<float>(y, x);
      if (depth > 0 && is_truth(true_depth)) error.at<float>(y, x) = (depth - true_depth) / true_depth;
    }
  }
  return error;
}

DepthAccuracy average(std::span<const DepthAccuracy> sequences) {
  DepthAccuracy mean;
  if (sequences.empty()) return mean;
  mean.max_depth = sequences.front().max_depth;
  for (const DepthAccuracy& sequence : sequences) {
    mean.frames += sequence.frames;
    if (sequence.max_depth != mean.max_depth) mean.max_depth = std::numeric_limits<double>::quiet_NaN();
  }
  for (std::size_t i = 0; i < range_count; ++i) {
    mean.ranges[i] = average_range(
        sequences, [i](const DepthAccuracy& one) -> const RangeAccuracy& { return one.ranges[i]; });
  }
  mean.all =
      average_range(sequences, [](const DepthAccuracy& one) -> const RangeAccuracy& { return one.all; });
  return mean;
}

}  // namespace pade::evaluation

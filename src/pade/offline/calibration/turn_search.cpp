#include "pade/offline/calibration/turn_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "pade/core/compute/median.hpp"
#include "pade/core/pose.hpp"

namespace pade {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Rates on an even grid; where nothing is known the weight is 0 and so is the rate.
struct RateGrid {
  std::array<std::vector<double>, 3> rate;
  std::vector<double> weight;
  [[nodiscard]] std::size_t size() const { return weight.size(); }
  void resize(std::size_t n) {
    for (auto& axis : rate) axis.assign(n, 0.0);
    weight.assign(n, 0.0);
  }
  /// For the sake of rounding.
  void remove_mean() {
    for (auto& axis : rate) {
      double sum = 0, weights = 0;
      for (std::size_t i = 0; i < size(); ++i) {
        sum += weight[i] * axis[i];
        weights += weight[i];
      }
      const double mean = weights > 0 ? sum / weights : 0;
      for (std::size_t i = 0; i < size(); ++i) axis[i] = weight[i] > 0 ? axis[i] - mean : 0;
    }
  }
  [[nodiscard]] std::vector<double> squares() const {
    std::vector<double> out(size());
    for (std::size_t i = 0; i < size(); ++i) {
      for (const auto& axis : rate) out[i] += axis[i] * axis[i];
    }
    return out;
  }
};

/// A column that moves with others of one length, in the frequency domain.
cv::Mat spectrum(const std::vector<double>& values, int length) {
  cv::Mat padded = cv::Mat::zeros(1, length, CV_64F);
  for (std::size_t i = 0; i < values.size(); ++i) padded.at<double>(0, static_cast<int>(i)) = values[i];
  cv::Mat out;
  cv::dft(padded, out);
  return out;
}

/// sum_i a_i b_(i + lag) for all lags modulo the length.
cv::Mat correlated(const cv::Mat& a, const cv::Mat& b) {
  cv::Mat product, out;
  cv::mulSpectrums(b, a, product, 0, true);
  cv::dft(product, out, cv::DFT_INVERSE | cv::DFT_REAL_OUTPUT | cv::DFT_SCALE);
  return out;
}

double score_of(const Matrix3d& cross) {
  // Singular values from the invariants of C^T C, the last with the sign of the determinant.
  const Eigen::JacobiSVD<Matrix3d> svd(cross);
  const Vector3d& s = svd.singularValues();
  return s[0] + s[1] + (cross.determinant() < 0 ? -s[2] : s[2]);
}

/// Upper limit of that: the score is at most sqrt(3) of the norm, so most lags need no decomposition.
double most_of(const Matrix3d& cross) { return std::sqrt(3.0) * cross.norm(); }

RateGrid grid_of(const std::vector<ImageTurn>& turns, double step, std::size_t size) {
  RateGrid grid;
  grid.resize(size);
  std::vector<double> sigmas, sizes;
  for (const ImageTurn& turn : turns) {
    const double duration = seconds_between(turn.from, turn.to);
    sigmas.push_back(std::sqrt(turn.covariance.trace()) / duration);
    sizes.push_back(rotation_log(turn.R_from_to).norm() / duration);
  }
  const double typical = median(std::vector<double>(sigmas));
  const double often = std::max(0.05, median(std::vector<double>(sizes)));
  const double large = 8 * often;  // rad/s: a wrong match, if it is that much more
  for (std::size_t k = 0; k < turns.size(); ++k) {
    const double duration = seconds_between(turns[k].from, turns[k].to);
    Vector3d rate = rotation_log(turns[k].R_from_to) / duration;
    if (rate.norm() > large) rate *= large / rate.norm();
    const double weight = 2 / (1 + std::pow(sigmas[k] / typical, 2));
    const double begin = seconds_between(turns.front().from, turns[k].from) / step;
    const double end = seconds_between(turns.front().from, turns[k].to) / step;
    for (auto i = static_cast<std::size_t>(std::ceil(begin)); static_cast<double>(i) < end && i < size; ++i) {
      for (int axis = 0; axis < 3; ++axis) grid.rate[static_cast<std::size_t>(axis)][i] = rate[axis];
      grid.weight[i] = std::min(1.0, weight);
    }
  }
  grid.remove_mean();
  return grid;
}

/// @param width  of the mean that is taken, s
RateGrid grid_of(const GyroTrack& gyro, double step, double width, std::size_t size) {
  RateGrid grid;
  grid.resize(size);
  for (std::size_t i = 0; i < size; ++i) {
    const auto middle = static_cast<double>(i) * step;
    const Time from{gyro.first().nanoseconds + Time::from_seconds(middle - width / 2).nanoseconds};
    const Time to{gyro.first().nanoseconds + Time::from_seconds(middle + width / 2).nanoseconds};
    const auto turn = gyro.between(from, to);
    if (!turn) continue;
    const Vector3d rate = rotation_log(turn->R_1_2) / width;
    for (int axis = 0; axis < 3; ++axis) grid.rate[static_cast<std::size_t>(axis)][i] = rate[axis];
    grid.weight[i] = 1;
  }
  grid.remove_mean();
  return grid;
}

/// How long the rates remember, s: the width of their autocorrelation.
double memory_of(const RateGrid& grid, double step) {
  const auto at = [&](std::size_t lag) {
    double sum = 0;
    for (std::size_t i = 0; i + lag < grid.size(); ++i) {
      for (const auto& axis : grid.rate) sum += axis[i] * axis[i + lag];
    }
    return sum;
  };
  const double power = at(0);
  double memory = step;
  constexpr double kLongest = 10;  // s
  for (std::size_t lag = 1; lag < grid.size() && static_cast<double>(lag) * step < kLongest; ++lag) {
    const double share = power > 0 ? at(lag) / power : 0;
    if (share < 0.1) break;
    memory += 2 * share * step;
  }
  return memory;
}

}  // namespace

Result<OffsetSearch> search_offsets(const std::vector<ImageTurn>& turns, const GyroTrack& gyro,
                                    double least_overlap, std::size_t most_candidates) {
  if (turns.empty() || gyro.empty()) return Error{"found no turns to compare, expected some of both"};
  std::vector<double> durations;
  for (const ImageTurn& turn : turns) durations.push_back(seconds_between(turn.from, turn.to));
  const double width = median(std::vector<double>(durations));
  constexpr double kFinest = 0.005, kCoarsest = 0.05;  // s
  const double step = std::clamp(0.5 * width, kFinest, kCoarsest);
  const double spans[] = {seconds_between(turns.front().from, turns.back().to),
                          seconds_between(gyro.first(), gyro.last())};
  constexpr double kMost = 1 << 23;
  if ((spans[0] + spans[1]) / step > kMost) {
    return Error{fmt::format(
        "found images over {:.0f} s and an IMU over {:.0f} s, expected less than {:.0f} s together: are the "
        "stamps right?",
        spans[0], spans[1], kMost * step)};
  }
  const auto cells = [&](double span) { return static_cast<std::size_t>(span / step) + 1; };
  const RateGrid camera = grid_of(turns, step, cells(spans[0]));
  const RateGrid body = grid_of(gyro, step, width, cells(spans[1]));
  const int length = cv::getOptimalDFTSize(static_cast<int>(camera.size() + body.size()));

  std::array<cv::Mat, 3> of_camera, of_body;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<double> weighted = camera.rate[axis];
    for (std::size_t i = 0; i < weighted.size(); ++i) weighted[i] *= camera.weight[i];
    of_camera[axis] = spectrum(weighted, length);
    of_body[axis] = spectrum(body.rate[axis], length);
  }
  std::array<std::array<cv::Mat, 3>, 3> cross;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = 0; b < 3; ++b) cross[a][b] = correlated(of_camera[a], of_body[b]);
  }
  std::vector<double> camera_squares = camera.squares();
  for (std::size_t i = 0; i < camera_squares.size(); ++i) camera_squares[i] *= camera.weight[i];
  const cv::Mat weights = spectrum(camera.weight, length);
  const cv::Mat known = spectrum(body.weight, length);
  const cv::Mat power_camera = correlated(spectrum(camera_squares, length), known);
  const cv::Mat power_body = correlated(weights, spectrum(body.squares(), length));
  const cv::Mat overlap = correlated(weights, known);
  // What is common to all of an overlap is no sign of the time: a gyroscope has a bias.
  std::array<cv::Mat, 3> sum_camera, sum_body;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sum_camera[axis] = correlated(of_camera[axis], known);
    sum_body[axis] = correlated(weights, of_body[axis]);
  }

  OffsetSearch search;
  const double zero = seconds_between(turns.front().from, gyro.first());  // offset at lag 0
  const auto least_lag = -static_cast<std::ptrdiff_t>(camera.size()) + 1;
  const auto most_lag = static_cast<std::ptrdiff_t>(body.size()) - 1;
  search.step = step;
  search.from = zero + static_cast<double>(least_lag) * step;
  search.to = zero + static_cast<double>(most_lag) * step;
  const double memory = std::max(memory_of(camera, step), memory_of(body, step));

  std::vector<OffsetCandidate> all;
  std::vector<double> gains(static_cast<std::size_t>(most_lag - least_lag + 1), 0.0);
  const auto candidate_at = [&](std::ptrdiff_t lag) {
    const auto at = static_cast<int>(lag < 0 ? lag + length : lag);
    OffsetCandidate one;
    one.offset = zero + static_cast<double>(lag) * step;
    one.overlap = overlap.at<double>(0, at) * step;
    if (one.overlap < least_overlap) return one;
    const double n = overlap.at<double>(0, at);
    Vector3d mean_camera, mean_body;
    for (int axis = 0; axis < 3; ++axis) {
      mean_camera[axis] = sum_camera[static_cast<std::size_t>(axis)].at<double>(0, at) / n;
      mean_body[axis] = sum_body[static_cast<std::size_t>(axis)].at<double>(0, at) / n;
    }
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b)
        one.cross(a, b) = cross[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)].at<double>(0, at);
    }
    one.cross -= n * mean_camera * mean_body.transpose();
    const double power =
        std::sqrt(std::max(0.0, power_camera.at<double>(0, at) - n * mean_camera.squaredNorm()) *
                  std::max(0.0, power_body.at<double>(0, at) - n * mean_body.squaredNorm()));
    constexpr double kLeastPower = 1e-9;
    if (!(power > kLeastPower)) return one;
    const double upper = most_of(one.cross) / power;
    one.correlation = std::clamp(upper > 0.1 ? score_of(one.cross) / power : upper, 0.0, 0.9999);
    one.gain = -0.5 * one.overlap / memory * std::log1p(-one.correlation * one.correlation);
    return one;
  };
  for (std::ptrdiff_t lag = least_lag; lag <= most_lag; ++lag)
    gains[static_cast<std::size_t>(lag - least_lag)] = candidate_at(lag).gain;
  std::vector<std::ptrdiff_t> peaks;
  for (std::size_t i = 0; i < gains.size(); ++i) {
    const bool above = gains[i] > 0 && (i == 0 || gains[i] > gains[i - 1]) &&
                       (i + 1 == gains.size() || gains[i] >= gains[i + 1]);
    if (above) peaks.push_back(static_cast<std::ptrdiff_t>(i) + least_lag);
  }
  std::sort(peaks.begin(), peaks.end(), [&](std::ptrdiff_t a, std::ptrdiff_t b) {
    return gains[static_cast<std::size_t>(a - least_lag)] > gains[static_cast<std::size_t>(b - least_lag)];
  });
  for (const std::ptrdiff_t lag : peaks) {
    if (search.candidates.size() == most_candidates) break;
    const OffsetCandidate one = candidate_at(lag);
    const bool apart = std::all_of(
        search.candidates.begin(), search.candidates.end(),
        [&](const auto& other) { return std::abs(other.offset - one.offset) > std::max(0.1, memory); });
    if (apart) search.candidates.push_back(one);
  }
  return search;
}

}  // namespace pade

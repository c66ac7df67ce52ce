#include "pade/depth/motion/baseline_window.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace pade::depth {
namespace {

constexpr double kLeastVariance = 1e-10;  // of a log length: exact

/// Length along a direction that fits a translation best, and the variance of its logarithm; and as they are,
/// before a length that GPS/INS contradicts is replaced.
struct Given {
  double log_length, variance;
  double length, squared_sigma;
};

Given given_along(const RelativeMotion& motion, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d& t = motion.t_reference_other;
  const double norm = t.norm();
  constexpr double kShortest = 1e-9;  // m
  constexpr double kExact = 1e-6;     // of the length
  const double least = std::pow(std::max(kExact * norm, kShortest), 2);
  const Eigen::Matrix3d covariance =
      motion.covariance.topLeftCorner<3, 3>() + least * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d weight = covariance.ldlt().solve(direction);
  const double information = direction.dot(weight);
  const double length = weight.dot(t) / information;
  // A direction that GPS/INS contradicts: its length says little.
  constexpr double kContradicts = 0.3;
  if (!(length > kContradicts * norm)) {
    const double per_length2 = 1 / std::max(norm * norm, kShortest * kShortest);
    return {std::log(std::max(norm, kShortest)), std::max(1.0, covariance.trace() * per_length2), length,
            1 / information};
  }
  return {std::log(std::max(length, kShortest)),
          std::max(kLeastVariance, 1 / (information * std::max(length * length, kShortest * kShortest))),
          length, 1 / information};
}

/// What a step adds to the error that all lengths share, if its length is that of the images: each is an
/// average of the s before it and an error of its own, so that their common level moves by 2 / (s + 1) of
/// that.
double handed_on(const BaselineWindow::Seen& seen, Eigen::Index before) {
  const auto span = static_cast<double>(std::clamp<Eigen::Index>(seen.steps, 1, before));
  return seen.variance * std::pow(2 / (span + 1), 2);
}

Eigen::VectorXd grown(const Eigen::VectorXd& v, double value) {
  Eigen::VectorXd out(v.size() + 1);
  out << v, value;
  return out;
}

}  // namespace

void BaselineWindow::drop_oldest() {
  constexpr double kMemory = 0.98;
  past_scatter_ = kMemory * (past_scatter_ + std::pow(given_[0] - x_[0], 2) / variances_[0]);
  past_steps_ = kMemory * (past_steps_ + 1);
  const Eigen::Index n = x_.size() - 1;
  const Eigen::VectorXd share = information_.col(0).tail(n) / information_(0, 0);
  right_ = Eigen::VectorXd(right_.tail(n) - share * right_[0]);
  information_ = Eigen::MatrixXd(information_.bottomRightCorner(n, n) - share * information_.row(0).tail(n));
  for (Eigen::VectorXd* values : {&x_, &given_, &variances_}) *values = Eigen::VectorXd(values->tail(n));
}

double BaselineWindow::surprise(const RelativeMotion& given, const Eigen::Vector3d& direction,
                                const Seen& seen) const {
  const Eigen::Index n = x_.size();
  if (n == 0) return 0;
  const Given measured = given_along(given, direction);
  const Eigen::Index span = std::clamp<Eigen::Index>(seen.steps, 1, n);
  Eigen::VectorXd share = Eigen::VectorXd::Zero(n);
  share.tail(span) = x_.tail(span).array().exp();
  share /= share.sum();
  const double difference = std::log(seen.length) - measured.log_length;
  const double of_images = seen.variance + share.dot(information_.ldlt().solve(share));
  // Of a hover GPS/INS may know that it is one and yet have no idea of the logarithm.
  const double apart = seen.length - measured.length;
  return std::min(difference * difference / (measured.variance + of_images),
                  apart * apart / (measured.squared_sigma + seen.length * seen.length * of_images));
}

std::vector<double> BaselineWindow::push(const RelativeMotion& given, const Eigen::Vector3d& direction,
                                         const std::optional<Seen>& seen) {
  if (x_.size() == most_) drop_oldest();
  const Eigen::Index n = x_.size();
  const Given measured = given_along(given, direction);
  Eigen::MatrixXd larger = Eigen::MatrixXd::Zero(n + 1, n + 1);
  larger.topLeftCorner(n, n) = information_;
  larger(n, n) = 1 / measured.variance;
  information_ = larger;
  right_ = grown(right_, measured.log_length / measured.variance);
  given_ = grown(given_, measured.log_length);
  variances_ = grown(variances_, measured.variance);
  if (seen && n > 0) {
    const Eigen::Index span = std::clamp<Eigen::Index>(seen->steps, 1, n);
    const Eigen::VectorXd lengths = x_.tail(span).array().exp();
    Eigen::VectorXd row = Eigen::VectorXd::Zero(n + 1);
    row[n] = 1;
    row.segment(n - span, span) = -lengths / lengths.sum();
    const double value = std::log(seen->length) + row.segment(n - span, span).dot(x_.tail(span));
    information_ += row * row.transpose() / seen->variance;
    right_ += row * (value / seen->variance);
  }
  const Eigen::VectorXd best = information_.ldlt().solve(right_);
  const Eigen::VectorXd factors = (best.head(n) - x_).array().exp();
  x_ = best;
  common_ = seen && n > 0 ? std::min(of_the_window(), common_ + handed_on(*seen, n)) : of_the_window();
  return {factors.begin(), factors.end()};
}

double BaselineWindow::length() const { return std::exp(x_[x_.size() - 1]); }

double BaselineWindow::of_the_window() const {
  const auto n = static_cast<double>(x_.size());
  const double stated = n / variances_.cwiseInverse().sum();
  const double scatter = ((given_ - x_).cwiseAbs2().array() / variances_.array()).sum() + past_scatter_;
  const double free = std::max(1.0, n - 1) + past_steps_;
  const double own = std::min(1.0, scatter / free);  // share of the variance that is each step's own
  return stated * (1 - own + own / n);
}

}  // namespace pade::depth

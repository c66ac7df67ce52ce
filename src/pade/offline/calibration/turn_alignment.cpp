#include "pade/offline/calibration/turn_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <fmt/format.h>

#include "pade/core/compute/median.hpp"
#include "pade/core/pose.hpp"
#include "pade/offline/calibration/turn_search.hpp"

namespace pade {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Vector8 = Eigen::Matrix<double, 8, 1>;  // offset, drift, mounting, bias
using Matrix8 = Eigen::Matrix<double, 8, 8>;

constexpr std::size_t kFewestPairs = 40;
constexpr double kLeastOverlap = 3;        // s
constexpr double kOverlapShare = 1.0 / 3;  // of the shorter recording
constexpr std::size_t kCandidates = 10;
constexpr double kDriftSigma = 1e-4;        // of quartz clocks, and more
constexpr double kMountingSigma = 1;        // rad: nothing is known
constexpr double kBiasSigma = 0.05;         // rad/s
constexpr double kCertain = 4.685 * 4.685;  // Tukey's reach, squared
constexpr double kRemembered = 1.5;         // s over which errors of turns are one error
constexpr double kLeastExplained = 0.5;     // of the variance of the turns
constexpr double kAlike = 1.5;              // variance left at another offset over that at the best
constexpr double kUsefulSigma = 0.02;       // s
constexpr double kAboveNoise = 3;           // information on the mounting over what noise makes
constexpr int kSettledIteration = 100;
constexpr double kDegree = std::numbers::pi / 180;

/// What is looked for.
struct Guess {
  double offset = 0, drift = 0;
  Quaterniond R = Quaterniond::Identity();  // R_body_camera
  Vector3d bias = Vector3d::Zero();

  [[nodiscard]] Guess moved(const Vector8& step) const {
    return {offset + step[0], drift + step[1], (R * rotation_exp(Vector3d(step.segment<3>(2)))).normalized(),
            bias + step.tail<3>()};
  }
};

/// One pair under a guess.
struct Residual {
  Vector3d e = Vector3d::Zero();  // R_from_to of the images is that of the gyroscope times exp(e)
  Eigen::Matrix<double, 3, 8> J = Eigen::Matrix<double, 3, 8>::Zero();
  Matrix3d weight = Matrix3d::Zero();  // inverse covariance
  double robust = 0;
  double turned2 = 0;  // squared turn, without bias, rad²
  bool used = false;
};

class TurnProblem {
 public:
  /// @param middle  time of an image at which the offset is that of the guess
  TurnProblem(const std::vector<ImageTurn>& turns, const GyroTrack& gyro, Time middle)
      : turns_(turns), gyro_(gyro), middle_(middle), noise_(gyro.noise()) {}

  /// Solves from a guess on.
  void solve(Guess& guess) {
    prior_ = guess.R;
    for (int iteration = 0; iteration < 40; ++iteration) {
      evaluate(guess);
      weigh(iteration);
      Matrix8 H = prior_information();
      Vector8 g = prior_gradient(guess);
      for (const Residual& r : residuals_) {
        if (!r.used) continue;
        H += r.robust * r.J.transpose() * r.weight * r.J;
        g += r.robust * r.J.transpose() * r.weight * r.e;
      }
      Vector8 step = -scaled_solve(H, g);
      if (!step.allFinite()) break;
      const double most = std::max(std::abs(step[0]) / 0.1, step.segment<3>(2).norm() / 0.3);
      if (most > 1) step /= most;
      guess = guess.moved(step);
      if (iteration > 4 && std::abs(step[0]) < 1e-7 && step.segment<3>(2).norm() < 1e-7) break;
    }
    evaluate(guess);
    weigh(kSettledIteration);
  }

  /// Covariance of a step at the solution: by the scatter of gradients of pairs up to kRemembered apart, and
  /// at least what independent pairs would have.
  [[nodiscard]] Matrix8 covariance() const {
    Matrix8 H = prior_information();
    Matrix8 model = prior_information();
    Matrix8 meat = prior_information();
    std::vector<Vector8> gradients;
    for (const Residual& r : residuals_) {
      gradients.emplace_back(Vector8::Zero());
      if (!r.used) continue;
      const Matrix8 one = r.robust * r.J.transpose() * r.weight * r.J;
      H += one;
      model += one;
      gradients.back() = r.robust * r.J.transpose() * r.weight * r.e;
    }
    const double length =
        seconds_between(turns_.front().from, turns_.back().to) / static_cast<double>(turns_.size());
    const double n = static_cast<double>(used());
    const auto remembered =
        static_cast<std::size_t>(std::clamp(kRemembered / length, 4.0, std::max(4.0, n / 8)));
    for (std::size_t i = 0; i < gradients.size(); ++i) {
      meat += gradients[i] * gradients[i].transpose();
      for (std::size_t lag = 1; lag <= remembered && lag <= i; ++lag) {
        const double share = 1 - static_cast<double>(lag) / static_cast<double>(remembered + 1);
        const Matrix8 both = gradients[i] * gradients[i - lag].transpose();
        meat += share * (both + both.transpose());
      }
    }
    for (const Vector3d& axis : untold()) {
      Vector8 along = Vector8::Zero();
      along.segment<3>(2) = axis;
      const Matrix8 across = Matrix8::Identity() - along * along.transpose();
      const Matrix8 believed = along * along.transpose() / (kMountingSigma * kMountingSigma);
      for (Matrix8* of : {&H, &model, &meat}) *of = across * *of * across + believed;
    }
    meat *= n / std::max(1.0, n - 8 - static_cast<double>(remembered) / 2);
    const Matrix8 inverse = scaled_inverse(H);
    const Matrix8 alone = inverse * model * inverse;
    const Matrix8 scatter = inverse * meat * inverse;
    const Vector8 ratio = scatter.diagonal().cwiseQuotient(alone.diagonal()).cwiseMax(1.0).cwiseSqrt();
    return ratio.asDiagonal() * alone * ratio.asDiagonal();
  }

  [[nodiscard]] std::size_t used() const {
    return static_cast<std::size_t>(
        std::count_if(residuals_.begin(), residuals_.end(), [](const Residual& r) { return r.used; }));
  }
  [[nodiscard]] std::size_t outliers() const {
    return static_cast<std::size_t>(std::count_if(
        residuals_.begin(), residuals_.end(), [](const Residual& r) { return r.used && r.robust < 0.3; }));
  }
  /// Share of the turns' variance that is explained.
  [[nodiscard]] double explained() const {
    double left = 0, turned = 0;
    for (const Residual& r : residuals_) {
      if (!r.used) continue;
      left += r.robust * r.e.squaredNorm();
      turned += r.robust * r.turned2;
    }
    return turned > 0 ? 1 - left / turned : 0;
  }
  [[nodiscard]] double spread() const {
    std::vector<double> sizes;
    for (const Residual& r : residuals_) {
      if (!r.used) continue;
      for (int axis = 0; axis < 3; ++axis) sizes.push_back(std::abs(r.e[axis]));
    }
    return sizes.empty() ? 0 : median_to_sigma * median(sizes);
  }
  [[nodiscard]] const std::vector<Residual>& residuals() const { return residuals_; }
  [[nodiscard]] Time middle() const { return middle_; }

  void evaluate(const Guess& guess) {
    residuals_.assign(turns_.size(), {});
    const Matrix3d R = guess.R.toRotationMatrix();
    for (std::size_t k = 0; k < turns_.size(); ++k) {
      const ImageTurn& turn = turns_[k];
      const double s1 = seconds_between(middle_, turn.from);
      const double s2 = seconds_between(middle_, turn.to);
      const auto body = gyro_.between(shifted(turn.from, guess.offset + guess.drift * s1),
                                      shifted(turn.to, guess.offset + guess.drift * s2));
      if (!body) continue;
      Residual& r = residuals_[k];
      const double duration = s2 - s1;
      // Half of the bias's turn on either side of the body's.
      const Quaterniond half = rotation_exp(Vector3d(-0.5 * duration * guess.bias));
      const Matrix3d G = (half * body->R_1_2 * half).toRotationMatrix();
      const Matrix3d P = R.transpose() * G * R;
      r.e = rotation_log(Matrix3d(P.transpose() * turn.R_from_to.toRotationMatrix()));
      const Vector3d ends_2 = R.transpose() * body->rate_2;
      const Vector3d ends_1 = R.transpose() * (G.transpose() * body->rate_1);
      r.J.col(0) = -(ends_2 - ends_1);
      r.J.col(1) = -(ends_2 * s2 - ends_1 * s1);
      r.J.middleCols<3>(2) = -(Matrix3d::Identity() - P.transpose());
      r.J.rightCols<3>() = 0.5 * duration * R.transpose() * (Matrix3d::Identity() + G.transpose());
      r.turned2 = rotation_log(G).squaredNorm();
      r.used = r.e.allFinite();
    }
  }

 private:
  /// Axes of the mounting, camera axes, of which most of what the turns seem to tell is noise of the
  /// gyroscope: a turn n that there was not tells as much of it as one that there was.
  [[nodiscard]] std::vector<Vector3d> untold() const {
    Matrix3d information = Matrix3d::Zero();
    double noise = 0;
    for (std::size_t k = 0; k < turns_.size(); ++k) {
      const Residual& r = residuals_[k];
      if (!r.used) continue;
      const Eigen::Matrix3d J = r.J.middleCols<3>(2);
      const double variance = noise_ * seconds_between(turns_[k].from, turns_[k].to);
      information += r.robust * J.transpose() * r.weight * J;
      noise += r.robust * 2 * variance * r.weight.trace() / 3;
    }
    const Eigen::SelfAdjointEigenSolver<Matrix3d> parts(information);
    std::vector<Vector3d> axes;
    for (int i = 0; i < 3; ++i)
      if (parts.eigenvalues()[i] < kAboveNoise * noise) axes.emplace_back(parts.eigenvectors().col(i));
    return axes;
  }

  static Time shifted(Time time, double seconds) { return {time.nanoseconds + std::llround(seconds * 1e9)}; }

  /// Weights of all pairs. What gyroscope and interpolation add to the images' own variances is found such
  /// that the median of the squared distances is what it should be.
  void weigh(int iteration) {
    constexpr double kMedian3 = 2.366;  // of chi-square of three
    struct Parts {
      Vector3d variance, e;
    };
    std::vector<Parts> parts;
    for (std::size_t k = 0; k < turns_.size(); ++k) {
      if (!residuals_[k].used) continue;
      const Matrix3d& C = turns_[k].covariance;
      parts.push_back({C.diagonal(), residuals_[k].e});
    }
    const auto typical = [&](double added) {
      std::vector<double> distances;
      distances.reserve(parts.size());
      for (const Parts& p : parts)
        distances.push_back((p.e.array().square() / (p.variance.array() + added)).sum());
      return median(distances);
    };
    double low = 1e-12, high = 0.1;
    if (parts.empty() || typical(low) < kMedian3) {
      high = low;
    } else {
      for (int i = 0; i < 40; ++i) {
        const double middle = std::sqrt(low * high);
        (typical(middle) > kMedian3 ? low : high) = middle;
      }
    }
    added_ = high;
    // Wide at first: an offset that is off by some tenths leaves all pairs far off.
    const double reach = kCertain * (iteration < 3 ? 4 : 1);
    for (std::size_t k = 0; k < turns_.size(); ++k) {
      Residual& r = residuals_[k];
      if (!r.used) continue;
      r.weight = (turns_[k].covariance + added_ * Matrix3d::Identity()).inverse();
      const double u = r.e.dot(r.weight * r.e) / (1.6 * reach);  // of three components
      r.robust = u < 1 ? (1 - u) * (1 - u) : 0;
    }
  }

  static Matrix8 prior_information() {
    Vector8 sigma;
    sigma << 1e3, kDriftSigma, Vector3d::Constant(kMountingSigma), Vector3d::Constant(kBiasSigma);
    return sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  }
  [[nodiscard]] Vector8 prior_gradient(const Guess& guess) const {
    Vector8 off;
    off << 0, guess.drift, rotation_log(Quaterniond(prior_.conjugate() * guess.R)), guess.bias;
    return prior_information() * off;
  }
  static Matrix8 scaled_inverse(const Matrix8& H) {
    const Vector8 scale = H.diagonal().cwiseSqrt().cwiseInverse();
    const Matrix8 even = scale.asDiagonal() * H * scale.asDiagonal();
    return scale.asDiagonal() * even.ldlt().solve(Matrix8::Identity()) * scale.asDiagonal();
  }
  static Vector8 scaled_solve(const Matrix8& H, const Vector8& g) { return scaled_inverse(H) * g; }

  const std::vector<ImageTurn>& turns_;
  const GyroTrack& gyro_;
  Time middle_;
  double noise_;  // of the gyroscope, rad²/s
  Quaterniond prior_ = Quaterniond::Identity();
  std::vector<Residual> residuals_;
  double added_ = 0;  // rad²
};

/// The rotation that turns the camera's rates into the body's: where they tell only an axis, the nearest to
/// what is believed.
Quaterniond mounting_of(const Matrix3d& cross, const Quaterniond& believed) {
  constexpr double kHint = 1e-3;
  const Matrix3d sum = cross.transpose() + kHint * cross.norm() * believed.toRotationMatrix();
  const Eigen::JacobiSVD<Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d sign = Matrix3d::Identity();
  sign(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return Quaterniond(Matrix3d(svd.matrixU() * sign * svd.matrixV().transpose())).normalized();
}

double rms_rate(const std::vector<ImageTurn>& turns) {
  double sum = 0;
  for (const ImageTurn& turn : turns)
    sum += std::pow(rotation_log(turn.R_from_to).norm() / seconds_between(turn.from, turn.to), 2);
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, turns.size())));
}

/// What a solution says.
TurnAlignment alignment_of(const std::vector<ImageTurn>& turns, const TurnProblem& problem,
                           const Guess& best) {
  const Matrix8 covariance = problem.covariance();
  TurnAlignment out;
  out.offset = best.offset;
  out.offset_sigma = std::sqrt(covariance(0, 0));
  out.drift = best.drift;
  out.drift_sigma = std::sqrt(covariance(1, 1));
  out.middle = problem.middle();
  out.R_body_camera = best.R;
  out.mounting_covariance = covariance.block<3, 3>(2, 2);
  out.gyro_bias = best.bias;
  out.outliers = problem.outliers();
  out.residual = problem.spread();
  out.explained = problem.explained();
  Vector3d squares = Vector3d::Zero();
  for (std::size_t k = 0; k < turns.size(); ++k) {
    if (!problem.residuals()[k].used) continue;
    if (out.pairs == 0) out.first = turns[k].from;
    out.last = turns[k].to;
    ++out.pairs;
    const double duration = seconds_between(turns[k].from, turns[k].to);
    squares += (best.R * (rotation_log(turns[k].R_from_to) / duration)).cwiseAbs2();
  }
  out.turn_rates = (squares / static_cast<double>(std::max<std::size_t>(1, out.pairs))).cwiseSqrt();
  return out;
}

std::string rates_of(const std::vector<ImageTurn>& turns, const GyroTrack& gyro) {
  return fmt::format("the images turn at {:.1f} deg/s, the IMU at {:.1f} deg/s (root of mean square)",
                     rms_rate(turns) / kDegree, gyro.spread() / kDegree);
}

/// Refuses what is no use.
Status check(const TurnAlignment& found, const std::string& rates) {
  if (found.pairs < kFewestPairs) {
    return Error{fmt::format(
        "found {} pairs of images to compare at the best offset, {:.3f} s, expected {} or more; {}",
        found.pairs, found.offset, kFewestPairs, rates)};
  }
  if (found.explained < kLeastExplained) {
    return Error{fmt::format(
        "found no offset at which the turns fit: the best, {:.3f} s, explains {:.0f} % of them, expected "
        "{:.0f} % "
        "or more; {}. Either the two are not of one flight (or their stamps do not count seconds), or there "
        "is too little rotation",
        found.offset, 100 * std::max(0.0, found.explained), 100 * kLeastExplained, rates)};
  }
  if (found.outliers * 2 > found.pairs) {
    return Error{fmt::format(
        "{} of {} turns of the images contradict the best offset, {:.3f} s, expected less than half; {}",
        found.outliers, found.pairs, found.offset, rates)};
  }
  if (found.offset_sigma > kUsefulSigma) {
    return Error{fmt::format(
        "found the offset only to within {:.0f} ms (1 sigma), expected {:.0f} ms or less: too little of the "
        "rotation starts and stops; {}",
        1e3 * found.offset_sigma, 1e3 * kUsefulSigma, rates)};
  }
  return {};
}

}  // namespace

Vector3d TurnAlignment::mounting_sigma() const {
  const Matrix3d R = R_body_camera.toRotationMatrix();
  return (R * mounting_covariance * R.transpose()).diagonal().cwiseSqrt();
}

std::optional<Quaterniond> expected_turn(const TurnAlignment& alignment, const GyroTrack& gyro, Time from,
                                         Time to) {
  const auto at = [&](Time time) {
    const double offset = alignment.offset + alignment.drift * seconds_between(alignment.middle, time);
    return Time{time.nanoseconds + std::llround(offset * 1e9)};
  };
  const auto body = gyro.between(at(from), at(to));
  if (!body) return std::nullopt;
  const Quaterniond half = rotation_exp(Vector3d(-0.5 * seconds_between(from, to) * alignment.gyro_bias));
  const Quaterniond& R = alignment.R_body_camera;
  return (R.conjugate() * half * body->R_1_2 * half * R).normalized();
}

Result<TurnAlignment> realign_turns(const std::vector<ImageTurn>& turns, const GyroTrack& gyro,
                                    const TurnAlignment& known) {
  if (turns.empty()) return Error{"found no turns, expected some"};
  TurnProblem problem(turns, gyro, known.middle);
  Guess guess{known.offset, known.drift, known.R_body_camera, known.gyro_bias};
  problem.solve(guess);
  TurnAlignment out = alignment_of(turns, problem, guess);
  out.correlation = known.correlation;
  out.runner_up = known.runner_up;
  out.runner_up_offset = known.runner_up_offset;
  out.searched_from = known.searched_from;
  out.searched_to = known.searched_to;
  if (const Status good = check(out, rates_of(turns, gyro)); !good) return good.error();
  return out;
}

Result<TurnAlignment> align_turns(const std::vector<ImageTurn>& turns, const GyroTrack& gyro,
                                  const std::optional<Quaterniond>& believed) {
  if (turns.size() < kFewestPairs) {
    return Error{fmt::format("found {} pairs of images that tell how the camera turned, expected at least {}",
                             turns.size(), kFewestPairs)};
  }
  if (gyro.empty()) return Error{"found no two samples of a gyroscope, expected some hundred"};
  const double spans[] = {seconds_between(turns.front().from, turns.back().to),
                          seconds_between(gyro.first(), gyro.last())};
  const double shorter = std::min(spans[0], spans[1]);
  if (shorter < kLeastOverlap) {
    return Error{
        fmt::format("found images over {:.1f} s and an IMU over {:.1f} s, expected at least {:.0f} s of each",
                    spans[0], spans[1], kLeastOverlap)};
  }
  const auto search =
      search_offsets(turns, gyro, std::max(kLeastOverlap, kOverlapShare * shorter), kCandidates);
  if (!search) return search.error();
  const std::string rates = rates_of(turns, gyro);
  struct Solved {
    Guess guess;
    double left, correlation;
    double pairs;
    /// Of likelihood: few pairs that fit well are no better than many.
    [[nodiscard]] double gain() const { return -pairs * std::log(left); }
  };
  const Quaterniond start = believed.value_or(Quaterniond(forward_camera_rotation()));
  const Time middle{turns.front().from.nanoseconds / 2 + turns.back().to.nanoseconds / 2};
  TurnProblem problem(turns, gyro, middle);
  std::vector<Solved> solved;
  for (const OffsetCandidate& candidate : search->candidates) {
    Guess guess;
    guess.offset = candidate.offset;
    guess.R = mounting_of(candidate.cross, start);
    problem.solve(guess);
    if (problem.used() < kFewestPairs) continue;
    constexpr double kSame = 0.05;  // s
    const bool known = std::any_of(solved.begin(), solved.end(), [&](const Solved& s) {
      return std::abs(s.guess.offset - guess.offset) < kSame;
    });
    if (!known)
      solved.push_back({guess, std::max(1 - problem.explained(), 1e-9), candidate.correlation,
                        static_cast<double>(problem.used())});
  }
  if (solved.empty())
    return Error{fmt::format("found no offset at which both turn; {}, expected a flight with turns", rates)};
  std::sort(solved.begin(), solved.end(),
            [](const Solved& a, const Solved& b) { return a.gain() > b.gain(); });
  Guess best = solved.front().guess;
  problem.solve(best);
  TurnAlignment out = alignment_of(turns, problem, best);
  out.correlation = solved.front().correlation;
  out.searched_from = search->from;
  out.searched_to = search->to;
  if (solved.size() > 1) {
    out.runner_up = solved[1].correlation;
    out.runner_up_offset = solved[1].guess.offset;
  }
  if (const Status good = check(out, rates); !good) return good.error();
  if (solved.size() > 1 && solved[1].left < kAlike * solved[0].left) {
    return Error{
        fmt::format("found two offsets that fit nearly alike: {:.3f} s (leaves {:.1f} % of the turns "
                    "unexplained) and {:.3f} s "
                    "({:.1f} %): the turns repeat themselves, expected some that do not",
                    out.offset, 100 * solved[0].left, out.runner_up_offset, 100 * solved[1].left)};
  }
  return out;
}

}  // namespace pade

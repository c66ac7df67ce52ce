#include "pade/pipeline/recent_frames.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pade {
namespace {

void set_length_variance(RelativeMotion& motion, double of_logarithm) {
  const Eigen::Vector3d& t = motion.t_reference_other;
  const double squared = t.squaredNorm();
  if (!(squared > 0)) return;
  auto covariance = motion.covariance.topLeftCorner<3, 3>();
  const double along = t.dot(covariance * t) / squared;
  covariance += (of_logarithm - along / squared) * t * t.transpose();
}

}  // namespace

void RecentFrames::push(TrackedFrame frame, int most) {
  frames_.push_back(std::move(frame));
  while (size() > most) frames_.pop_front();
}

std::vector<int> RecentFrames::views(const Frame& newest, int count, int frames, int step) const {
  const auto length_to = [&](int i) {
    return (before(i).frame.T_world_camera.translation - newest.T_world_camera.translation).norm();
  };
  const int oldest = std::min(frames, size()) / step * step;
  int farthest = 0;  // a camera that turns back was farther away in between
  double wanted = 0;
  for (int i = step; i <= oldest; i += step) {
    const double length = length_to(i);
    if (length >= wanted && length > 0) {
      farthest = i;
      wanted = length;
    }
  }
  std::vector<int> views;
  for (int i = farthest; i >= 1 && static_cast<int>(views.size()) < count; i -= step) {
    const double length = length_to(i);
    if (length > wanted || !(length > 0)) continue;
    views.push_back(i);
    wanted = length / 2 * (1 + 1e-6);
  }
  std::reverse(views.begin(), views.end());
  return views;
}

double RecentFrames::stretch(const std::vector<double>& factors, int steps, double variance) {
  if (frames_.empty()) return 1;
  Eigen::Vector3d was = last().frame.T_world_camera.translation;
  Eigen::Vector3d is = was;
  double before_it = 0;
  double after_it = 0;
  const std::size_t known = std::min(factors.size(), frames_.size() - 1);
  for (std::size_t i = 1; i <= known; ++i) {
    Eigen::Vector3d& p = frames_[frames_.size() - 1 - i].frame.T_world_camera.translation;
    const Eigen::Vector3d step = p - was;
    const double factor = factors[factors.size() - i];
    was = p;
    is += factor * step;
    p = is;
    if (auto& motion = frames_[frames_.size() - i].motion) {
      motion->t_reference_other *= factor;
      set_length_variance(*motion, variance);
    }
    if (static_cast<int>(i) > steps) continue;
    before_it += step.norm();
    after_it += factor * step.norm();
  }
  return before_it > 0 ? after_it / before_it : 1;
}

Matrix6d RecentFrames::covariance(const Frame& newest, const RelativeMotion& first, int frames,
                                  int step) const {
  Matrix6d sum = first.covariance;
  Eigen::Vector3d lengthened = Eigen::Vector3d::Zero();  // by one sigma of all lengths
  Eigen::Matrix3d of_lengths = Eigen::Matrix3d::Zero();  // as far as `sum` has them
  const auto lengthen = [&](const RelativeMotion& motion, const Matrix6d& covariance,
                            const Eigen::Matrix3d& R) {
    const double length = motion.t_reference_other.norm();
    if (!(length > 0)) return;
    const Eigen::Vector3d along = R * motion.t_reference_other / length;
    const double variance = along.dot(covariance.topLeftCorner<3, 3>() * along);
    lengthened += std::sqrt(std::max(variance, 0.0)) * along;
    of_lengths += variance * along * along.transpose();
  };
  lengthen(first, first.covariance, Eigen::Matrix3d::Identity());
  for (int i = step; i < frames; i += step) {
    const TrackedFrame& frame = before(i);
    const RelativeMotion& motion = frame.motion ? *frame.motion : first;
    const Eigen::Matrix3d R =
        (newest.T_world_camera.rotation.conjugate() * frame.frame.T_world_camera.rotation).toRotationMatrix();
    Matrix6d turned = Matrix6d::Zero();
    turned.topLeftCorner<3, 3>() = turned.bottomRightCorner<3, 3>() = R;
    const Matrix6d covariance = turned * motion.covariance * turned.transpose();
    sum += covariance;
    lengthen(motion, covariance, R);
  }
  if (frames > step) sum.topLeftCorner<3, 3>() += lengthened * lengthened.transpose() - of_lengths;
  return sum;
}

}  // namespace pade

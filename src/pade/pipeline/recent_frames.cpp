#include "pade/pipeline/recent_frames.hpp"

#include <algorithm>
#include <utility>

namespace pade {

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

double RecentFrames::stretch(const std::vector<double>& factors, int steps) {
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
    if (static_cast<int>(i) > steps) continue;
    before_it += step.norm();
    after_it += factor * step.norm();
  }
  return before_it > 0 ? after_it / before_it : 1;
}

Matrix6d over_several(const RelativeMotion& one, int n) {
  Matrix6d sum = n * one.covariance;
  const double length = one.t_reference_other.norm();
  if (!(length > 0)) return sum;
  const Eigen::Vector3d along = one.t_reference_other / length;
  const double variance = along.dot(one.covariance.topLeftCorner<3, 3>() * along);
  sum.topLeftCorner<3, 3>() += (n * n - n) * variance * along * along.transpose();
  return sum;
}

}  // namespace pade

#include "pade/evaluation/map/rigid_alignment.hpp"

#include <cmath>

#include <Eigen/LU>
#include <Eigen/SVD>

namespace pade::evaluation {
namespace {

constexpr double kSame = 1e-6;  // metres, rad

bool same(const Pose& a, const Pose& b) {
  return (a.translation - b.translation).norm() <= kSame &&
         rotation_log(Eigen::Quaterniond(a.rotation.conjugate() * b.rotation)).norm() <= kSame;
}

}  // namespace

RigidAlignment align(const std::vector<Pose>& T_map_camera, const std::vector<Pose>& T_world_camera) {
  RigidAlignment result;
  result.poses = T_map_camera.size();
  if (T_map_camera.empty()) return result;
  const auto n = static_cast<double>(T_map_camera.size());
  Eigen::Vector3d mean_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_world = Eigen::Vector3d::Zero();
  bool all_same = true;
  for (std::size_t i = 0; i < T_map_camera.size(); ++i) {
    mean_map += T_map_camera[i].translation / n;
    mean_world += T_world_camera[i].translation / n;
    all_same = all_same && same(T_map_camera[i], T_world_camera[i]);
  }
  if (all_same) return result;

  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < T_map_camera.size(); ++i) {
    moment +=
        (T_map_camera[i].translation - mean_map) * (T_world_camera[i].translation - mean_world).transpose();
    moment += 0.5 * alignment_lever * alignment_lever * T_map_camera[i].matrix3() *
              T_world_camera[i].matrix3().transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(moment, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d rotation =
      svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  result.T_map_world.rotation = Eigen::Quaterniond(rotation).normalized();
  result.T_map_world.translation = mean_map - rotation * mean_world;
  result.shift = mean_map - mean_world;
  result.rotation = rotation_log(result.T_map_world.rotation).norm();
  for (std::size_t i = 0; i < T_map_camera.size(); ++i) {
    const Pose aligned = result.T_map_world * T_world_camera[i];
    result.rms_position += (aligned.translation - T_map_camera[i].translation).squaredNorm() / n;
    result.rms_rotation +=
        rotation_log(Eigen::Quaterniond(aligned.rotation.conjugate() * T_map_camera[i].rotation))
            .squaredNorm() /
        n;
  }
  result.rms_position = std::sqrt(result.rms_position);
  result.rms_rotation = std::sqrt(result.rms_rotation);
  return result;
}

Pose registration(const Pose& T_map_camera, const Pose& T_world_camera) {
  return same(T_map_camera, T_world_camera) ? Pose{} : T_map_camera * T_world_camera.inverse();
}

}  // namespace pade::evaluation

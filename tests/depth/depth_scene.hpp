// An analytic scene seen from two poses: exact flow and depth for the tests of depth from motion.
#pragma once

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/random.hpp"
#include "pade/depth/depth_estimator.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

namespace pade::depth {

/// A pair of frames in the facade scene: the reference frame at the start of the flight, and another that is
/// moved by T_reference_other.
struct ScenePair {
  simulation::AnalyticFlight flight;
  Camera camera;
  Pose T_world_reference, T_world_other;
  RelativeMotion motion;
  cv::Mat truth;                     // depth of the reference
  simulation::ExactFlowField exact;  // from the reference to the other frame

  ScenePair(const Camera& of, const Eigen::Vector3d& translation, const Eigen::Vector3d& rotation_vector)
      : flight(simulation::make_analytic_flight("forward", 2, of).value()), camera(flight.camera) {
    T_world_reference = flight.T_world_camera.front();
    T_world_other = T_world_reference * Pose{rotation_exp(rotation_vector), translation};
    motion = relative_motion(T_world_reference, T_world_other, 0.1);
    truth = simulation::exact_depth(flight.scene, camera, T_world_reference);
    exact = simulation::exact_flow(flight.scene, camera, T_world_reference, T_world_other);
  }

  /// The exact flow with independent normal noise on each component.
  [[nodiscard]] FlowField noisy_flow(double sigma, std::uint64_t seed) const {
    Random random(seed);
    FlowField noisy{exact.flow.vectors.clone(), {}};
    for (auto& w : cv::Mat_<cv::Vec2f>(noisy.vectors)) {
      w[0] += static_cast<float>(sigma * random.normal());
      w[1] += static_cast<float>(sigma * random.normal());
    }
    return noisy;
  }

  /// Parallax of a pixel in px: length of the exactly derotated flow.
  [[nodiscard]] double parallax(int v, int u) const {
    const Eigen::Vector2d p(u - camera.cx, v - camera.cy);
    const double s = static_cast<double>(truth.at<float>(v, u)) - motion.t_reference_other.z();
    const Eigen::Vector2d a(camera.fx * motion.t_reference_other.x() - p.x() * motion.t_reference_other.z(),
                            camera.fy * motion.t_reference_other.y() - p.y() * motion.t_reference_other.z());
    return a.norm() / s;
  }
};

inline bool is_measured(const DepthImage& image, int v, int u) {
  return image.state.at<std::uint8_t>(v, u) == static_cast<std::uint8_t>(DepthState::measured);
}

}  // namespace pade::depth

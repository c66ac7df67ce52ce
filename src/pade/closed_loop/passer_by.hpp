// Somebody who walks across the way of a flight: drawn into its images, in no map of the world.
#pragma once

#include <memory>

#include <Eigen/Core>

#include "pade/closed_loop/flight_record.hpp"
#include "pade/core/result.hpp"
#include "pade/simulation/flight/frame_maker.hpp"

namespace pade::closed_loop {

/// 1.8 m tall and 0.6 m wide, at 1.4 m/s from the right to the left, through whatever stands there. Casts no
/// shadow.
class PasserBy {
 public:
  /// @param ahead  how far along the way from the start it crosses, m. @param when  s after take-off
  static Result<PasserBy> create(const FlightTask& task, const Camera& camera,
                                 const simulation::FrameOptions& frame, double ahead, double when);

  /// Draws it over a picture where it is nearer than what is there.
  /// @param light  of the camera at `T_world_camera`. @param time  s after take-off
  void draw(simulation::Rendering& light, const Pose& T_world_camera, double time) const;
  /// From a point to its surface, m; 0 within it.
  [[nodiscard]] double distance(const Eigen::Vector3d& point, double time) const;

 private:
  PasserBy() = default;
  /// On the ground, under its middle.
  [[nodiscard]] Eigen::Vector3d at(double time) const;

  std::unique_ptr<simulation::Scene> scene_;
  std::unique_ptr<simulation::FrameMaker> maker_;  // of `scene_`, in which it stands at the origin
  Eigen::Vector3d crossing_ = Eigen::Vector3d::Zero(), walk_ = Eigen::Vector3d::UnitY();  // m, m/s
  double when_ = 0;
};

}  // namespace pade::closed_loop

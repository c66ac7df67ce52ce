#include "pade/closed_loop/passer_by.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pade::closed_loop {
namespace {

using Eigen::Vector3d;
using simulation::Capsule;
using simulation::FrameMaker;
using simulation::FrameOptions;
using simulation::PatternKind;
using simulation::Rendering;
using simulation::Scene;
using simulation::Visual;
using simulation::World;
constexpr double kRadius = 0.3;  // m
constexpr double kHeight = 1.8;  // m
constexpr double kPace = 1.4;    // m/s

}  // namespace

Result<PasserBy> PasserBy::create(const FlightTask& task, const Camera& camera, const FrameOptions& frame,
                                  double ahead, double when) {
  World world = task.scene.world();  // the light is the same
  world.visuals.clear();
  world.sky = false;
  Visual body;
  body.name = "passer-by";
  body.shape = Capsule{kRadius, kHeight - 2 * kRadius};
  body.T_world_shape.translation = {0, 0, 0.5 * kHeight};
  body.material.colour = Vector3d(0.9, 0.5, 0.2);
  body.material.pattern.kind = PatternKind::gravel;
  body.material.pattern.scale = 0.3;
  world.visuals.push_back(body);
  auto scene = Scene::build(std::move(world));
  if (!scene) return scene.error();
  PasserBy out;
  out.scene_ = std::make_unique<Scene>(std::move(scene).value());
  out.maker_ = std::make_unique<FrameMaker>(*out.scene_, camera, frame);
  const Vector3d way = task.goal - task.start;
  const Vector3d along = Vector3d(way.x(), way.y(), 0).normalized();
  out.crossing_ = task.start + ahead * along;
  out.crossing_.z() = 0;
  out.walk_ = kPace * Vector3d(-along.y(), along.x(), 0);
  out.when_ = when;
  return out;
}

Vector3d PasserBy::at(double time) const { return crossing_ + (time - when_) * walk_; }

void PasserBy::draw(Rendering& light, const Pose& T_world_camera, double time) const {
  const Pose seen_from{T_world_camera.rotation, T_world_camera.translation - at(time)};
  const Rendering own = maker_->expose(seen_from, [&](double) { return seen_from; });
  for (int v = 0; v < light.depth.rows; ++v) {
    const auto* near = own.depth.ptr<float>(v);
    auto* far = light.depth.ptr<float>(v);
    for (int u = 0; u < light.depth.cols; ++u) {
      if (!(near[u] > 0) || far[u] <= near[u]) continue;  // no number: nothing is there
      far[u] = near[u];
      light.radiance.at<cv::Vec3f>(v, u) = own.radiance.at<cv::Vec3f>(v, u);
    }
  }
}

double PasserBy::distance(const Vector3d& point, double time) const {
  const Vector3d from_foot = point - at(time);
  const double along = std::clamp(from_foot.z(), kRadius, kHeight - kRadius);
  return std::max(0.0, (from_foot - Vector3d(0, 0, along)).norm() - kRadius);
}

}  // namespace pade::closed_loop

// OBSTACLE_DISTANCE_3D through what ArduPilot makes of it, written down from its sources (AP_Proximity_MAV
// and the boundary of 5 layers by 8 sectors).
#include "pade/live/link/obstacle_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

namespace pade::live {
namespace {

using Eigen::Vector3d;
using mapping::MapView;
using mapping::OccupancyMap;

constexpr double kVoxel = 0.25;
constexpr double kFar = std::numeric_limits<double>::max();
constexpr double kDegree = std::numbers::pi / 180;

SectorOptions options_of_points() {
  SectorOptions options;
  options.max_distance = 10;
  options.below = options.above = 3;
  return options;
}

/// Ahead, 90° by 74°.
Camera camera_of_points() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 320;
  camera.cx = 319.5;
  camera.cy = 239.5;
  return camera;
}

Pose mounting() {
  Eigen::Matrix3d R;  // of camera axes in the body: x right, y down, z ahead
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  Pose T_body_camera;
  T_body_camera.rotation = Eigen::Quaterniond(R);
  T_body_camera.translation = {0.1, 0, 0};
  return T_body_camera;
}

/// By bearing (clockwise from ahead) and pitch (up), degrees.
std::size_t face_at(double bearing, double pitch) {
  const double turned = bearing + 22.5 - 360 * std::floor((bearing + 22.5) / 360);
  const auto sector = static_cast<std::size_t>(turned / 45) % 8;
  const auto layer = static_cast<std::size_t>(std::clamp(pitch + 75, 0.0, 149.0) / 30);
  return 8 * layer + sector;
}
/// By a point forward-right-down.
double bearing_of(const Vector3d& frd) { return std::atan2(frd.y(), frd.x()) / kDegree; }
double pitch_of(const Vector3d& frd) { return std::atan2(-frd.z(), std::hypot(frd.x(), frd.y())) / kDegree; }

/// What came with one stamp is shown when the next one comes, or after 50 ms without a message.
class ArduPilot {
 public:
  using Faces = std::array<double, 40>;

  void take(const mavlink::ObstacleDistance3d& m, double now_ms) {
    const double since = now_ms - heard_;
    heard_ = now_ms;
    if (m.frame != 12) return;
    if (m.time_boot_ms != stamp_ || since > 50) {
      shown_ = next_;
      next_.fill(kFar);
    }
    stamp_ = m.time_boot_ms;
    const Vector3d point(m.x, m.y, m.z);
    const double distance = point.norm();
    if (distance < static_cast<double>(m.min_distance) || distance > static_cast<double>(m.max_distance))
      return;
    double& face = next_[face_at(bearing_of(point), pitch_of(point))];
    face = std::min(face, distance);
  }
  void take(const std::vector<mavlink::ObstacleDistance3d>& messages, double now_ms) {
    for (const auto& m : messages) take(m, now_ms++);
  }
  [[nodiscard]] const Faces& shown() const { return shown_; }
  [[nodiscard]] double heard() const { return heard_; }

 private:
  Faces shown_ = filled(), next_ = filled();
  std::uint32_t stamp_ = 0;
  double heard_ = -1000;
  static Faces filled() {
    Faces faces{};
    faces.fill(kFar);
    return faces;
  }
};

std::shared_ptr<const MapView> view_of(const std::vector<Vector3d>& centres) {
  auto tree = std::make_unique<octomap::OcTree>(kVoxel);
  for (const Vector3d& c : centres)
    tree->setNodeValue(
        octomap::point3d(static_cast<float>(c.x()), static_cast<float>(c.y()), static_cast<float>(c.z())),
        2.0F);
  tree->updateInnerOccupancy();
  mapping::MapOptions options;
  options.voxel = kVoxel;
  return MapView::of(std::move(OccupancyMap::create(options, std::move(tree))).value());
}

Vector3d centre_of_voxel(const Vector3d& p) {
  return (p / kVoxel).array().floor().matrix() * kVoxel + Vector3d::Constant(kVoxel / 2);
}

Pose body_at(std::mt19937& random) {
  std::uniform_real_distribution<double> place(-2, 2), turn(-std::numbers::pi, std::numbers::pi),
      tilt(-0.3, 0.3);
  Pose body;
  body.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(turn(random), Vector3d::UnitZ()) *
                                     Eigen::AngleAxisd(tilt(random), Vector3d::UnitY()) *
                                     Eigen::AngleAxisd(tilt(random), Vector3d::UnitX()));
  body.translation = {place(random), place(random), place(random)};
  return body;
}

/// Points all over a voxel, forward-right-down from the body.
std::vector<Vector3d> surface_of(const Vector3d& centre, const Pose& body) {
  std::vector<Vector3d> points;
  constexpr int kSteps = 4;
  const Pose inverse = body.inverse();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      for (int i = 0; i <= kSteps; ++i) {
        for (int j = 0; j <= kSteps; ++j) {
          Vector3d p;
          p[axis] = side;
          p[(axis + 1) % 3] = 2.0 * i / kSteps - 1;
          p[(axis + 2) % 3] = 2.0 * j / kSteps - 1;
          const Vector3d flu = inverse * Vector3d(centre + (kVoxel / 2 - 1e-6) * p);
          points.emplace_back(flu.x(), -flu.y(), -flu.z());
        }
      }
    }
  }
  return points;
}

bool is_seen(const Vector3d& frd) {
  const Vector3d p = mounting().inverse() * Vector3d(frd.x(), -frd.y(), -frd.z());
  return p.z() > 0 && camera_of_points().size().area() > 0 &&
         std::abs(320 * p.x() / p.z() + 319.5 - 319.5) <= 320 &&
         std::abs(320 * p.y() / p.z() + 239.5 - 239.5) <= 240;
}

double nearest_of(const std::vector<Vector3d>& points) {
  double nearest = kFar;
  for (const Vector3d& p : points) nearest = std::min(nearest, p.norm());
  return nearest;
}

ArduPilot::Faces shown_after(const std::vector<Vector3d>& points) {
  ArduPilot autopilot;
  autopilot.take(obstacle_messages(points, 5000, options_of_points()), 0);
  return autopilot.shown();
}

class ObstaclePoints : public testing::Test {
 protected:
  /// Somewhere before the camera, within the slab.
  Vector3d ahead(const Pose& body) {
    for (;;) {
      std::uniform_real_distribution<double> u(-1, 1), far(0.6, 9);
      const double z = far(random_);
      const Vector3d in_camera(0.9 * u(random_) * z, 0.7 * u(random_) * z, z);
      const Vector3d centre = centre_of_voxel(camera_pose(body, mounting()) * in_camera);
      if (std::abs(centre.z() - body.translation.z()) < 2.5 && (centre - body.translation).norm() < 9.5)
        return centre;
    }
  }
  std::vector<Vector3d> points_of(const std::vector<Vector3d>& centres, const Pose& body) {
    const auto points =
        obstacle_points(*view_of(centres), body, options_of_points(), camera_of_points(), mounting());
    EXPECT_TRUE(points);
    return points.value_or(std::vector<Vector3d>{});
  }

  std::mt19937 random_{7};
};

/// No part of a voxel is believed farther than its nearest part, in whichever face it lies; and where
/// something is believed, there is some part of it within a cell of 5°.
TEST_F(ObstaclePoints, LoseNoneAndInventNone) {
  for (int i = 0; i < 200; ++i) {
    const Pose body = body_at(random_);
    const Vector3d centre = ahead(body);
    const auto faces = shown_after(points_of({centre}, body));
    const auto surface = surface_of(centre, body);
    const double least = std::max(nearest_of(surface), options_of_points().min_distance);
    if (std::none_of(surface.begin(), surface.end(), is_seen)) continue;
    const auto inside = [](const Vector3d& p) {  // of its face, by more than rounding
      const std::size_t face = face_at(bearing_of(p), pitch_of(p));
      return face == face_at(bearing_of(p) - 0.01, pitch_of(p) - 0.01) &&
             face == face_at(bearing_of(p) + 0.01, pitch_of(p) + 0.01);
    };
    const auto lost = std::find_if(surface.begin(), surface.end(), [&](const Vector3d& p) {
      return inside(p) && faces[face_at(bearing_of(p), pitch_of(p))] > least + 0.02;
    });
    EXPECT_TRUE(lost == surface.end()) << i << ": " << lost->transpose();
    for (std::size_t face = 0; face < faces.size(); ++face) {
      if (faces[face] == kFar) continue;
      EXPECT_NEAR(faces[face], least, 0.02) << i;
      EXPECT_TRUE(std::any_of(surface.begin(), surface.end(),
                              [&](const Vector3d& p) {
                                const double wide = 5 / std::max(0.2, std::cos(pitch_of(p) * kDegree));
                                for (const double du : {-wide, 0.0, wide}) {
                                  for (const double dv : {-5.0, 0.0, 5.0}) {
                                    if (face_at(bearing_of(p) + du, pitch_of(p) + dv) == face) return true;
                                  }
                                }
                                return false;
                              }))
          << i << ": face " << face;
    }
  }
}

/// Turned and moved before they are sent, as the link does it: what lies a cell inside a face is still there.
TEST_F(ObstaclePoints, AreStillThereAfterATurn) {
  std::uniform_real_distribution<double> turn(-30 * kDegree, 30 * kDegree), way(-0.3, 0.3);
  for (int i = 0; i < 150; ++i) {
    const Pose body = body_at(random_);
    const std::vector<Vector3d> centres{ahead(body), ahead(body), ahead(body)};
    Pose moved = body;
    moved.rotation = body.rotation * Eigen::AngleAxisd(turn(random_), Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(0.3 * turn(random_), Vector3d::UnitY());
    moved.translation += Vector3d(way(random_), way(random_), way(random_));
    auto points = points_of(centres, body);
    for (Vector3d& p : points) p = moved.inverse() * body * p;
    const auto faces = shown_after(points);
    for (const Vector3d& centre : centres) {
      for (const Vector3d& p : surface_of(centre, body)) {
        if (!is_seen(p)) continue;
        const Vector3d flu = moved.inverse() * body * Vector3d(p.x(), -p.y(), -p.z());
        const Vector3d now(flu.x(), -flu.y(), -flu.z());
        if (std::abs(pitch_of(now)) > 40 || now.norm() > 9.5) continue;
        const std::size_t face = face_at(bearing_of(now), pitch_of(now));
        bool inside = true;
        for (const double du : {-7.0, 7.0}) {
          for (const double dv : {-5.0, 5.0})
            inside = inside && face == face_at(bearing_of(now) + du, pitch_of(now) + dv);
        }
        if (inside) {
          EXPECT_LE(faces[face], std::max(now.norm(), 0.3) + kVoxel) << i;
        }
      }
    }
  }
}

TEST_F(ObstaclePoints, AreOfTheImageAndOfTheSlabAlone) {
  Pose body;
  EXPECT_FALSE(points_of({centre_of_voxel({5, 0, 0})}, body).empty());
  EXPECT_TRUE(points_of({centre_of_voxel({-5, 0, 0})}, body).empty()) << "behind";
  EXPECT_TRUE(points_of({centre_of_voxel({2, 5, 0})}, body).empty()) << "beside the image";
  EXPECT_TRUE(points_of({centre_of_voxel({5, 0, 3.6})}, body).empty()) << "above the slab";
  EXPECT_TRUE(points_of({centre_of_voxel({12, 0, 0})}, body).empty()) << "too far";
  EXPECT_TRUE(points_of({}, body).empty());
  // The wall hides what is behind it: the nearest in a direction counts.
  const auto both = points_of({centre_of_voxel({5, 0.1, 0}), centre_of_voxel({8, 0.1, 0})}, body);
  for (const Vector3d& p : both) EXPECT_LT(p.norm(), 6);
}

TEST_F(ObstaclePoints, NearerThanTheLeastAreSentAsTheLeast) {
  SectorOptions options = options_of_points();
  options.min_distance = 1.5;
  const auto points =
      obstacle_points(*view_of({centre_of_voxel({0.8, 0, 0})}), {}, options, camera_of_points(), mounting());
  ASSERT_TRUE(points);
  ArduPilot autopilot;
  autopilot.take(obstacle_messages(*points, 5000, options), 0);
  EXPECT_NEAR(autopilot.shown()[face_at(0, 0)], 1.5, 0.01);
}

/// Where a map ends, nobody may say that nothing is near.
TEST_F(ObstaclePoints, NobodySpeaksForWhatNoMapCanHold) {
  constexpr double kBorder = 32768 * kVoxel;
  const auto view = view_of({centre_of_voxel({5, 0, 0})});
  for (const double sign : {-1.0, 1.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double beyond : {-12.0, -9.0, 0.0, 1.0, 500.0, 1e6, 1e15}) {
        Pose body;
        body.translation[axis] = sign * (kBorder + beyond);
        const double reach = axis == 2 ? 3 : 10;
        const auto points = obstacle_points(*view, body, options_of_points(), camera_of_points(), mounting());
        EXPECT_EQ(points.has_value(), beyond < -reach) << sign << " " << axis << " " << beyond;
      }
    }
  }
}

/// The boundary shows a frame as soon as its messages are there, and nothing of the frame before.
TEST_F(ObstaclePoints, OfAFrameAreShownWithItAndGoWithTheNext) {
  ArduPilot autopilot;
  const SectorOptions options = options_of_points();
  const auto near = points_of({centre_of_voxel({3, 0, 0})}, {});
  const auto far = points_of({centre_of_voxel({7, 0, 0})}, {});
  std::uint32_t stamp = 1000;
  double now = 0;
  for (const double frame : {3.0, 7.0, 3.0, 7.0}) {
    autopilot.take(obstacle_messages(frame < 5 ? near : far, stamp, options), now);
    EXPECT_NEAR(autopilot.shown()[face_at(0, 0)], frame, 0.3);
    stamp += 66;
    now += 66;
  }
  const std::vector<mavlink::ObstacleDistance3d> none = obstacle_messages({}, stamp, options);
  EXPECT_EQ(none.size(), 2U);
  autopilot.take(none, now);
  EXPECT_EQ(autopilot.shown()[face_at(0, 0)], kFar) << "free, and said so";
  EXPECT_GE(autopilot.heard(), now);
}

}  // namespace
}  // namespace pade::live

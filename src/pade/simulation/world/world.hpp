// A world to fly in, as plain data: shapes with materials, light, and the sensors that the world file places.
// Read from SDF (sdf_reader.hpp) or put together in code; made fit for ray casting by Scene (scene.hpp).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/simulation/flight/sensors/imu.hpp"
#include "pade/simulation/world/pattern.hpp"

namespace pade::simulation {

/// Axis-aligned in its own frame, centred at the origin.
struct Box {
  Eigen::Vector3d size = Eigen::Vector3d::Ones();  ///< metres
};
struct Ellipsoid {
  Eigen::Vector3d radii = Eigen::Vector3d::Ones();  ///< metres; three equal numbers are a sphere
};
/// Along z, centred at the origin, closed by two discs.
struct Cylinder {
  double radius = 0.5;  ///< metres
  double length = 1;    ///< metres
};
/// A cylinder along z closed by two half spheres; `length` is without them.
struct Capsule {
  double radius = 0.5;  ///< metres
  double length = 1;    ///< metres
};
/// A flat rectangle centred at the origin, seen from both sides.
struct Rectangle {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  Eigen::Vector2d size = Eigen::Vector2d::Ones();  ///< metres
};
/// Triangles, seen from both sides. Shared between the places where the same mesh stands.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;             ///< metres
  std::vector<Eigen::Vector2d> texture_coordinates;  ///< one per vertex, or empty
  std::vector<std::array<std::uint32_t, 3>> triangles;
};
struct Mesh {
  std::shared_ptr<const TriangleMesh> triangles;
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
};
using Shape = std::variant<Box, Ellipsoid, Cylinder, Capsule, Rectangle, Mesh>;

/// A diffuse surface. The reflectance is `colour` times the image or the pattern.
struct Material {
  Eigen::Vector3d colour = Eigen::Vector3d::Constant(0.7);  ///< linear RGB reflectance, 0 to 1
  /// sRGB image, CV_8UC3 (BGR): once over a face, a rectangle, the side of a cylinder or by texture
  /// coordinates.
  std::shared_ptr<const cv::Mat> image;
  std::string image_file;  ///< for messages
  Pattern pattern;         ///< used if there is no image
};

struct Visual {
  std::string name;
  Pose T_world_shape;
  Shape shape;
  Material material;
  bool casts_shadow = true;
};

/// Light from far away.
struct Sun {
  Eigen::Vector3d direction{-0.5, 0.1, -0.9};               ///< of travel, world; any length
  Eigen::Vector3d colour = Eigen::Vector3d::Constant(0.8);  ///< linear RGB irradiance
  bool casts_shadows = true;
};

/// A camera that the world file mounts on a model.
struct CameraSensor {
  std::string name;
  Camera camera;
  std::optional<bool> colour;             ///< its pixel format; empty: it states none
  double rate = 10;                       ///< frames per second; a flight has its own
  Pose T_body_camera;                     ///< optical camera frame to the frame of its model
  std::optional<double> noise_deviation;  ///< standard deviation of the read noise, fraction of full scale
};

/// An IMU that the world file mounts on a model.
struct ImuSensor {
  std::string name;
  ImuModel model;
  double rate = 200;  ///< Hz
};

struct World {
  std::string name;
  std::vector<Visual> visuals;
  std::optional<Sun> sun;
  Eigen::Vector3d ambient = Eigen::Vector3d::Constant(0.4);       ///< linear RGB, light from all sides
  Eigen::Vector3d background = Eigen::Vector3d(0.55, 0.68, 0.9);  ///< linear RGB where no ray hits
  bool sky = false;  ///< clouds and a pale horizon on the background
  std::vector<CameraSensor> cameras;
  std::vector<ImuSensor> imus;
  std::vector<std::string> warnings;  ///< what the file holds and we cannot show, one sentence each
};

}  // namespace pade::simulation

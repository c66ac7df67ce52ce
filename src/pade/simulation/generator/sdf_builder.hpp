// Writes SDF worlds out of a few kinds of model: what the world generators speak.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include <Eigen/Core>

namespace pade::simulation {

/// Surface of a generated shape: a pattern, its scale and a tint (as people see it, sRGB).
struct Finish {
  std::string_view pattern;  ///< empty = the tint alone
  Eigen::Vector3d tint = Eigen::Vector3d::Ones();
  double scale = 1;
  double contrast = 1;
};

/// A world file with the mesh files that it names.
struct WorldFiles {
  std::string sdf;
  std::map<std::string, std::string> meshes;  ///< file name (below meshes/) and content
};

class SdfBuilder {
 public:
  explicit SdfBuilder(std::string_view world, std::string_view remark);

  void light(const Eigen::Vector3d& direction, double sun, double ambient, bool sky);
  /// Centre, full size, rotation (roll, pitch, yaw), metres and radians.
  void box(const Eigen::Vector3d& centre, const Eigen::Vector3d& size, const Finish& finish,
           const Eigen::Vector3d& rotation = Eigen::Vector3d::Zero());
  void cylinder(const Eigen::Vector3d& centre, double radius, double length, const Finish& finish,
                const Eigen::Vector3d& rotation = Eigen::Vector3d::Zero());
  /// A cylinder between two points.
  void rod(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius, const Finish& finish);
  void sphere(const Eigen::Vector3d& centre, double radius, const Finish& finish);
  void ground(const Eigen::Vector3d& centre, const Eigen::Vector2d& size, const Finish& finish);
  /// A mesh of meshes(), turned about z and scaled.
  void mesh(std::string_view file, const Eigen::Vector3d& position, double yaw, const Eigen::Vector3d& scale,
            const Finish& finish);
  void add_mesh_file(const std::string& name, std::string content) {
    files_.meshes[name] = std::move(content);
  }

  /// Starts a model: what follows belongs to it until the next one.
  void model(std::string_view name);
  [[nodiscard]] WorldFiles finish();

 private:
  void visual(const std::string& geometry, const Eigen::Vector3d& position, const Eigen::Vector3d& rotation,
              const Finish& finish);
  void close_model();

  WorldFiles files_;
  int models_ = 0;
  int visuals_ = 0;
  bool open_ = false;
};

}  // namespace pade::simulation

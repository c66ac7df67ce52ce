// Things that generated worlds are furnished with, from one seeded stream.
#pragma once

#include <cstdint>
#include <string_view>

#include <Eigen/Core>

#include "pade/core/random.hpp"
#include "pade/simulation/generator/mesh_generator.hpp"
#include "pade/simulation/generator/sdf_builder.hpp"

namespace pade::simulation {

/// Finishes of many things: what reflects in a pane, wear on paint, and rust, since nothing outdoors is of
/// one tone.
namespace finish {
inline const Finish glass{"plaster", {0.30, 0.34, 0.38}, 0.8, 2.5};
inline const Finish metal{"concrete", {0.62, 0.63, 0.65}, 0.25, 1.5};
inline const Finish rust{"concrete", {0.52, 0.36, 0.27}, 0.2, 1.5};
inline const Finish dark{"asphalt", {0.6, 0.6, 0.62}, 0.3};
inline const Finish wire{"", {0.12, 0.11, 0.1}};
}  // namespace finish

/// A world in the making: a builder, a stream of random numbers, and furniture. Everything draws from the
/// stream, so that the order of calls decides the world.
class Furniture {
 public:
  /// `remark` says in the file how it was made.
  Furniture(std::string_view world, std::string_view remark, std::uint64_t seed)
      : random_(seed), out_(world, remark) {}

 protected:
  /// The meshes that tree() and stone() use: once, before the first of them.
  void add_tree_meshes(const TreeShape& shape);
  void add_stone_meshes();
  void tree(const Eigen::Vector3d& foot, double scale);
  /// A lamp whose arm reaches `toward_y` from its post.
  void lamp(const Eigen::Vector3d& foot, double height, double toward_y);
  void car(const Eigen::Vector3d& at, double yaw);
  /// Windows on a wall that looks out along -x (side = -1) or +x, or along -y or +y; rows and columns fill
  /// the rectangle.
  void windows_facing_x(double wall_x, double y0, double y1, double z0, double z1, double side);
  void windows_facing_y(double wall_y, double x0, double x1, double z0, double z1, double side);
  /// A house whose front looks toward the street (y = 0).
  void house(double x0, double x1, double front_y, double depth, double height);
  /// A shade of grey from `low` to `high`, a little warm.
  Eigen::Vector3d tint(double low, double high);

  static constexpr int kStones = 3;  ///< different meshes, stone0.obj and so on
  Random random_;
  SdfBuilder out_;
};

}  // namespace pade::simulation

// The world taken apart for ray casting: triangles that lie on flat facets, and quadrics. A facet knows its
// plane in double precision, so that the depth of a hit can be made exact, and its texture coordinates.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "pade/core/result.hpp"
#include "pade/simulation/world/quadric.hpp"
#include "pade/simulation/world/world.hpp"

namespace pade::simulation {

/// Rays and triangles are of single precision, whose steps grow with the distance from the origin of the
/// world: 1 mm at 16 km, 8 mm at 100 km. Nothing is placed farther away than this, in metres.
inline constexpr double farthest_place = 1e5;
/// Beyond this distance from the origin, in metres, depth is no longer exact, and a warning says so.
inline constexpr double farthest_exact_place = 16e3;

/// What to say of a world that has something farther from the origin than farthest_exact_place; empty where
/// all of it is nearer.
std::optional<std::string> precision_warning(const World& world);

/// What a ray hit: a facet's triangle, a quadric, or nothing.
struct Primitive {
  static constexpr std::uint32_t none = 0xffffffff;
  static constexpr std::uint32_t quadric_bit = 0x80000000;
  std::uint32_t id = none;
  [[nodiscard]] bool hit() const { return id != none; }
  [[nodiscard]] bool is_quadric() const { return (id & quadric_bit) != 0; }
  [[nodiscard]] std::uint32_t index() const { return id & ~quadric_bit; }
  bool operator==(const Primitive&) const = default;
};

/// Linear functions (u, v) of the position: g_u . p + u0, g_v . p + v0.
struct TextureFrame {
  Eigen::Vector3f gradient_u = Eigen::Vector3f::Zero();
  Eigen::Vector3f gradient_v = Eigen::Vector3f::Zero();
  float u0 = 0;
  float v0 = 0;
  [[nodiscard]] Eigen::Vector2f at(const Eigen::Vector3f& p) const {
    return {gradient_u.dot(p) + u0, gradient_v.dot(p) + v0};
  }
};

/// A flat piece of surface: the face of a box, a rectangle, or one triangle of a mesh.
struct Facet {
  Eigen::Vector3d normal;  ///< unit, outward where the shape has an outside
  double offset = 0;       ///< normal . p = offset on the facet
  TextureFrame texture;    ///< metres (patterns), or 0 to 1 with v down (images)
  std::int32_t visual = 0;
  std::int32_t occlusion_patch = -1;  ///< index into Geometry::patches; -1 = per vertex
};

/// A rectangle (or the developed side of a quadric) on whose nodes ambient occlusion is kept.
struct OcclusionPatch {
  std::int32_t first_node = 0;
  std::int32_t columns = 2;
  std::int32_t rows = 2;
  std::int32_t quadric = -1;  ///< >= 0: nodes lie on this quadric; columns go around, rows along its axis
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();         ///< of a flat patch, node (0, 0)
  Eigen::Vector3d along_columns = Eigen::Vector3d::Zero();  ///< from one node to the next
  Eigen::Vector3d along_rows = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

struct Geometry {
  std::vector<std::array<float, 3>> vertices;
  std::vector<Eigen::Vector3f>
      vertex_normals;  ///< of meshes: mean of the facets around, any length; else zero
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::size_t shadow_triangles = 0;  ///< the first ones cast a shadow, the rest do not
  std::vector<std::uint32_t> facet_of_triangle;
  std::vector<Facet> facets;
  std::vector<Quadric> quadrics;
  /// What the tree of boxes holds of the quadrics: lengths of them, between two heights along the axis.
  struct QuadricPiece {
    std::uint32_t quadric;
    double from;
    double to;
  };
  std::vector<QuadricPiece> quadric_pieces;
  std::vector<std::int32_t> visual_of_quadric;
  std::vector<bool> quadric_casts_shadow;
  std::vector<std::int32_t> patch_of_quadric;
  std::vector<OcclusionPatch> patches;
  std::int32_t patch_nodes = 0;

  /// Refuses shapes whose size is not a positive number and places beyond farthest_place, naming the visual.
  static Result<Geometry> from(const World& world);
};

}  // namespace pade::simulation

// Where the sun shines, without rays: all shadow rays are parallel, so that on a plane across them a shadow
// is a point in a triangle. Triangles lie in the cells of a grid there, the nearest to the sun first.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "pade/simulation/world/geometry.hpp"

namespace pade::simulation {

class SunMap {
 public:
  /// Keeps a reference to the geometry. `to_sun`: unit, world.
  SunMap(const Geometry& geometry, const Eigen::Vector3d& to_sun);

  enum class Sun : std::uint8_t { shines, hidden, unknown };
  /// Whether a shadow caster lies between `point` and the sun, as rays find it but within rounding of an
  /// outline. Unknown where a quadric or a very large facet may be in the way: a ray has to tell. `surface`:
  /// what the point lies on or just before, on the side of the sun (Scene::surface_id).
  [[nodiscard]] Sun at(const Eigen::Vector3d& point, std::uint32_t surface) const;

 private:
  static constexpr float kNothing = -std::numeric_limits<float>::infinity();
  struct Cell {
    std::uint32_t first = 0;      ///< into `listed_`, up to the next cell's
    float covered = kNothing;     ///< below it one triangle covers all of the cell
    float round = kNothing;       ///< no quadric reaches higher,
    float next_round = kNothing;  ///< nor any but `quadric` that high
    std::uint32_t quadric = Primitive::none;
  };
  /// A triangle across the rays, with the plane of its heights toward the sun; metres.
  struct Shade {
    std::array<float, 3> x;
    std::array<float, 3> y;
    std::array<float, 3> height;  ///< height = [0] x + [1] y + [2]
    float highest;
    std::uint32_t facet;
  };
  /// Part of the plane across the rays, with a height toward the sun; metres.
  struct Patch {
    Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Vector2d high = Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity());
    double height = -std::numeric_limits<double>::infinity();
    void extend(const Eigen::Vector3d& p);
    [[nodiscard]] double size() const { return (high - low).maxCoeff(); }
  };

  [[nodiscard]] static Patch patch_of(const Shade& shade);
  [[nodiscard]] std::vector<Patch> patches_of(const Quadric& quadric) const;
  void project_triangles();
  void lay_out(const Patch& all);
  void list_triangles();
  void add_quadric(const Patch& patch, std::uint32_t quadric);
  [[nodiscard]] Cell& cell(int x, int y);
  template <class Work>
  void over_cells(const Patch& patch, const Work& work);
  template <class Work>
  void over_cells(const Shade& shade, const Work& work);
  [[nodiscard]] bool behind_triangle(const Cell* cell, const Eigen::Vector3f& turned,
                                     std::uint32_t surface) const;

  const Geometry& geometry_;
  Eigen::Vector3d to_sun_;
  Eigen::Matrix3d across_;             ///< rows: two axes across the rays, and toward the sun
  std::vector<std::uint32_t> planes_;  ///< facets too large for the map, each looked at by itself
  Eigen::Vector2d corner_ = Eigen::Vector2d::Zero();
  double cell_size_ = 1;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<Cell> cells_;  ///< and one behind the last
  std::vector<Shade> shades_;
  std::vector<std::uint32_t> listed_;  ///< of `shades_`, by cell, the highest first
};

}  // namespace pade::simulation

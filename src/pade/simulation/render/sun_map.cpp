#include "pade/simulation/render/sun_map.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

namespace pade::simulation {
namespace {

/// By this much quadrics and cells are larger than they are, so that rounding takes nothing away, m.
constexpr double kSlack = 2e-3;
/// Facets that are longer are not drawn: the ground, a horizon, m.
constexpr double kLargest = 40;
constexpr double kMostCells = 1 << 20;
constexpr double kFinest = 0.05;
/// More large facets than that would cost more than rays.
constexpr std::size_t kMostPlanes = 8;
/// What is nearer to the point does not hide it, m.
constexpr float kFrom = 1e-4F;

}  // namespace

void SunMap::Patch::extend(const Eigen::Vector3d& p) {
  low = low.cwiseMin(p.head<2>());
  high = high.cwiseMax(p.head<2>());
  height = std::max(height, p.z());
}

SunMap::SunMap(const Geometry& geometry, const Eigen::Vector3d& to_sun)
    : geometry_(geometry), to_sun_(to_sun.normalized()) {
  across_.row(2) = to_sun_.transpose();
  across_.row(0) = to_sun_.unitOrthogonal().transpose();
  across_.row(1) = to_sun_.cross(Eigen::Vector3d(across_.row(0).transpose())).transpose();
  project_triangles();
  if (planes_.size() > kMostPlanes) return;

  Patch all;
  const auto widen = [&all](const Patch& patch) {
    all.low = all.low.cwiseMin(patch.low);
    all.high = all.high.cwiseMax(patch.high);
  };
  for (const Shade& shade : shades_) widen(patch_of(shade));
  std::vector<std::pair<std::uint32_t, std::vector<Patch>>> quadrics;
  for (std::uint32_t i = 0; i < geometry.quadrics.size(); ++i) {
    if (!geometry.quadric_casts_shadow[i]) continue;
    quadrics.emplace_back(i, patches_of(geometry.quadrics[i]));
    for (const Patch& patch : quadrics.back().second) widen(patch);
  }
  if (!all.low.allFinite()) return;
  lay_out(all);
  list_triangles();
  for (const auto& [quadric, patches] : quadrics) {
    for (const Patch& patch : patches) add_quadric(patch, quadric);
  }
}

/// All that cast a shadow, the highest first; the large ones go to `planes_`.
void SunMap::project_triangles() {
  shades_.reserve(geometry_.shadow_triangles);
  for (std::size_t i = 0; i < geometry_.shadow_triangles; ++i) {
    std::array<Eigen::Vector3d, 3> p;
    Patch bounds;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& vertex = geometry_.vertices[geometry_.triangles[i][k]];
      p[k] = across_ * Eigen::Map<const Eigen::Vector3f>(vertex.data()).cast<double>();
      bounds.extend(p[k]);
    }
    const std::uint32_t facet = geometry_.facet_of_triangle[i];
    if (bounds.size() > kLargest) {
      planes_.push_back(facet);
      continue;
    }
    const Eigen::Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
    if (std::abs(normal.z()) < 1e-6 * normal.norm() || normal.z() == 0) continue;  // seen from its edge
    if (normal.z() < 0) std::swap(p[1], p[2]);  // corners go round to the left
    const Eigen::Vector2d slope = -normal.head<2>() / normal.z();
    Shade shade{};
    for (std::size_t k = 0; k < 3; ++k) {
      shade.x[k] = static_cast<float>(p[k].x());
      shade.y[k] = static_cast<float>(p[k].y());
    }
    shade.height = {static_cast<float>(slope.x()), static_cast<float>(slope.y()),
                    static_cast<float>(p[0].z() - slope.dot(p[0].head<2>()))};
    shade.highest = static_cast<float>(bounds.height);
    shade.facet = facet;
    shades_.push_back(shade);
  }
  std::sort(planes_.begin(), planes_.end());
  planes_.erase(std::unique(planes_.begin(), planes_.end()), planes_.end());
  std::stable_sort(shades_.begin(), shades_.end(),
                   [](const Shade& a, const Shade& b) { return a.highest > b.highest; });
}

SunMap::Patch SunMap::patch_of(const Shade& shade) {
  Patch patch;
  for (std::size_t k = 0; k < 3; ++k)
    patch.extend({static_cast<double>(shade.x[k]), static_cast<double>(shade.y[k]),
                  static_cast<double>(shade.highest)});
  return patch;
}

/// A tube in lengths about as long as it is thick, so that a slanted trunk does not fill the box around it.
std::vector<SunMap::Patch> SunMap::patches_of(const Quadric& quadric) const {
  const Eigen::Vector3d centre = across_ * quadric.T_world_unit.translation();
  const Eigen::Matrix3d axes = across_ * quadric.T_world_unit.linear();
  // How far the unit ball or disc reaches along each axis of the map.
  const bool ball = quadric.kind == Quadric::Kind::sphere;
  const Eigen::Vector3d reach =
      ball ? Eigen::Vector3d(axes.rowwise().norm()) : Eigen::Vector3d(axes.leftCols<2>().rowwise().norm());
  const Eigen::Vector3d axis = axes.col(2);
  constexpr int kMostPieces = 64;
  const double slimness = axis.head<2>().norm() / std::max(reach.head<2>().maxCoeff(), 1e-3);
  const int pieces = ball ? 1 : std::clamp(static_cast<int>(std::ceil(slimness)), 1, kMostPieces);
  std::vector<Patch> patches;
  for (int i = 0; i < pieces; ++i) {
    Patch patch;
    for (const int end : {i, i + 1}) {
      const Eigen::Vector3d p = ball ? centre : Eigen::Vector3d(centre + (2.0 * end / pieces - 1) * axis);
      patch.extend(p - reach);
      patch.extend(p + reach);
    }
    patches.push_back(patch);
  }
  return patches;
}

void SunMap::lay_out(const Patch& all) {
  const Eigen::Vector2d extent = all.high - all.low + Eigen::Vector2d::Constant(4 * kSlack);
  cell_size_ = std::max(kFinest, std::sqrt(extent.prod() / kMostCells));
  corner_ = all.low - Eigen::Vector2d::Constant(2 * kSlack);
  columns_ = static_cast<int>(extent.x() / cell_size_) + 1;
  rows_ = static_cast<int>(extent.y() / cell_size_) + 1;
  cells_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) + 1);
}

SunMap::Cell& SunMap::cell(int x, int y) {
  return cells_[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
                static_cast<std::size_t>(x)];
}

/// Calls work(x, y) for the cells of a patch.
template <class Work>
void SunMap::over_cells(const Patch& patch, const Work& work) {
  const auto index = [this](double at, int axis, int count) {
    return std::clamp(static_cast<int>((at - corner_[axis]) / cell_size_), 0, count - 1);
  };
  const int x1 = index(patch.high.x() + kSlack, 0, columns_);
  const int y1 = index(patch.high.y() + kSlack, 1, rows_);
  for (int y = index(patch.low.y() - kSlack, 1, rows_); y <= y1; ++y) {
    for (int x = index(patch.low.x() - kSlack, 0, columns_); x <= x1; ++x) work(x, y);
  }
}

/// Calls work(cell, centre, covers) for the cells that a triangle touches; `covers`: all of the cell.
template <class Work>
void SunMap::over_cells(const Shade& shade, const Work& work) {
  const double half = 0.5 * cell_size_ + kSlack;
  std::array<Eigen::Vector2d, 3> p;
  std::array<Eigen::Vector2d, 3> inward;
  for (std::size_t k = 0; k < 3; ++k)
    p[k] = {static_cast<double>(shade.x[k]), static_cast<double>(shade.y[k])};
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector2d edge = p[(k + 1) % 3] - p[k];
    inward[k] = {-edge.y(), edge.x()};
  }
  over_cells(patch_of(shade), [&](int x, int y) {
    const Eigen::Vector2d centre = corner_ + cell_size_ * Eigen::Vector2d(x + 0.5, y + 0.5);
    bool covers = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const double inside = inward[k].dot(centre - p[k]);
      const double reach = half * inward[k].cwiseAbs().sum();
      if (inside < -reach) return;
      covers = covers && inside > reach;
    }
    work(cell(x, y), centre, covers);
  });
}

void SunMap::list_triangles() {
  const double half = 0.5 * cell_size_ + kSlack;
  for (const Shade& shade : shades_) {
    over_cells(shade, [&](Cell& cell, const Eigen::Vector2d& centre, bool covers) {
      ++cell.first;  // a count, for now
      if (!covers) return;
      const double slope_x = static_cast<double>(shade.height[0]);
      const double slope_y = static_cast<double>(shade.height[1]);
      const double least = slope_x * centre.x() + slope_y * centre.y() +
                           static_cast<double>(shade.height[2]) -
                           half * (std::abs(slope_x) + std::abs(slope_y)) - kSlack;
      cell.covered = std::max(cell.covered, static_cast<float>(least));
    });
  }
  std::uint32_t sum = 0;
  for (Cell& cell : cells_) cell.first = std::exchange(sum, sum + cell.first);
  listed_.resize(sum);
  std::vector<std::uint32_t> filled(cells_.size(), 0);
  for (std::uint32_t i = 0; i < shades_.size(); ++i) {
    over_cells(shades_[i], [&](const Cell& cell, const Eigen::Vector2d&, bool) {
      listed_[cell.first + filled[static_cast<std::size_t>(&cell - cells_.data())]++] = i;
    });
  }
}

void SunMap::add_quadric(const Patch& patch, std::uint32_t quadric) {
  const auto height = static_cast<float>(patch.height + kSlack);
  over_cells(patch, [&](int x, int y) {
    Cell& here = cell(x, y);
    if (quadric == here.quadric) {
      here.round = std::max(here.round, height);
    } else if (height > here.round) {
      here.next_round = here.round;
      here.round = height;
      here.quadric = quadric;
    } else {
      here.next_round = std::max(here.next_round, height);
    }
  });
}

bool SunMap::behind_triangle(const Cell* cell, const Eigen::Vector3f& turned, std::uint32_t surface) const {
  const float x = turned.x();
  const float y = turned.y();
  const float height = turned.z() + kFrom;
  if (height < cell->covered) return true;
  for (std::uint32_t i = cell->first; i < cell[1].first; ++i) {
    const Shade& shade = shades_[listed_[i]];
    if (shade.highest <= height) return false;
    const auto outside = [&](std::size_t from, std::size_t to) {
      return (shade.x[to] - shade.x[from]) * (y - shade.y[from]) <
             (shade.y[to] - shade.y[from]) * (x - shade.x[from]);
    };
    if (outside(0, 1) || outside(1, 2) || outside(2, 0)) continue;
    if (shade.facet == surface) continue;
    if (shade.height[0] * x + shade.height[1] * y + shade.height[2] > height) return true;
  }
  return false;
}

SunMap::Sun SunMap::at(const Eigen::Vector3d& point, std::uint32_t surface) const {
  if (planes_.size() > kMostPlanes) return Sun::unknown;
  for (const std::uint32_t plane : planes_) {
    if (plane == surface) continue;
    const Facet& facet = geometry_.facets[plane];
    const double toward = facet.normal.dot(to_sun_);
    const double gap = facet.offset - facet.normal.dot(point);
    if (std::abs(gap) < kSlack || gap * toward > 0) return Sun::unknown;
  }
  const Primitive on{surface};
  const bool on_quadric = on.is_quadric() && on.hit();
  if (!cells_.empty()) {
    const Eigen::Vector3d turned = across_ * point;
    const Eigen::Vector2d at = (turned.head<2>() - corner_) / cell_size_;
    if (at.x() >= 0 && at.y() >= 0 && at.x() < columns_ && at.y() < rows_) {
      const Cell* cell = cells_.data() + static_cast<std::ptrdiff_t>(at.y()) * columns_ +
                         static_cast<std::ptrdiff_t>(at.x());
      if (behind_triangle(cell, turned.cast<float>(), surface)) return Sun::hidden;
      const float round = on_quadric && on.index() == cell->quadric ? cell->next_round : cell->round;
      if (round > static_cast<float>(turned.z())) return Sun::unknown;
    }
  }
  // What is flat has no shadow of its own. What is round has, where it turns away from the sun: asked as a
  // ray does, in single precision.
  if (!on_quadric || !geometry_.quadric_casts_shadow[on.index()]) return Sun::shines;
  const Eigen::Vector3d from = point.cast<float>().cast<double>();
  const bool hidden = geometry_.quadrics[on.index()]
                          .intersect(from, to_sun_.cast<float>().cast<double>(), static_cast<double>(kFrom),
                                     std::numeric_limits<double>::infinity())
                          .has_value();
  return hidden ? Sun::hidden : Sun::shines;
}

}  // namespace pade::simulation

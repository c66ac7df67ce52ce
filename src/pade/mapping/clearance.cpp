#include "pade/mapping/clearance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pade/mapping/back_projection.hpp"

namespace pade::mapping {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

/// Z - k sigma per cell, at most the range; NaN where nothing was measured.
std::vector<float> free_ends(const DepthImage& image, const Clearance::Parameters& parameters) {
  const int width = image.depth.cols;
  const int height = image.depth.rows;
  std::vector<float> ends(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), kUnknown);
  for (int v = 0; v < height; ++v) {
    const auto* depth = image.depth.ptr<float>(v);
    const auto* variance = image.variance.empty() ? nullptr : image.variance.ptr<float>(v);
    const auto* state = image.state.empty() ? nullptr : image.state.ptr<std::uint8_t>(v);
    float* end = &ends[static_cast<std::size_t>(v) * static_cast<std::size_t>(width)];
    for (int u = 0; u < width; ++u) {
      if (state != nullptr && state[u] != static_cast<std::uint8_t>(DepthState::measured)) continue;
      const double sigma = variance != nullptr ? std::sqrt(static_cast<double>(variance[u])) : 0.0;
      const double z = depth[u];
      if (!(z > 0) || !(sigma >= 0) || std::isinf(sigma)) continue;
      end[u] = static_cast<float>(std::clamp(z - parameters.margin_sigmas * sigma, 0.0, parameters.range));
    }
  }
  return ends;
}

/// For each cell the nearest end within the 3 x 3 cells around it. `fill_only`: only cells that know nothing
/// are given one, where most of their neighbours know something; the others keep their own.
std::vector<float> nearest_of_neighbours(const std::vector<float>& ends, int width, int height,
                                         bool fill_only) {
  std::vector<float> out = ends;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const std::size_t here =
          static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
      const bool known = !std::isnan(ends[here]);
      if (known == fill_only) continue;
      float nearest = std::numeric_limits<float>::infinity();
      int count = 0;
      for (int y = std::max(v - 1, 0); y <= std::min(v + 1, height - 1); ++y) {
        for (int x = std::max(u - 1, 0); x <= std::min(u + 1, width - 1); ++x) {
          const float end = ends[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                 static_cast<std::size_t>(x)];
          if (std::isnan(end)) continue;
          nearest = std::min(nearest, end);
          ++count;
        }
      }
      if (known || count >= 5) out[here] = nearest;
    }
  }
  return out;
}

}  // namespace

Clearance::Clearance(const DepthImage& image, const Camera& camera, const Pose& T_world_camera,
                     const Parameters& parameters)
    : camera_(camera_of_cells(camera, image.window)),
      parameters_(parameters),
      R_camera_world_(T_world_camera.matrix3().transpose()),
      reach_(0.5 * R_camera_world_.cwiseAbs().rowwise().sum()),
      origin_(T_world_camera.translation) {
  std::vector<float> ends = free_ends(image, parameters);
  const int width = image.depth.cols;
  const int height = image.depth.rows;
  // A window that straddles an edge has a depth between the two surfaces: its neighbours know the nearer one.
  if (image.window > 1) ends = nearest_of_neighbours(ends, width, height, false);
  // Single pixels that failed among others that did not: without this, no large cube would ever be decided at
  // once.
  ends = nearest_of_neighbours(ends, width, height, true);
  build_pyramid(ends, width, height);

  const double left = camera_.cx + 0.5;
  const double right = camera_.width - 0.5 - camera_.cx;
  const double top = camera_.cy + 0.5;
  const double bottom = camera_.height - 0.5 - camera_.cy;
  Eigen::Matrix<double, 4, 3> normals;  // in the camera's frame: inside where normal . point >= 0
  normals << camera_.fx, 0, left, -camera_.fx, 0, right, 0, camera_.fy, top, 0, -camera_.fy, bottom;
  side_normals_ = normals.rowwise().normalized() * R_camera_world_;
  side_reach_ = 0.5 * side_normals_.cwiseAbs().rowwise().sum();
}

void Clearance::build_pyramid(const std::vector<float>& free_end, int width, int height) {
  Level base{width, height, {}};
  base.cells.reserve(free_end.size());
  for (const float end : free_end) {
    base.cells.push_back(std::isnan(end) ? Cell{std::numeric_limits<float>::infinity(), 0, 0}
                                         : Cell{end, end, 1});
  }
  levels_.push_back(std::move(base));
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& fine = levels_.back();
    Level coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
    coarse.cells.assign(static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height),
                        Cell{std::numeric_limits<float>::infinity(), 0, 0});
    for (int v = 0; v < fine.height; ++v) {
      const Cell* from = &fine.cells[static_cast<std::size_t>(v) * static_cast<std::size_t>(fine.width)];
      Cell* to = &coarse.cells[static_cast<std::size_t>(v / 2) * static_cast<std::size_t>(coarse.width)];
      for (int u = 0; u < fine.width; ++u) {
        Cell& cell = to[u / 2];
        cell.nearest = std::min(cell.nearest, from[u].nearest);
        cell.farthest = std::max(cell.farthest, from[u].farthest);
        cell.known += from[u].known;
      }
    }
    levels_.push_back(std::move(coarse));
  }
}

/// Over the pixels u0..u1 x v0..v1, or a few more (whole cells of the level at which they are at most 4 x 4
/// cells).
Clearance::Seen Clearance::over(int u0, int v0, int u1, int v1) const {
  std::size_t level = 0;
  int extent = std::max(u1 - u0, v1 - v0);
  while (extent > 3 && level + 1 < levels_.size()) {
    extent /= 2;
    ++level;
  }
  const Level& pyramid = levels_[level];
  const int shift = static_cast<int>(level);
  Cell sum{std::numeric_limits<float>::infinity(), 0, 0};
  for (int v = v0 >> shift; v <= v1 >> shift; ++v) {
    const Cell* row = &pyramid.cells[static_cast<std::size_t>(v) * static_cast<std::size_t>(pyramid.width)];
    for (int u = u0 >> shift; u <= u1 >> shift; ++u) {
      sum.nearest = std::min(sum.nearest, row[u].nearest);
      sum.farthest = std::max(sum.farthest, row[u].farthest);
      sum.known += row[u].known;
    }
  }
  const auto pixels = [&](int first, int last, int size) {
    return std::min(((last >> shift) + 1) << shift, size) - ((first >> shift) << shift);
  };
  const int total = pixels(u0, u1, levels_[0].width) * pixels(v0, v1, levels_[0].height);
  return {sum.nearest, sum.farthest, static_cast<double>(sum.known) / total};
}

View Clearance::look_at(const Eigen::Vector3d& centre, double side, bool is_voxel) const {
  const Eigen::Vector3d offset = centre - origin_;
  const Eigen::Vector3d p = R_camera_world_ * offset;
  const Eigen::Vector3d half = side * reach_;
  const double z_near = p.z() - half.z();
  const double z_far = p.z() + half.z();
  if (z_far <= 0 || z_near >= parameters_.range) return View::nothing;
  const Eigen::Vector4d inside = side_normals_ * offset;
  if ((inside + side * side_reach_).minCoeff() < 0) return View::nothing;
  const bool whole = (inside - side * side_reach_).minCoeff() >= 0;
  if (is_voxel && inside.minCoeff() < 0) return View::nothing;  // its centre is outside the image
  if (z_near <= 0.02 * z_far) return is_voxel ? View::nothing : View::partly;

  // The pixels of the box around the cube along the camera's axes, which are no fewer than those of the cube.
  const auto pixel = [](double x, double z, double focal, double principal) {
    return std::floor(focal * x / z + principal + 0.5);
  };
  const auto low = [&](double x, double f, double c) { return pixel(x, x < 0 ? z_near : z_far, f, c); };
  const auto high = [&](double x, double f, double c) { return pixel(x, x < 0 ? z_far : z_near, f, c); };
  constexpr double kRounding = 1e-9;
  const Camera& c = camera_;
  const auto clip = [](double value, int size) {
    return static_cast<int>(std::clamp(value, 0.0, size - 1.0));
  };
  const Seen seen = over(clip(low(p.x() - half.x() - kRounding, c.fx, c.cx), c.width),
                         clip(low(p.y() - half.y() - kRounding, c.fy, c.cy), c.height),
                         clip(high(p.x() + half.x() + kRounding, c.fx, c.cx), c.width),
                         clip(high(p.y() + half.y() + kRounding, c.fy, c.cy), c.height));
  if (seen.farthest <= z_near) return View::nothing;
  const bool before_all = seen.nearest > z_far;
  if (is_voxel) return before_all && seen.share >= parameters_.known_share ? View::free : View::nothing;
  return before_all && whole && seen.share >= 1 ? View::free : View::partly;
}

}  // namespace pade::mapping

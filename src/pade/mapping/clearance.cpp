#include "pade/mapping/clearance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pade/mapping/back_projection.hpp"

namespace pade::mapping {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

/// Z - k sigma per cell, at most the range; NaN where nothing was measured.
void free_ends(const DepthImage& image, const Clearance::Parameters& parameters, std::vector<float>& ends) {
  const int width = image.depth.cols;
  const int height = image.depth.rows;
  ends.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), kUnknown);
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
}

/// For each cell the nearest end within the 3 x 3 cells around it. `fill_only`: only cells that know nothing
/// are given one, where most of their neighbours know something; the others keep their own.
void nearest_of_neighbours(std::vector<float>& ends, std::vector<float>& out, int width, int height,
                           bool fill_only) {
  out = ends;
  const auto index = [width](int v, int u) {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
  };
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const bool known = !std::isnan(ends[index(v, u)]);
      if (known == fill_only) continue;
      float nearest = std::numeric_limits<float>::infinity();
      int count = 0;
      for (int y = std::max(v - 1, 0); y <= std::min(v + 1, height - 1); ++y) {
        for (int x = std::max(u - 1, 0); x <= std::min(u + 1, width - 1); ++x) {
          const float end = ends[index(y, x)];
          if (std::isnan(end)) continue;
          nearest = std::min(nearest, end);
          ++count;
        }
      }
      if (known || count >= 5) out[index(v, u)] = nearest;
    }
  }
  ends.swap(out);
}

}  // namespace

void Clearance::set(const DepthImage& image, const Camera& camera, const Pose& T_world_camera,
                    const Parameters& parameters) {
  camera_ = camera_of_cells(camera, image.window);
  parameters_ = parameters;
  R_camera_world_ = T_world_camera.matrix3().transpose();
  origin_ = T_world_camera.translation;
  reach_ = 0.5 * R_camera_world_.cwiseAbs().rowwise().sum();

  const int width = image.depth.cols;
  const int height = image.depth.rows;
  free_ends(image, parameters, ends_);
  // A window that straddles an edge has a depth between the two surfaces: its neighbours know the nearer one.
  if (image.window > 1) nearest_of_neighbours(ends_, scratch_, width, height, false);
  // Single pixels that failed among others that did not: without this, no large cube would ever be decided at
  // once.
  nearest_of_neighbours(ends_, scratch_, width, height, true);
  build_pyramid(width, height);

  Eigen::Matrix<double, 4, 3> normals;                   // inside where normal . point >= 0
  normals << camera_.fx, 0, camera_.cx + 0.5,            //
      -camera_.fx, 0, camera_.width - 0.5 - camera_.cx,  //
      0, camera_.fy, camera_.cy + 0.5,                   //
      0, -camera_.fy, camera_.height - 0.5 - camera_.cy;
  normals.rowwise().normalize();
  side_x_ = normals.col(0);
  side_y_ = normals.col(1);
  side_z_ = normals.col(2);
  side_reach_ = 0.5 * (normals * R_camera_world_).cwiseAbs().rowwise().sum();
}

void Clearance::build_pyramid(int width, int height) {
  constexpr Cell kNothing{std::numeric_limits<float>::infinity(), 0, 0};
  std::size_t count = 1;
  for (int w = width, h = height; w > 1 || h > 1; w = (w + 1) / 2, h = (h + 1) / 2) ++count;
  levels_.resize(count);

  Level& base = levels_[0];
  base.width = width;
  base.height = height;
  base.cells.clear();
  for (const float end : ends_) base.cells.push_back(std::isnan(end) ? kNothing : Cell{end, end, 1});
  for (std::size_t level = 1; level < count; ++level) {
    const Level& fine = levels_[level - 1];
    Level& coarse = levels_[level];
    coarse.width = (fine.width + 1) / 2;
    coarse.height = (fine.height + 1) / 2;
    coarse.cells.assign(static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height),
                        kNothing);
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
  const Eigen::Vector3d half = side * reach_;
  const double z_near = centre.z() - half.z();
  const double z_far = centre.z() + half.z();
  if (z_far <= 0 || z_near >= parameters_.range) return View::nothing;
  const Eigen::Vector4d inside = side_x_ * centre.x() + side_y_ * centre.y() + side_z_ * centre.z();
  if ((inside + side * side_reach_).minCoeff() < 0) return View::nothing;
  if (is_voxel && inside.minCoeff() < 0) return View::nothing;  // its centre is outside the image
  if (z_near <= 0.02 * z_far) return is_voxel ? View::nothing : View::partly;

  // The pixels of the box around the cube along the camera's axes, which are no fewer than those of the cube.
  const double per_near = 1 / z_near;
  const double per_far = 1 / z_far;
  constexpr double kRounding = 1e-9;
  // Not negative after clamp: truncation rounds, in a fraction of the time of lround.
  // NOLINTBEGIN(bugprone-incorrect-roundings)
  const auto first = [&](double x, double f, double c, int size) {
    x -= kRounding;
    return static_cast<int>(std::clamp(f * x * (x < 0 ? per_near : per_far) + c, 0.0, size - 1.0) + 0.5);
  };
  const auto last = [&](double x, double f, double c, int size) {
    x += kRounding;
    return static_cast<int>(std::clamp(f * x * (x < 0 ? per_far : per_near) + c, 0.0, size - 1.0) + 0.5);
  };
  // NOLINTEND(bugprone-incorrect-roundings)
  const Camera& c = camera_;
  const Seen seen = over(
      first(centre.x() - half.x(), c.fx, c.cx, c.width), first(centre.y() - half.y(), c.fy, c.cy, c.height),
      last(centre.x() + half.x(), c.fx, c.cx, c.width), last(centre.y() + half.y(), c.fy, c.cy, c.height));
  if (seen.farthest <= z_near) return View::nothing;
  const bool before_all = seen.nearest > z_far;
  if (is_voxel) return before_all && seen.share >= parameters_.known_share ? View::free : View::nothing;
  const bool whole = (inside - side * side_reach_).minCoeff() >= 0;
  return before_all && whole && seen.share >= 1 ? View::free : View::partly;
}

}  // namespace pade::mapping

#include "mapping/tree/clearance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

#include "pade/mapping/back_projection.hpp"

namespace pade::mapping::tree {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The bound per cell, at most the range, and never behind the depth; NaN where nothing is known.
void bounded_ends(const DepthImage& image, double range, std::vector<float>& ends) {
  const auto farthest = static_cast<float>(range);
  float* end = ends.data();
  for (int v = 0; v < image.depth.rows; ++v) {
    const auto* depth = image.depth.ptr<float>(v);
    const auto* bound = image.bound.ptr<float>(v);
    for (int u = 0; u < image.depth.cols; ++u) {
      const float before = depth[u] < bound[u] ? depth[u] : bound[u];  // NaN where the bound is
      const float within = before > farthest ? farthest : before;
      *end++ = within < 0 ? 0 : within;
    }
  }
}

/// Z - k sigma per cell, at most the range; NaN where nothing was measured.
void measured_ends(const DepthImage& image, const Clearance::Parameters& parameters,
                   std::vector<float>& ends) {
  float* end = ends.data();
  for (int v = 0; v < image.depth.rows; ++v, end += image.depth.cols) {
    const auto* depth = image.depth.ptr<float>(v);
    const auto* variance = image.variance.empty() ? nullptr : image.variance.ptr<float>(v);
    const auto* state = image.state.empty() ? nullptr : image.state.ptr<std::uint8_t>(v);
    for (int u = 0; u < image.depth.cols; ++u) {
      end[u] = kUnknown;
      if (state != nullptr && state[u] != static_cast<std::uint8_t>(DepthState::measured)) continue;
      const double sigma = variance != nullptr ? std::sqrt(static_cast<double>(variance[u])) : 0.0;
      const double z = depth[u];
      if (!(z > 0) || !(sigma >= 0) || std::isinf(sigma)) continue;
      end[u] = static_cast<float>(std::clamp(z - parameters.margin_sigmas * sigma, 0.0, parameters.range));
    }
  }
}

/// For each cell that knows something the nearest end within the 3 x 3 cells around it.
void nearest_of_neighbours(std::vector<float>& ends, std::vector<float>& out, int width, int height) {
  out = ends;
  const auto index = [width](int v, int u) {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
  };
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      if (std::isnan(ends[index(v, u)])) continue;
      float nearest = kInfinity;
      for (int y = std::max(v - 1, 0); y <= std::min(v + 1, height - 1); ++y) {
        for (int x = std::max(u - 1, 0); x <= std::min(u + 1, width - 1); ++x) {
          const float end = ends[index(y, x)];
          if (end < nearest) nearest = end;
        }
      }
      out[index(v, u)] = nearest;
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
  ends_.resize(image.depth.total());
  if (image.bound.empty()) {
    measured_ends(image, parameters, ends_);
  } else {
    bounded_ends(image, parameters.range, ends_);
  }
  // A window that straddles an edge has a depth between the two surfaces: its neighbours know the nearer one.
  if (image.window > 1) nearest_of_neighbours(ends_, scratch_, width, height);
  close_holes(image.depth);
  drop_lone_ends(width, height);
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

std::int32_t Clearance::hole_of(std::int32_t run) {
  while (runs_[static_cast<std::size_t>(run)].hole != run) {
    auto& up = runs_[static_cast<std::size_t>(run)].hole;
    up = runs_[static_cast<std::size_t>(up)].hole;
    run = up;
  }
  return run;
}

/// Rows of cells that end before `end`, each joined to those of the row above that it touches.
void Clearance::find_runs(float end, int width, int height) {
  runs_.clear();
  std::size_t above = 0;  // the first run of the row above that may touch
  for (int v = 0; v < height; ++v) {
    const std::size_t begin = runs_.size();
    const float* row = &ends_[static_cast<std::size_t>(v) * static_cast<std::size_t>(width)];
    for (int u = 0; u < width; ++u) {
      if (row[u] >= end) continue;
      const int first = u;
      while (u < width && !(row[u] >= end)) ++u;
      const auto run = static_cast<std::int32_t>(runs_.size());
      runs_.push_back({v, first, u - 1, run});
      while (above < begin && (runs_[above].row < v - 1 || runs_[above].last + 1 < first)) ++above;
      for (std::size_t i = above; i < begin && runs_[i].first <= u; ++i) {
        const std::int32_t a = hole_of(static_cast<std::int32_t>(i));
        const std::int32_t b = hole_of(run);
        runs_[static_cast<std::size_t>(std::max(a, b))].hole = std::min(a, b);
      }
    }
    above = begin;
  }
}

/// The spots that the runs make up: their extent, and whether one of their cells has measured something
/// before `end`.
void Clearance::find_holes(const cv::Mat& depth, float end) {
  holes_.assign(runs_.size(), {depth.cols, 0, depth.rows, 0, false});
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const Run& run = runs_[i];
    Hole& hole = holes_[static_cast<std::size_t>(hole_of(static_cast<std::int32_t>(i)))];
    const auto* row = depth.ptr<float>(run.row);
    const bool sees = std::any_of(row + run.first, row + run.last + 1, [&](float z) { return z < end; });
    hole = {std::min(hole.left, run.first), std::max(hole.right, run.last), std::min(hole.top, run.row),
            std::max(hole.bottom, run.row), hole.sees_obstacle || sees};
  }
}

/// A spot of n cells hides nothing larger than n Z / f at depth Z. Up to where that is `hole` it counts as
/// free where all cells around it are and none of its own has measured anything there; a spot at the border
/// of the image may go on beyond it.
void Clearance::close_holes(const cv::Mat& depth) {
  constexpr double kNearest = 0.3;  // m: what ends before is not worth the search
  constexpr double kStep = 1.3;     // from size to size
  const int width = depth.cols;
  const int height = depth.rows;
  const double reach = parameters_.hole * std::min(camera_.fx, camera_.fy);
  const double largest_spot = std::max(width, height);
  for (double size = std::min(reach / kNearest, largest_spot); size >= 1; size /= kStep) {
    const auto end = static_cast<float>(std::min(reach / std::floor(size), parameters_.range));
    find_runs(end, width, height);
    find_holes(depth, end);
    const int largest = static_cast<int>(size) - 1;
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      const Run& run = runs_[i];
      const Hole& hole = holes_[static_cast<std::size_t>(hole_of(static_cast<std::int32_t>(i)))];
      const bool closed = hole.left > 0 && hole.top > 0 && hole.right < width - 1 &&
                          hole.bottom < height - 1 && hole.right - hole.left <= largest &&
                          hole.bottom - hole.top <= largest && !hole.sees_obstacle;
      if (!closed) continue;
      float* row = &ends_[static_cast<std::size_t>(run.row) * static_cast<std::size_t>(width)];
      std::fill(row + run.first, row + run.last + 1, end);
    }
  }
  for (float& end : ends_) end = end >= 0 ? end : 0;
}

/// Where every voxel within range covers 3 x 3 cells or more, a far end that no 3 x 3 cells around it share
/// frees none of them. Without these, cubes that hold nothing free are told sooner; the answer for a voxel is
/// the same, for each cell of what it covers lies in 3 x 3 cells of it.
void Clearance::drop_lone_ends(int width, int height) {
  if (parameters_.voxel * std::min(camera_.fx, camera_.fy) < 2 * parameters_.range) return;
  const cv::Mat ends(height, width, CV_32FC1, ends_.data());
  scratch_.resize(ends_.size());
  cv::Mat opened(height, width, CV_32FC1, scratch_.data());
  cv::morphologyEx(ends, opened, cv::MORPH_OPEN, cv::Mat());
  ends_.swap(scratch_);
}

void Clearance::build_pyramid(int width, int height) {
  constexpr Extremes kNothing{kInfinity, 0};
  std::size_t count = 1;
  for (int w = width, h = height; w > 1 || h > 1; w = (w + 1) / 2, h = (h + 1) / 2) ++count;
  levels_.resize(count);

  levels_[0].width = width;
  levels_[0].height = height;
  levels_[0].cells.clear();
  for (const float end : ends_) levels_[0].cells.push_back({end, end});
  for (std::size_t level = 1; level < count; ++level) {
    const Level& fine = levels_[level - 1];
    Level& coarse = levels_[level];
    coarse.width = (fine.width + 1) / 2;
    coarse.height = (fine.height + 1) / 2;
    coarse.cells.assign(static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height),
                        kNothing);
    for (int v = 0; v < fine.height; ++v) {
      const Extremes* from = &fine.cells[static_cast<std::size_t>(v) * static_cast<std::size_t>(fine.width)];
      Extremes* to = &coarse.cells[static_cast<std::size_t>(v / 2) * static_cast<std::size_t>(coarse.width)];
      for (int u = 0; u < fine.width; ++u) {
        Extremes& cell = to[u / 2];
        cell.nearest = std::min(cell.nearest, from[u].nearest);
        cell.farthest = std::max(cell.farthest, from[u].farthest);
      }
    }
  }
}

/// Over the pixels u0..u1 x v0..v1, or a few more (whole cells of the level at which they are at most 4 x 4
/// cells).
Clearance::Extremes Clearance::over(int u0, int v0, int u1, int v1) const {
  std::size_t level = 0;
  int extent = std::max(u1 - u0, v1 - v0);
  while (extent > 3 && level + 1 < levels_.size()) {
    extent /= 2;
    ++level;
  }
  const Level& pyramid = levels_[level];
  const int shift = static_cast<int>(level);
  Extremes both{kInfinity, 0};
  for (int v = v0 >> shift; v <= v1 >> shift; ++v) {
    const Extremes* row =
        &pyramid.cells[static_cast<std::size_t>(v) * static_cast<std::size_t>(pyramid.width)];
    for (int u = u0 >> shift; u <= u1 >> shift; ++u) {
      both.nearest = std::min(both.nearest, row[u].nearest);
      both.farthest = std::max(both.farthest, row[u].farthest);
    }
  }
  return both;
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
  const Extremes seen = over(
      first(centre.x() - half.x(), c.fx, c.cx, c.width), first(centre.y() - half.y(), c.fy, c.cy, c.height),
      last(centre.x() + half.x(), c.fx, c.cx, c.width), last(centre.y() + half.y(), c.fy, c.cy, c.height));
  if (seen.farthest <= z_near) return View::nothing;
  const bool before_all = seen.nearest > z_far;
  if (is_voxel) return before_all ? View::free : View::nothing;
  const bool whole = (inside - side * side_reach_).minCoeff() >= 0;
  return before_all && whole ? View::free : View::partly;
}

}  // namespace pade::mapping::tree

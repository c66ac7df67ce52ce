#include "pade/mapping/clearance.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "pade/mapping/back_projection.hpp"

namespace pade::mapping {
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
  static_assert(static_cast<int>(DepthState::measured) == 0);
  const auto row = PADE_DISPATCH(measured_row, simd::best());
  float* end = ends.data();
  for (int v = 0; v < image.depth.rows; ++v, end += image.depth.cols) {
    row(image.depth.ptr<float>(v), image.variance.empty() ? nullptr : image.variance.ptr<float>(v),
        image.state.empty() ? nullptr : image.state.ptr<std::uint8_t>(v), image.depth.cols,
        parameters.margin_sigmas, parameters.range, end);
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

/// Bit by bit whether a cell has at most this rank. Ranks are below 128.
std::uint64_t low_ranks(const std::uint8_t* ranks, int count, std::uint8_t rank) {
  constexpr std::uint64_t kEach = 0x0101010101010101U;
  std::uint64_t low = 0;
  for (int i = 0; i < count; i += 8) {
    std::uint64_t eight = 127 * kEach;
    std::memcpy(&eight, ranks + i, static_cast<std::size_t>(std::min(8, count - i)));
    const std::uint64_t high_bits = ((128U + rank) * kEach - eight) & 128U * kEach;
    low |= ((high_bits >> 7U) * 0x0102040810204080U >> 56U) << i;
  }
  return low;
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

/// Joins the last run to those of the row above that it touches.
/// @param above  the first run of that row that may touch
/// @param begin  the first run of this row
void Clearance::join_above(std::size_t& above, std::size_t begin) {
  const auto run = static_cast<std::int32_t>(runs_.size() - 1);
  const Run last = runs_.back();
  while (above < begin && (runs_[above].row < last.row - 1 || runs_[above].last + 1 < last.first)) ++above;
  for (std::size_t i = above; i < begin && runs_[i].first <= last.last + 1; ++i) {
    const std::int32_t a = hole_of(static_cast<std::int32_t>(i));
    const std::int32_t b = hole_of(run);
    runs_[static_cast<std::size_t>(std::max(a, b))].hole = std::min(a, b);
  }
}

/// Rows of cells of at most this rank, each joined to those of the row above that it touches.
void Clearance::find_runs(std::uint8_t rank, int width, int height) {
  runs_.clear();
  std::size_t above = 0;
  for (int v = 0; v < height; ++v) {
    const std::size_t begin = runs_.size();
    const std::uint8_t* row = &ranks_[static_cast<std::size_t>(v) * static_cast<std::size_t>(width)];
    int first = -1;  // of the run that goes on
    const auto close = [&](int last) {
      runs_.push_back({v, first, last, static_cast<std::int32_t>(runs_.size())});
      join_above(above, begin);
      first = -1;
    };
    for (int u = 0; u < width; u += 64) {
      const int count = std::min(64, width - u);
      std::uint64_t low = low_ranks(row + u, count, rank);
      if (first < 0 && low == 0) continue;
      const std::uint64_t ends = count == 64 ? 0 : ~std::uint64_t{0} << count;  // of the row
      for (int at = 0; at < count;) {
        const std::uint64_t rest = first < 0 ? low >> at : ~(low | ends) >> at;
        if (first < 0) {
          if (rest == 0) break;
          at += std::countr_zero(rest);
          first = u + at;
        } else {
          if (rest == 0) break;
          at += std::countr_zero(rest);
          close(u + at - 1);
        }
      }
    }
    if (first >= 0) close(width - 1);
    above = begin;
  }
}

/// The spots that the runs make up, by their extent.
void Clearance::find_holes(const cv::Mat& depth) {
  holes_.assign(runs_.size(), {depth.cols, 0, depth.rows, 0, false});
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const Run& run = runs_[i];
    Hole& hole = holes_[static_cast<std::size_t>(hole_of(static_cast<std::int32_t>(i)))];
    hole = {std::min(hole.left, run.first), std::max(hole.right, run.last), std::min(hole.top, run.row),
            std::max(hole.bottom, run.row), false};
  }
}

/// Whether it is small enough, and ends within the image.
bool Clearance::may_close(const Hole& hole, int largest) const {
  return hole.left > 0 && hole.top > 0 && hole.right < camera_.width - 1 &&
         hole.bottom < camera_.height - 1 && hole.right - hole.left <= largest &&
         hole.bottom - hole.top <= largest && !hole.sees_obstacle;
}

/// Marks those of the small spots that have measured something before `end`.
void Clearance::note_obstacles(const cv::Mat& depth, float end, int largest) {
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const Run& run = runs_[i];
    Hole& hole = holes_[static_cast<std::size_t>(hole_of(static_cast<std::int32_t>(i)))];
    if (!may_close(hole, largest)) continue;
    const auto* row = depth.ptr<float>(run.row);
    hole.sees_obstacle = std::any_of(row + run.first, row + run.last + 1, [&](float z) { return z < end; });
  }
}

/// Depths, nearest first, and the extent of the largest spot that is closed up to there, less one.
std::vector<std::pair<float, int>> Clearance::hole_sizes() const {
  constexpr double kNearest = 0.3;  // m: what ends before is not worth the search
  constexpr double kStep = 1.3;     // from size to size
  const double reach = parameters_.hole * std::min(camera_.fx, camera_.fy);
  const double largest_spot = std::max(camera_.width, camera_.height);
  std::vector<std::pair<float, int>> sizes;
  for (double size = std::min(reach / kNearest, largest_spot); size >= 1; size /= kStep) {
    const auto end = static_cast<float>(std::min(reach / std::floor(size), parameters_.range));
    if (sizes.empty() || end > sizes.back().first) sizes.emplace_back(end, static_cast<int>(size) - 1);
  }
  return sizes;
}

/// A spot of n cells hides nothing larger than n Z / f at depth Z. Up to where that is `hole` it counts as
/// free where all cells around it are and none of its own has measured anything there; a spot at the border
/// of the image may go on beyond it.
void Clearance::close_holes(const cv::Mat& depth) {
  const auto sizes = hole_sizes();
  rank_ends(sizes);
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const auto [end, largest] = sizes[k];
    const auto rank = static_cast<std::uint8_t>(k);
    find_runs(rank, depth.cols, depth.rows);
    find_holes(depth);
    note_obstacles(depth, end, largest);
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      const Run& run = runs_[i];
      if (!may_close(holes_[static_cast<std::size_t>(hole_of(static_cast<std::int32_t>(i)))], largest))
        continue;
      const std::size_t first = static_cast<std::size_t>(run.row) * static_cast<std::size_t>(depth.cols) +
                                static_cast<std::size_t>(run.first);
      const auto count = static_cast<std::size_t>(run.last - run.first + 1);
      std::fill_n(ends_.begin() + static_cast<std::ptrdiff_t>(first), count, end);
      std::fill_n(ranks_.begin() + static_cast<std::ptrdiff_t>(first), count,
                  static_cast<std::uint8_t>(rank + 1));
    }
  }
  for (float& end : ends_) end = end >= 0 ? end : 0;
}

/// Of each cell how many of the depths it reaches; NaN reaches none.
void Clearance::rank_ends(const std::vector<std::pair<float, int>>& sizes) {
  std::vector<float> depths;
  for (const auto& size : sizes) depths.push_back(size.first);
  ranks_.resize(ends_.size());
  PADE_DISPATCH(rank_all, simd::best())
  (ends_.data(), static_cast<int>(ends_.size()), depths.data(), static_cast<int>(depths.size()),
   ranks_.data());
}

/// Fills a level from the one below it.
void Clearance::halve(std::size_t index) {
  const Level& fine = levels_[index - 1];
  Level& coarse = levels_[index];
  const auto nearest = PADE_DISPATCH(halve_nearest, simd::best());
  const auto most = PADE_DISPATCH(halve_farthest, simd::best());
  for (int v = 0; v < coarse.height; ++v) {
    const std::ptrdiff_t above = std::ptrdiff_t{2 * v} * fine.stride;
    const std::ptrdiff_t below = std::ptrdiff_t{std::min(2 * v + 1, fine.height - 1)} * fine.stride;
    const std::ptrdiff_t out = std::ptrdiff_t{v} * coarse.stride;
    nearest(fine.nearest.data() + above, fine.nearest.data() + below, fine.width,
            coarse.nearest.data() + out);
    for (std::size_t scale = 0; scale < std::min(index, coarse.farthest.size()); ++scale) {
      const float* from = farthest(index - 1, scale);
      most(from + above, from + below, fine.width, coarse.farthest[scale].data() + out);
    }
  }
}

/// A level of the pyramid of the farthest over the nearest in cells of a scale; not below the level of the
/// scale.
const float* Clearance::farthest(std::size_t level, std::size_t scale) const {
  return level == scale ? levels_[level].nearest.data() : levels_[level].farthest[scale].data();
}

void Clearance::build_pyramid(int width, int height) {
  constexpr int kPadding = 8;
  std::size_t count = 1;
  for (int w = width, h = height; w > 1 || h > 1; w = (w + 1) / 2, h = (h + 1) / 2) ++count;
  levels_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    Level& level = levels_[i];
    level.width = i == 0 ? width : (levels_[i - 1].width + 1) / 2;
    level.height = i == 0 ? height : (levels_[i - 1].height + 1) / 2;
    level.stride = level.width + kPadding;
    const auto cells = static_cast<std::size_t>(level.stride) * static_cast<std::size_t>(level.height);
    level.nearest.resize(cells);
    for (std::size_t scale = 0; scale < std::min(i, level.farthest.size()); ++scale)
      level.farthest[scale].resize(cells);
    if (i > 0) halve(i);
    for (int v = 0; i == 0 && v < height; ++v) {
      std::copy_n(ends_.begin() + static_cast<std::ptrdiff_t>(v) * width, width,
                  level.nearest.begin() + static_cast<std::ptrdiff_t>(v) * level.stride);
    }
  }
}

LookView Clearance::for_voxels(std::vector<EndsLevel>& levels) const {
  levels.clear();
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    EndsLevel& level = levels.emplace_back();
    level.nearest = levels_[i].nearest.data();
    level.stride = levels_[i].stride;
    for (std::size_t scale = 0; scale <= std::min<std::size_t>(i, EndsLevel::kScales - 1); ++scale)
      level.farthest[scale] = farthest(i, scale);
  }
  LookView view{};
  view.f_x = camera_.fx;
  view.f_y = camera_.fy;
  view.c_x = camera_.cx;
  view.c_y = camera_.cy;
  view.width = camera_.width;
  view.height = camera_.height;
  view.range = parameters_.range;
  view.voxel = parameters_.voxel;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
    const Eigen::Vector3d offset = 2 * parameters_.voxel * (0.25 * R_camera_world_ * corner);
    for (int axis = 0; axis < 3; ++axis) view.offsets[8 * axis + i] = offset[axis];
  }
  for (int axis = 0; axis < 3; ++axis) view.reach[axis] = reach_[axis];
  for (int i = 0; i < 4; ++i) {
    view.sides[i][0] = side_x_[i];
    view.sides[i][1] = side_y_[i];
    view.sides[i][2] = side_z_[i];
    view.side_reach[i] = side_reach_[i];
  }
  view.levels = levels.data();
  view.level_count = static_cast<int>(levels.size());
  return view;
}

}  // namespace pade::mapping

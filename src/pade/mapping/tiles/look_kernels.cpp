#include "pade/mapping/tiles/look_kernels.hpp"

namespace pade::mapping::PADE_ISA {
namespace {

constexpr int kRow = 8;  // voxels at once

/// The pixels that eight voxels cover, and where they end.
struct Rows {
  int first_u[kRow], last_u[kRow], first_v[kRow], last_v[kRow];  // NOLINT(*-avoid-c-arrays)
  double z_far[kRow];                                            // NOLINT(*-avoid-c-arrays)
  int is_seen[kRow];                                             // NOLINT(*-avoid-c-arrays)
};

[[gnu::always_inline]] inline double clamped(double value, double most) {
  value = value < 0 ? 0 : value;
  return value > most ? most : value;
}

struct Cube {
  double x, y, z;            // centre
  double half_x, half_y;     // half extents
  double per_near, per_far;  // 1 / Z of its ends
};

/// The arithmetic of Clearance::look_at().
[[gnu::always_inline]] inline void set_pixels(const LookView& view, const Cube& cube, int i, Rows& out) {
  constexpr double kRounding = 1e-9;
  const double most_u = view.width - 1.0;
  const double most_v = view.height - 1.0;
  const double left = cube.x - cube.half_x - kRounding;
  const double right = cube.x + cube.half_x + kRounding;
  const double top = cube.y - cube.half_y - kRounding;
  const double bottom = cube.y + cube.half_y + kRounding;
  const double u0 = clamped(view.f_x * left * (left < 0 ? cube.per_near : cube.per_far) + view.c_x, most_u);
  const double u1 = clamped(view.f_x * right * (right < 0 ? cube.per_far : cube.per_near) + view.c_x, most_u);
  const double v0 = clamped(view.f_y * top * (top < 0 ? cube.per_near : cube.per_far) + view.c_y, most_v);
  const double v1 =
      clamped(view.f_y * bottom * (bottom < 0 ? cube.per_far : cube.per_near) + view.c_y, most_v);
  out.first_u[i] = static_cast<int>(u0 + 0.5);
  out.last_u[i] = static_cast<int>(u1 + 0.5);
  out.first_v[i] = static_cast<int>(v0 + 0.5);
  out.last_v[i] = static_cast<int>(v1 + 0.5);
}

[[gnu::always_inline]] inline double along(const LookView& view, int side, double x, double y, double z) {
  return view.sides[side][0] * x + view.sides[side][1] * y + view.sides[side][2] * z;
}

[[gnu::always_inline]] inline void project(const LookView& view, const double* x, const double* y,
                                           const double* z, Rows& out) {
  const double half_x = view.voxel * view.reach[0];
  const double half_y = view.voxel * view.reach[1];
  const double half_z = view.voxel * view.reach[2];
  for (int i = 0; i < kRow; ++i) {
    const double z_near = z[i] - half_z;
    const double z_far = z[i] + half_z;
    const int is_inside = (along(view, 0, x[i], y[i], z[i]) >= 0) & (along(view, 1, x[i], y[i], z[i]) >= 0) &
                          (along(view, 2, x[i], y[i], z[i]) >= 0) & (along(view, 3, x[i], y[i], z[i]) >= 0);
    out.is_seen[i] = is_inside & (z_far > 0) & (z_near < view.range) & (z_near > 0.02 * z_far);
    out.z_far[i] = z_far;
    const double per_near = 1 / (out.is_seen[i] != 0 ? z_near : 1);
    const double per_far = 1 / (out.is_seen[i] != 0 ? z_far : 1);
    set_pixels(view, {x[i], y[i], z[i], half_x, half_y, per_near, per_far}, i, out);
  }
}

using Eight [[gnu::vector_size(4 * kRow)]] = float;

/// Nothing is added to the first i cells, so that the others are never the nearest.
constexpr float kFar = __builtin_inff();
constexpr Eight kBeyond[kRow] = {
    // NOLINT(*-avoid-c-arrays)
    {0, 0, 0, 0, 0, 0, 0, 0},
    {0, kFar, kFar, kFar, kFar, kFar, kFar, kFar},
    {0, 0, kFar, kFar, kFar, kFar, kFar, kFar},
    {0, 0, 0, kFar, kFar, kFar, kFar, kFar},
    {0, 0, 0, 0, kFar, kFar, kFar, kFar},
    {0, 0, 0, 0, 0, kFar, kFar, kFar},
    {0, 0, 0, 0, 0, 0, kFar, kFar},
    {0, 0, 0, 0, 0, 0, 0, kFar},
};

/// Cells of a level that hold the pixels of a cube, and a few more: Clearance::over().
struct Cells {
  const float* first;
  int stride, columns, rows;
};

[[gnu::always_inline]] inline int level_of(const LookView& view, const Rows& pixels, int i) {
  const int columns = pixels.last_u[i] - pixels.first_u[i];
  const int rows = pixels.last_v[i] - pixels.first_v[i];
  int level = 0;
  for (int extent = columns > rows ? columns : rows; extent > 3 && level + 1 < view.level_count; extent /= 2)
    ++level;
  return level;
}

[[gnu::always_inline]] inline Cells cells_of(const float* cells, int stride, int level, const Rows& pixels,
                                             int i) {
  const int u = pixels.first_u[i] >> level;
  const int v = pixels.first_v[i] >> level;
  return {cells + v * stride + u, stride, (pixels.last_u[i] >> level) - u + 1,
          (pixels.last_v[i] >> level) - v + 1};
}

[[gnu::always_inline]] inline Cells nearest_cells(const LookView& view, const Rows& pixels, int i) {
  const int level = level_of(view, pixels, i);
  const EndsLevel& ends = view.levels[level];
  return cells_of(ends.nearest, ends.stride, level, pixels, i);
}

/// Of the scale that each voxel of a cube holds all of a cell of.
[[gnu::always_inline]] inline Cells farthest_cells(const LookView& view, const Rows& pixels, int i) {
  const double focal = view.f_x < view.f_y ? view.f_x : view.f_y;
  const bool is_cut = pixels.first_u[i] == 0 || pixels.first_v[i] == 0 ||
                      pixels.last_u[i] == view.width - 1 || pixels.last_v[i] == view.height - 1;
  const double covered = focal * view.voxel / pixels.z_far[i] * (is_cut ? 0.5 : 1.0);
  int scale = scale_of(covered);
  if (scale > view.level_count - 1) scale = view.level_count - 1;
  int level = level_of(view, pixels, i);
  if (level < scale) level = scale;
  const EndsLevel& ends = view.levels[level];
  return cells_of(ends.farthest[scale], ends.stride, level, pixels, i);
}

/// Nearest of the cells: of at most five columns.
[[gnu::always_inline]] inline float nearest_of(const Cells& cells) {
  Eight least;
  __builtin_memcpy(&least, cells.first, sizeof least);
  for (int v = 1; v < cells.rows; ++v) {
    Eight next;
    __builtin_memcpy(&next, cells.first + v * cells.stride, sizeof next);
    least = next < least ? next : least;
  }
  least += kBeyond[cells.columns];
  float nearest = least[0];
  for (int k = 1; k < 5; ++k) nearest = least[k] < nearest ? least[k] : nearest;
  return nearest;
}

[[gnu::always_inline]] inline float farthest_of(const Cells& cells) {
  Eight most;
  __builtin_memcpy(&most, cells.first, sizeof most);
  for (int v = 1; v < cells.rows; ++v) {
    Eight next;
    __builtin_memcpy(&next, cells.first + v * cells.stride, sizeof next);
    most = next > most ? next : most;
  }
  most -= kBeyond[cells.columns];
  float farthest = most[0];
  for (int k = 1; k < 5; ++k) farthest = most[k] > farthest ? most[k] : farthest;
  return farthest;
}

}  // namespace

void place_voxels(const double* corners, const double* offsets, VoxelCentres& out) {
  for (int j = 0; j < 8; ++j) {
    for (int k = 0; k < 8; ++k) {
      out.x[8 * j + k] = corners[3 * j] + offsets[k];
      out.y[8 * j + k] = corners[3 * j + 1] + offsets[8 + k];
      out.z[8 * j + k] = corners[3 * j + 2] + offsets[16 + k];
    }
  }
}

void move_voxels(const LookMotion& motion, const VoxelCentres& from, VoxelCentres& out) {
  const double* r = motion.r;
  for (int i = 0; i < 64; ++i) {
    const double x = from.x[i];
    const double y = from.y[i];
    const double z = from.z[i];
    out.x[i] = r[0] * x + r[1] * y + r[2] * z + motion.t[0];
    out.y[i] = r[3] * x + r[4] * y + r[5] * z + motion.t[1];
    out.z[i] = r[6] * x + r[7] * y + r[8] * z + motion.t[2];
  }
}

void move_corners(const LookMotion& motion, const double* from, double* out) {
  const double* r = motion.r;
  for (int j = 0; j < 8; ++j) {
    const double* p = from + 3 * j;
    for (int row = 0; row < 3; ++row)
      out[3 * j + row] = r[3 * row] * p[0] + r[3 * row + 1] * p[1] + r[3 * row + 2] * p[2] + motion.t[row];
  }
}

void look_at_eight(const LookView& view, const double* corners, unsigned* free, unsigned* nothing) {
  const double side = 2 * view.voxel;
  Rows pixels;
  double z_nears[kRow];  // NOLINT(*-avoid-c-arrays)
  int is_whole[kRow];    // NOLINT(*-avoid-c-arrays)
  int is_out[kRow];      // NOLINT(*-avoid-c-arrays)
  for (int i = 0; i < kRow; ++i) {
    const double x = corners[3 * i];
    const double y = corners[3 * i + 1];
    const double z = corners[3 * i + 2];
    const double z_near = z - side * view.reach[2];
    const double z_far = z + side * view.reach[2];
    int is_beyond = (z_far <= 0) | (z_near >= view.range);
    int is_inside = 1;
    for (int k = 0; k < 4; ++k) {
      const double inside = along(view, k, x, y, z);
      is_beyond |= inside + side * view.side_reach[k] < 0;
      is_inside &= inside - side * view.side_reach[k] >= 0;
    }
    is_out[i] = is_beyond;
    is_whole[i] = is_inside;
    pixels.is_seen[i] = (1 - is_beyond) & (z_near > 0.02 * z_far);
    pixels.z_far[i] = z_far;
    z_nears[i] = z_near;
    const double per_near = 1 / (pixels.is_seen[i] != 0 ? z_near : 1);
    const double per_far = 1 / (pixels.is_seen[i] != 0 ? z_far : 1);
    set_pixels(view, {x, y, z, side * view.reach[0], side * view.reach[1], per_near, per_far}, i, pixels);
  }
  unsigned all = 0;
  unsigned none = 0;
  Cells near_cells[kRow];  // NOLINT(*-avoid-c-arrays)
  Cells far_cells[kRow];   // NOLINT(*-avoid-c-arrays)
  for (int i = 0; i < kRow; ++i) {
    if (pixels.is_seen[i] == 0) continue;
    near_cells[i] = nearest_cells(view, pixels, i);
    far_cells[i] = farthest_cells(view, pixels, i);
  }
  for (int i = 0; i < kRow; ++i) {
    const unsigned bit = 1U << i;
    if (is_out[i] != 0) none |= bit;
    if (pixels.is_seen[i] == 0) continue;
    if (farthest_of(far_cells[i]) <= z_nears[i]) {
      none |= bit;
    } else if (is_whole[i] != 0 && nearest_of(near_cells[i]) > pixels.z_far[i]) {
      all |= bit;
    }
  }
  *free = all;
  *nothing = none;
}

std::uint64_t free_voxels(const LookView& view, const VoxelCentres& centres, std::uint64_t asked) {
  std::uint64_t free = 0;
  for (int j = 0; j < 8; ++j) {
    const auto eight = static_cast<unsigned>(asked >> (8 * j) & 255U);
    if (eight == 0) continue;
    Rows rows;
    project(view, centres.x + 8 * j, centres.y + 8 * j, centres.z + 8 * j, rows);
    // All cells are asked for before the first is looked at: they are spread over more memory than is near.
    Cells cells[kRow];  // NOLINT(*-avoid-c-arrays)
    unsigned seen = 0;
    for (unsigned rest = eight; rest != 0; rest &= rest - 1) {
      const int i = __builtin_ctz(rest);
      if (rows.is_seen[i] == 0) continue;
      seen |= 1U << i;
      cells[i] = nearest_cells(view, rows, i);
      __builtin_prefetch(cells[i].first);
    }
    for (; seen != 0; seen &= seen - 1) {
      const int i = __builtin_ctz(seen);
      if (cells[i].first[0] > rows.z_far[i] && nearest_of(cells[i]) > rows.z_far[i])
        free |= std::uint64_t{1} << (8 * j + i);
    }
  }
  return free;
}

void measured_row(const float* depth, const float* variance, const unsigned char* state, int count,
                  double margin_sigmas, double range, float* ends) {
  constexpr double kInfinity = __builtin_inf();
  for (int u = 0; u < count; ++u) {
    const double z = depth[u];
    const double sigma = variance != nullptr ? __builtin_sqrt(static_cast<double>(variance[u])) : 0.0;
    const bool is_measured = state == nullptr || state[u] == 0;
    const double end = clamped(z - margin_sigmas * sigma, range);
    ends[u] = is_measured & (z > 0) & (sigma >= 0) & (sigma < kInfinity) ? static_cast<float>(end)
                                                                         : __builtin_nanf("");
  }
}

void rank_all(const float* values, int count, const float* depths, int depth_count, unsigned char* ranks) {
  constexpr int kBlock = 64;
  for (int i = 0; i < count; i += kBlock) {
    const int n = count - i < kBlock ? count - i : kBlock;
    int reached[kBlock] = {};  // NOLINT(*-avoid-c-arrays)
    float block[kBlock] = {};  // NOLINT(*-avoid-c-arrays)
    for (int k = 0; k < n; ++k) block[k] = values[i + k];
    for (int d = 0; d < depth_count; ++d) {
      const float depth = depths[d];
      for (int k = 0; k < kBlock; ++k) reached[k] += block[k] >= depth ? 1 : 0;
    }
    for (int k = 0; k < n; ++k) ranks[i + k] = static_cast<unsigned char>(reached[k]);
  }
}

void halve_nearest(const float* a, const float* b, int width, float* out) {
  const auto least = [](float x, float y) { return y < x ? y : x; };
  for (int u = 0; u < width / 2; ++u)
    out[u] = least(least(a[2 * u], a[2 * u + 1]), least(b[2 * u], b[2 * u + 1]));
  if (width % 2 != 0) out[width / 2] = least(a[width - 1], b[width - 1]);
}

void halve_farthest(const float* a, const float* b, int width, float* out) {
  const auto most = [](float x, float y) { return y > x ? y : x; };
  for (int u = 0; u < width / 2; ++u)
    out[u] = most(most(a[2 * u], a[2 * u + 1]), most(b[2 * u], b[2 * u + 1]));
  if (width % 2 != 0) out[width / 2] = most(a[width - 1], b[width - 1]);
}

void usable_depths(const DepthRow& row, double farthest, double limit, double spread, double* z,
                   int* uncertain, int* to_spread) {
  int fails = 0;
  int spreads = 0;
  for (int u = 0; u < row.count; ++u) {
    const double depth = row.depth[u];
    const bool is_near = (depth > 0) & (depth <= farthest) & (row.state == nullptr || row.state[u] == 0);
    const bool is_certain = row.variance == nullptr || row.variance[u] <= limit * depth * depth;
    const bool is_usable = is_near & is_certain;
    fails += is_near & !is_certain;
    spreads += is_usable & (row.own_variance != nullptr && row.own_variance[u] > spread);
    z[u] = is_usable ? depth : __builtin_nan("");
  }
  *uncertain = fails;
  *to_spread = spreads;
}

void place_row(const PixelRays& rays, const double* z, int count, std::uint64_t* keys) {
  constexpr double kCentre = 32768;
  constexpr double kAll = 65536;
  for (int u = 0; u < count; ++u) {
    const bool is_point = z[u] == z[u];
    double index[3];  // NOLINT(*-avoid-c-arrays)
    for (int axis = 0; axis < 3; ++axis) {
      index[axis] =
          rays.per_voxel * (rays.origin[axis] + z[u] * (rays.start[axis] + u * rays.step[axis])) + kCentre;
    }
    const bool is_inside = (index[0] >= 0) & (index[0] < kAll) & (index[1] >= 0) & (index[1] < kAll) &
                           (index[2] >= 0) & (index[2] < kAll);
    const std::uint64_t x = static_cast<std::uint32_t>(static_cast<int>(is_inside ? index[0] : 0));
    const std::uint64_t y = static_cast<std::uint32_t>(static_cast<int>(is_inside ? index[1] : 0));
    const std::uint64_t w = static_cast<std::uint32_t>(static_cast<int>(is_inside ? index[2] : 0));
    keys[u] = is_inside ? x | y << 16 | w << 32 : is_point ? kPointOutside : kNoPoint;
  }
}

}  // namespace pade::mapping::PADE_ISA

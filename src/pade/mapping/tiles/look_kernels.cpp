#include "pade/mapping/tiles/look_kernels.hpp"

namespace pade::mapping::PADE_ISA {
namespace {

constexpr int kRow = 8;  // voxels at once

/// The pixels that eight cubes cover, and where they end.
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

/// The pixels of the box around a cube along the axes of the camera, which are no fewer than those of the
/// cube.
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

template <bool kInside>
[[gnu::always_inline]] inline void project(const LookView& view, const double* centre, Rows& out) {
  const double half_x = view.voxel * view.reach[0];
  const double half_y = view.voxel * view.reach[1];
  const double half_z = view.voxel * view.reach[2];
  for (int i = 0; i < kRow; ++i) {
    const double x = centre[0] + view.offsets[i];
    const double y = centre[kRow] + view.offsets[kRow + i];
    const double z = centre[2 * kRow] + view.offsets[2 * kRow + i];
    const double z_near = z - half_z;
    const double z_far = z + half_z;
    int is_inside = 1;
    for (int side = 0; side < (kInside ? 0 : 4); ++side) is_inside &= along(view, side, x, y, z) >= 0 ? 1 : 0;
    out.is_seen[i] = is_inside & (z_far > 0) & (z_near < view.range) & (z_near > 0.02 * z_far);
    out.z_far[i] = z_far;
    const double per_near = 1 / (out.is_seen[i] != 0 ? z_near : 1);
    const double per_far = 1 / (out.is_seen[i] != 0 ? z_far : 1);
    set_pixels(view, {x, y, z, half_x, half_y, per_near, per_far}, i, out);
  }
}

using Eight [[gnu::vector_size(4 * kRow)]] = float;

/// Nothing is added to the first i cells, so that the others are never the nearest.
constexpr float kFar = __builtin_inff();
constexpr Eight kBeyond[kRow + 1] = {
    // NOLINT(*-avoid-c-arrays)
    {kFar, kFar, kFar, kFar, kFar, kFar, kFar, kFar},
    {0, kFar, kFar, kFar, kFar, kFar, kFar, kFar},
    {0, 0, kFar, kFar, kFar, kFar, kFar, kFar},
    {0, 0, 0, kFar, kFar, kFar, kFar, kFar},
    {0, 0, 0, 0, kFar, kFar, kFar, kFar},
    {0, 0, 0, 0, 0, kFar, kFar, kFar},
    {0, 0, 0, 0, 0, 0, kFar, kFar},
    {0, 0, 0, 0, 0, 0, 0, kFar},
    {0, 0, 0, 0, 0, 0, 0, 0},
};

using Ints [[gnu::vector_size(4 * kRow)]] = int;

[[gnu::always_inline]] inline void read(const int* from, Ints& all) {
  __builtin_memcpy(&all, from, sizeof all);
}

/// Cells of a level of eight cubes: whole ones that hold their pixels, and a few more.
struct Cells {
  Ints level, u, v, columns, rows;
};

/// The pixels that eight cubes cover.
struct Extents {
  Ints first_u, last_u, first_v, last_v;
  /// At which the pixels of a cube are at most 4 x 4 cells and an edge.
  Ints level;
};

[[gnu::always_inline]] inline void set_extents(const LookView& view, const Rows& pixels, Extents& all) {
  read(pixels.first_u, all.first_u);
  read(pixels.last_u, all.last_u);
  read(pixels.first_v, all.first_v);
  read(pixels.last_v, all.last_v);
  const Ints columns = all.last_u - all.first_u;
  const Ints rows = all.last_v - all.first_v;
  const Eight extent = __builtin_convertvector(columns > rows ? columns : rows, Eight);
  // The exponent of the extent less one: how often it is halved until it is below four.
  Ints bits;
  __builtin_memcpy(&bits, &extent, sizeof bits);
  const Ints level = (bits >> 23) - 128;
  const Ints most = Ints{} + (view.level_count - 1);
  all.level = level < 0 ? Ints{} : level > most ? most : level;
}

[[gnu::always_inline]] inline void set_cells(const Extents& pixels, const Ints& level, Cells& out) {
  out.level = level;
  out.u = pixels.first_u >> level;
  out.v = pixels.first_v >> level;
  out.columns = (pixels.last_u >> level) - out.u + 1;
  out.rows = (pixels.last_v >> level) - out.v + 1;
}

/// The farthest of the nearest in cells of a scale: a voxel that covers three pixels along each axis holds
/// all of a cell of 2 x 2, and where the nearest of each such cell lies before it, it is not free. At most
/// eight columns and rows.
[[gnu::always_inline]] inline void set_farthest(const LookView& view, const Rows& rows, const Extents& pixels,
                                                Ints& scale, Cells& out) {
  const double focal = view.f_x < view.f_y ? view.f_x : view.f_y;
  int wanted[kRow];  // NOLINT(*-avoid-c-arrays)
  for (int i = 0; i < kRow; ++i) {
    const int is_cut = (rows.first_u[i] == 0) | (rows.first_v[i] == 0) | (rows.last_u[i] == view.width - 1) |
                       (rows.last_v[i] == view.height - 1);
    const double covered = focal * view.voxel / rows.z_far[i] * (is_cut != 0 ? 0.5 : 1.0);
    wanted[i] = (covered >= 3 ? 1 : 0) + (covered >= 7 ? 1 : 0) + (covered >= 15 ? 1 : 0);
  }
  const Ints most = Ints{} + (view.level_count - 1);
  read(wanted, scale);
  scale = scale > most ? most : scale;
  const Ints fine = pixels.level > 0 ? pixels.level - 1 : pixels.level;
  set_cells(pixels, fine, out);
  const Ints level = ((out.columns > kRow) | (out.rows > kRow)) ? pixels.level : fine;
  set_cells(pixels, level < scale ? scale : level, out);
}

/// Nearest of a few rows of cells: of at most eight columns.
[[gnu::always_inline]] inline float nearest_of(const float* cells, int stride, int columns, int rows) {
  Eight least;
  __builtin_memcpy(&least, cells, sizeof least);
  for (int v = 1; v < rows; ++v) {
    Eight next;
    __builtin_memcpy(&next, cells + v * stride, sizeof next);
    least = next < least ? next : least;
  }
  least += kBeyond[columns];
  Eight other = __builtin_shufflevector(least, least, 4, 5, 6, 7, 0, 1, 2, 3);
  least = other < least ? other : least;
  other = __builtin_shufflevector(least, least, 2, 3, 0, 1, 6, 7, 4, 5);
  least = other < least ? other : least;
  return least[0] < least[1] ? least[0] : least[1];
}

[[gnu::always_inline]] inline float farthest_of(const float* cells, int stride, int columns, int rows) {
  Eight most;
  __builtin_memcpy(&most, cells, sizeof most);
  for (int v = 1; v < rows; ++v) {
    Eight next;
    __builtin_memcpy(&next, cells + v * stride, sizeof next);
    most = next > most ? next : most;
  }
  most -= kBeyond[columns];
  Eight other = __builtin_shufflevector(most, most, 4, 5, 6, 7, 0, 1, 2, 3);
  most = other > most ? other : most;
  other = __builtin_shufflevector(most, most, 2, 3, 0, 1, 6, 7, 4, 5);
  most = other > most ? other : most;
  return most[0] > most[1] ? most[0] : most[1];
}

template <bool kInside>
[[gnu::always_inline]] inline unsigned free_of_eight(const LookView& view, const double* centre,
                                                     unsigned asked) {
  Rows rows;
  project<kInside>(view, centre, rows);
  Extents pixels;
  Cells cells;
  set_extents(view, rows, pixels);
  set_cells(pixels, pixels.level, cells);
  // All cells are asked for before the first is looked at: they are spread over more memory than is near.
  const float* first[kRow];  // NOLINT(*-avoid-c-arrays)
  unsigned seen = 0;
  for (unsigned rest = asked; rest != 0; rest &= rest - 1) {
    const int i = __builtin_ctz(rest);
    if (rows.is_seen[i] == 0) continue;
    seen |= 1U << i;
    const EndsLevel& ends = view.levels[cells.level[i]];
    first[i] = ends.nearest + cells.v[i] * ends.stride + cells.u[i];
    __builtin_prefetch(first[i]);
  }
  unsigned free = 0;
  for (; seen != 0; seen &= seen - 1) {
    const int i = __builtin_ctz(seen);
    if (!(first[i][0] > rows.z_far[i])) continue;
    const int stride = view.levels[cells.level[i]].stride;
    if (nearest_of(first[i], stride, cells.columns[i], cells.rows[i]) > rows.z_far[i]) free |= 1U << i;
  }
  return free;
}

}  // namespace

void move_eight(const LookMotion& motion, const double* from, double* out) {
  for (int row = 0; row < 3; ++row) {
    const double* r = motion.r + 3 * row;
    for (int j = 0; j < kRow; ++j)
      out[kRow * row + j] =
          r[0] * from[j] + r[1] * from[kRow + j] + r[2] * from[2 * kRow + j] + motion.t[row];
  }
}

Eighths look_at_eight(const LookView& view, const double* centres, double side, unsigned wanted) {
  Rows pixels;
  double z_nears[kRow];  // NOLINT(*-avoid-c-arrays)
  int is_whole[kRow];    // NOLINT(*-avoid-c-arrays)
  int is_out[kRow];      // NOLINT(*-avoid-c-arrays)
  for (int i = 0; i < kRow; ++i) {
    const double x = centres[i];
    const double y = centres[kRow + i];
    const double z = centres[2 * kRow + i];
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
  Extents extents;
  Cells near_cells;
  Cells far_cells;
  Ints scales;
  set_extents(view, pixels, extents);
  set_cells(extents, extents.level, near_cells);
  set_farthest(view, pixels, extents, scales, far_cells);
  Eighths out{0, 0, 0};
  for (; wanted != 0; wanted &= wanted - 1) {
    const int i = __builtin_ctz(wanted);
    const unsigned bit = 1U << i;
    if (is_out[i] != 0) out.nothing |= bit;
    if (is_whole[i] != 0) out.inside |= bit;
    if (pixels.is_seen[i] == 0) continue;
    const EndsLevel& far = view.levels[far_cells.level[i]];
    const float* farthest = far.farthest[scales[i]] + far_cells.v[i] * far.stride + far_cells.u[i];
    if (farthest[0] <= z_nears[i] &&
        farthest_of(farthest, far.stride, far_cells.columns[i], far_cells.rows[i]) <= z_nears[i]) {
      out.nothing |= bit;
      continue;
    }
    if (is_whole[i] == 0) continue;
    const EndsLevel& near = view.levels[near_cells.level[i]];
    const float* nearest = near.nearest + near_cells.v[i] * near.stride + near_cells.u[i];
    if (nearest[0] > pixels.z_far[i] &&
        nearest_of(nearest, near.stride, near_cells.columns[i], near_cells.rows[i]) > pixels.z_far[i])
      out.free |= bit;
  }
  return out;
}

std::uint64_t free_voxels(const LookView& view, const double* centres, std::uint64_t asked, unsigned inside) {
  std::uint64_t free = 0;
  for (int j = 0; j < 8; ++j) {
    const auto eight = static_cast<unsigned>(asked >> (8 * j) & 255U);
    if (eight == 0) continue;
    const double* centre = centres + j;
    const unsigned found = (inside >> j & 1U) != 0 ? free_of_eight<true>(view, centre, eight)
                                                   : free_of_eight<false>(view, centre, eight);
    free |= static_cast<std::uint64_t>(found) << (8 * j);
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
    const bool is_known = is_measured & (z > 0) & (sigma >= 0) & (sigma < kInfinity);
    ends[u] = is_known ? static_cast<float>(end) : __builtin_nanf("");
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

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

/// The arithmetic of Clearance::look_at().
[[gnu::always_inline]] inline void project(const LookView& view, const double* x, const double* y, const double* z,
                                           Rows& out) {
  constexpr double kRounding = 1e-9;
  const double most_u = view.width - 1.0;
  const double most_v = view.height - 1.0;
  for (int i = 0; i < kRow; ++i) {
    const double z_near = z[i] - view.half[2];
    const double z_far = z[i] + view.half[2];
    const double a = view.sides[0][0] * x[i] + view.sides[0][1] * y[i] + view.sides[0][2] * z[i];
    const double b = view.sides[1][0] * x[i] + view.sides[1][1] * y[i] + view.sides[1][2] * z[i];
    const double c = view.sides[2][0] * x[i] + view.sides[2][1] * y[i] + view.sides[2][2] * z[i];
    const double d = view.sides[3][0] * x[i] + view.sides[3][1] * y[i] + view.sides[3][2] * z[i];
    const int is_inside = (a >= 0) & (b >= 0) & (c >= 0) & (d >= 0);
    out.is_seen[i] = is_inside & (z_far > 0) & (z_near < view.range) & (z_near > 0.02 * z_far);
    out.z_far[i] = z_far;
    const double per_near = 1 / (out.is_seen[i] != 0 ? z_near : 1);
    const double per_far = 1 / (out.is_seen[i] != 0 ? z_far : 1);
    const double left = x[i] - view.half[0] - kRounding;
    const double right = x[i] + view.half[0] + kRounding;
    const double top = y[i] - view.half[1] - kRounding;
    const double bottom = y[i] + view.half[1] + kRounding;
    const double u0 = clamped(view.f_x * left * (left < 0 ? per_near : per_far) + view.c_x, most_u);
    const double u1 = clamped(view.f_x * right * (right < 0 ? per_far : per_near) + view.c_x, most_u);
    const double v0 = clamped(view.f_y * top * (top < 0 ? per_near : per_far) + view.c_y, most_v);
    const double v1 = clamped(view.f_y * bottom * (bottom < 0 ? per_far : per_near) + view.c_y, most_v);
    out.first_u[i] = static_cast<int>(u0 + 0.5);
    out.last_u[i] = static_cast<int>(u1 + 0.5);
    out.first_v[i] = static_cast<int>(v0 + 0.5);
    out.last_v[i] = static_cast<int>(v1 + 0.5);
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

/// Whether all pixels, or a few more (Clearance::over()), end behind z_far.
[[gnu::always_inline]] inline bool is_before_all(const LookView& view, const Rows& rows, int i) {
  const int u0 = rows.first_u[i];
  const int v0 = rows.first_v[i];
  const int u1 = rows.last_u[i];
  const int v1 = rows.last_v[i];
  int level = 0;
  for (int extent = u1 - u0 > v1 - v0 ? u1 - u0 : v1 - v0; extent > 3 && level + 1 < view.level_count; extent /= 2)
    ++level;
  const EndsLevel& ends = view.levels[level];
  const int left = u0 >> level;
  const int count = (u1 >> level) - left + 1;  // 1 to 5
  const int top = v0 >> level;
  const int bottom = v1 >> level;
  const float* row = ends.nearest + top * ends.stride + left;
  if (!(row[0] > rows.z_far[i])) return false;
  Eight least;
  __builtin_memcpy(&least, row, sizeof least);
  for (int v = top + 1; v <= bottom; ++v) {
    row += ends.stride;
    Eight next;
    __builtin_memcpy(&next, row, sizeof next);
    least = next < least ? next : least;
  }
  least += kBeyond[count];
  float nearest = least[0];
  for (int k = 1; k < kRow; ++k) nearest = least[k] < nearest ? least[k] : nearest;
  return nearest > rows.z_far[i];
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

std::uint64_t free_voxels(const LookView& view, const VoxelCentres& centres, std::uint64_t asked) {
  std::uint64_t free = 0;
  for (int j = 0; j < 8; ++j) {
    const auto eight = static_cast<unsigned>(asked >> (8 * j) & 255U);
    if (eight == 0) continue;
    Rows rows;
    project(view, centres.x + 8 * j, centres.y + 8 * j, centres.z + 8 * j, rows);
    for (unsigned rest = eight; rest != 0; rest &= rest - 1) {
      const int i = __builtin_ctz(rest);
      if (rows.is_seen[i] != 0 && is_before_all(view, rows, i)) free |= std::uint64_t{1} << (8 * j + i);
    }
  }
  return free;
}

void measured_row(const float* depth, const float* variance, const unsigned char* state, int count, double margin_sigmas,
                  double range, float* ends) {
  constexpr double kInfinity = __builtin_inf();
  for (int u = 0; u < count; ++u) {
    const double z = depth[u];
    const double sigma = variance != nullptr ? __builtin_sqrt(static_cast<double>(variance[u])) : 0.0;
    const bool is_measured = state == nullptr || state[u] == 0;
    const double end = clamped(z - margin_sigmas * sigma, range);
    ends[u] = is_measured & (z > 0) & (sigma >= 0) & (sigma < kInfinity) ? static_cast<float>(end) : __builtin_nanf("");
  }
}

void rank_all(const float* values, int count, const float* depths, int depth_count, unsigned char* ranks) {
  constexpr int kBlock = 64;
  for (int i = 0; i < count; i += kBlock) {
    const int n = count - i < kBlock ? count - i : kBlock;
    int reached[kBlock] = {};     // NOLINT(*-avoid-c-arrays)
    float block[kBlock] = {};     // NOLINT(*-avoid-c-arrays)
    for (int k = 0; k < n; ++k) block[k] = values[i + k];
    for (int d = 0; d < depth_count; ++d) {
      const float depth = depths[d];
      for (int k = 0; k < kBlock; ++k) reached[k] += block[k] >= depth ? 1 : 0;
    }
    for (int k = 0; k < n; ++k) ranks[i + k] = static_cast<unsigned char>(reached[k]);
  }
}

void halve_row(const float* near_a, const float* near_b, const float* far_a, const float* far_b, int width,
               float* nearest, float* farthest) {
  const auto least = [](float a, float b) { return b < a ? b : a; };
  const auto most = [](float a, float b) { return b > a ? b : a; };
  const int pairs = width / 2;
  for (int u = 0; u < pairs; ++u) {
    nearest[u] = least(least(near_a[2 * u], near_a[2 * u + 1]), least(near_b[2 * u], near_b[2 * u + 1]));
    farthest[u] = most(most(far_a[2 * u], far_a[2 * u + 1]), most(far_b[2 * u], far_b[2 * u + 1]));
  }
  if (width % 2 != 0) {
    nearest[pairs] = least(near_a[width - 1], near_b[width - 1]);
    farthest[pairs] = most(far_a[width - 1], far_b[width - 1]);
  }
}

void usable_depths(const DepthRow& row, double farthest, double limit, double spread, double* z, int* uncertain,
                   int* to_spread) {
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

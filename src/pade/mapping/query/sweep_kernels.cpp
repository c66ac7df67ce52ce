#include "pade/mapping/query/sweep_kernels.hpp"

#include "pade/core/compute/vec.hpp"

namespace pade::mapping::PADE_ISA {
namespace {

using namespace simd::PADE_ISA;

constexpr int kColumns = kLanes < 8 ? kLanes : 8;  // of a row, in one register
constexpr float kMargin = 1e-4F;                   // of squares: rounding is a tenth of it

PADE_INLINE float lane_x(int lane) { return static_cast<float>(lane % kColumns); }
PADE_INLINE float lane_y(int lane) { return static_cast<float>(lane / kColumns); }

}  // namespace

/// With p the way from the nearest place of the ball's centre to the centre of a voxel, all of the voxel is
/// at least |p| - h (|p_x| + |p_y| + |p_z|) / |p| away along p, h being half its side.
std::uint64_t voxels_near_ball(const BallInTile& ball, int z, std::uint64_t asked) {
  V to_x;
  V to_y;
  for (int lane = 0; lane < kLanes; ++lane) {
    to_x[lane] = ball.first[0] + lane_x(lane) * ball.voxel;
    to_y[lane] = ball.first[1] + lane_y(lane) * ball.voxel;
  }
  const V half = set(0.5F * ball.voxel);
  const V square = set(ball.radius * ball.radius);
  const V along_xy = to_x * ball.direction[0] + to_y * ball.direction[1];
  constexpr std::uint64_t kAll = (std::uint64_t{1} << static_cast<unsigned>(kLanes)) - 1;
  std::uint64_t found = 0;
  const float to_z = ball.first[2] + static_cast<float>(z) * ball.voxel;
  for (int bit = 0; bit < 64; bit += kLanes) {
    const auto shift = static_cast<unsigned>(bit);
    if ((asked >> shift & kAll) == 0) continue;
    const float x = static_cast<float>(bit % 8) * ball.voxel;
    const float y = static_cast<float>(bit / 8) * ball.voxel;
    const float rest = x * ball.direction[0] + y * ball.direction[1] + to_z * ball.direction[2];
    const V along = clamp(along_xy + rest, 0, ball.length);
    const V p_x = (to_x + x) - along * ball.direction[0];
    const V p_y = (to_y + y) - along * ball.direction[1];
    const V p_z = to_z - along * ball.direction[2];
    const V p_square = p_x * p_x + p_y * p_y + p_z * p_z;
    // |p| times what is left of it, at most.
    const V left = p_square * (1 - kMargin) - half * (abs(p_x) + abs(p_y) + abs(p_z));
    const I is_missed = I(left > set(0.0F)) & I(left * left > square * p_square);
    found |= std::uint64_t{~bits(is_missed) & static_cast<unsigned>(kAll)} << shift;
  }
  return found & asked;
}

}  // namespace pade::mapping::PADE_ISA

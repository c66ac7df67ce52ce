#include "pade/mapping/tiles/free_search.hpp"

#include <algorithm>
#include <array>
#include <bit>

namespace pade::mapping {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};

struct Kernels {
  decltype(&baseline::place_voxels) place;
  decltype(&baseline::move_voxels) move;
  decltype(&baseline::move_corners) move_corners;
  decltype(&baseline::look_at_eight) look_at_eight;
  decltype(&baseline::free_voxels) free;
};

Kernels kernels() {
  const simd::InstructionSet set = simd::best();
  return {PADE_DISPATCH(place_voxels, set), PADE_DISPATCH(move_voxels, set), PADE_DISPATCH(move_corners, set),
          PADE_DISPATCH(look_at_eight, set), PADE_DISPATCH(free_voxels, set)};
}

/// Bit i becomes byte i.
std::uint64_t bytes_of(unsigned bits) {
  std::uint64_t spread = bits * 0x0101010101010101U & 0x8040201008040201U;
  spread |= spread >> 4U & 0x0f0f0f0f0f0f0f0fU;
  spread |= spread >> 2U & 0x3f3f3f3f3f3f3f3fU;
  spread |= spread >> 1U & 0x7f7f7f7f7f7f7f7fU;
  return (spread & 0x0101010101010101U) * 255U;
}

/// Walks space from the top as an octree, all in the camera's frame, down to tiles; below by 64 voxels at
/// once.
class FreeSpaceSearch {
 public:
  FreeSpaceSearch(const Clearance& now, std::span<const Clearance* const> earlier, bool alone, bool again,
                  double voxel, const VoxelStore& store, std::vector<FreeCube>& out)
      : now_(now),
        alone_(alone),
        again_(again),
        voxel_(voxel),
        store_(store),
        out_(out),
        view_(now.for_voxels(levels_)) {
    for (std::size_t i = 0; i < 8; ++i) {
      const Eigen::Vector3d corner((i & 1U) != 0 ? 1 : -1, (i & 2U) != 0 ? 1 : -1, (i & 4U) != 0 ? 1 : -1);
      to_child_[i] = 0.25 * now.R_camera_world() * corner;
      const Eigen::Vector3d to_voxel = 2 * voxel * to_child_[i];
      for (std::size_t axis = 0; axis < 3; ++axis) to_voxel_[8 * axis + i] = to_voxel[static_cast<int>(axis)];
    }
    witnesses_.reserve(earlier.size());
    for (const Clearance* clearance : earlier) {
      Witness& witness = witnesses_.emplace_back();
      witness.clearance = clearance;
      witness.R_witness_now = clearance->R_camera_world() * now.R_camera_world().transpose();
      witness.t_witness_now = clearance->in_camera(now.origin());
      witness.view = clearance->for_voxels(witness.levels);
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
          witness.motion.r[3 * row + column] = witness.R_witness_now(row, column);
        witness.motion.t[row] = witness.t_witness_now[row];
      }
    }
  }

  std::size_t search() {
    const auto all = static_cast<std::uint32_t>((std::uint64_t{1} << witnesses_.size()) - 1);
    visit({0, now_.in_camera(Eigen::Vector3d::Zero()), 2.0 * kTreeCentre * voxel_, 0}, View::partly, all);
    return pending_;
  }

 private:
  struct Witness {
    const Clearance* clearance = nullptr;
    Eigen::Matrix3d R_witness_now;
    Eigen::Vector3d t_witness_now;
    LookMotion motion{};
    std::vector<EndsLevel> levels;
    LookView view{};
  };
  struct Cube {
    std::uint64_t code;
    Eigen::Vector3d centre;  // in the camera's frame
    double side;
    unsigned depth;
  };

  [[nodiscard]] Cube part_of(const Cube& cube, std::uint64_t i) const {
    return {cube.code | i << bits_below(cube.depth + 1), cube.centre + cube.side * to_child_[i],
            0.5 * cube.side, cube.depth + 1};
  }
  [[nodiscard]] View look_from(const Witness& witness, const Cube& cube) const {
    return witness.clearance->look_at(witness.R_witness_now * cube.centre + witness.t_witness_now, cube.side,
                                      false);
  }

  /// What the witnesses in `open` say: free where one of them does. Those that know nothing leave `open`.
  View ask(const Cube& cube, std::uint32_t& open) const {
    for (std::size_t i = 0; i < witnesses_.size(); ++i) {
      const std::uint32_t bit = std::uint32_t{1} << i;
      if ((open & bit) == 0) continue;
      const View view = look_from(witnesses_[i], cube);
      if (view == View::free) return View::free;
      if (view == View::nothing) open &= ~bit;
    }
    return open == 0 ? View::nothing : View::partly;
  }

  /// @param seen  what is known already of the cube that this one is a part of
  void visit(const Cube& cube, View seen, std::uint32_t open) {
    const bool has_entry = cube.depth % 3 == 1 && cube.depth >= 4;
    if (!again_ && has_entry && store_.is_least(store_.find(cube.code, cube.depth))) return;
    if (seen != View::free) seen = now_.look_at(cube.centre, cube.side, false);
    if (seen == View::nothing) return;
    if (seen == View::free) {
      const View confirmed = alone_ ? View::free : ask(cube, open);
      if (confirmed == View::free) {
        FreeCube& free = out_.emplace_back(FreeCube{cube.code, cube.depth, {}});
        if (cube.depth == kTileDepth) free.voxels.fill(kAll);
      }
      if (confirmed == View::nothing)
        pending_ += voxels_of(cube.depth) - store_.count_least(cube.code, cube.depth);
      if (confirmed != View::partly) return;
    }
    if (cube.depth == kTileDepth) return visit_tile(cube, seen, open);
    for (std::uint64_t i = 0; i < 8; ++i) visit(part_of(cube, i), seen, open);
  }

  void visit_tile(const Cube& tile, View seen, std::uint32_t open) {
    const VoxelStore::Entry& entry = store_.find(tile.code, kTileDepth);
    const VoxelTile* known = entry.has_parts() ? &store_.tile(entry) : nullptr;
    FreeCube free{tile.code, kTileDepth, {}};
    std::uint64_t any = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      const std::uint64_t asked = known != nullptr && !again_ ? ~known->least[i] : kAll;
      if (asked == 0) continue;
      const Cube cube = part_of(tile, i);
      const std::uint64_t shown = shown_by_now(cube, seen, asked);
      if (shown == 0) continue;
      free.voxels[i] = alone_ ? shown : confirmed(cube, shown, open);
      pending_ += static_cast<std::size_t>(std::popcount(shown & ~free.voxels[i]));
      any |= free.voxels[i];
    }
    if (any != 0) out_.push_back(free);
  }

  /// Takes up a cube of 4 x 4 x 4 voxels, to be asked about by the functions below.
  void take(const Cube& cube) {
    for (std::size_t j = 0; j < 8; ++j) {
      const Eigen::Vector3d corner = cube.centre + cube.side * to_child_[j];
      for (std::size_t axis = 0; axis < 3; ++axis) corners_[3 * j + axis] = corner[static_cast<int>(axis)];
    }
    is_placed_ = false;
  }
  const VoxelCentres& placed() {
    if (!is_placed_) kernels_.place(corners_.data(), to_voxel_.data(), centres_);
    is_placed_ = true;
    return centres_;
  }

  /// Of the voxels asked for, those that are free in a view: cubes of 2 x 2 x 2 first.
  template <class Place>
  std::uint64_t free_in(const LookView& view, const double* corners, std::uint64_t asked,
                        const Place& place) const {
    unsigned free = 0;
    unsigned nothing = 0;
    kernels_.look_at_eight(view, corners, &free, &nothing);
    const std::uint64_t whole = bytes_of(free) & asked;
    const std::uint64_t open = asked & ~bytes_of(free | nothing);
    return open == 0 ? whole : whole | kernels_.free(view, place(), open);
  }

  std::uint64_t shown_by_now(const Cube& cube, View seen, std::uint64_t asked) {
    if (seen != View::free) seen = now_.look_at(cube.centre, cube.side, false);
    if (seen == View::nothing) return 0;
    take(cube);
    if (seen == View::free) return asked;
    return free_in(view_, corners_.data(), asked, [&]() -> const VoxelCentres& { return placed(); });
  }

  /// Of `shown`, what a witness shows too.
  std::uint64_t confirmed(const Cube& cube, std::uint64_t shown, std::uint32_t open) {
    std::uint64_t rest = shown;
    for (std::size_t i = 0; i < witnesses_.size() && rest != 0; ++i) {
      if ((open >> i & 1U) == 0) continue;
      const Witness& witness = witnesses_[i];
      const View view = look_from(witness, cube);
      if (view == View::free) return shown;
      if (view == View::nothing) continue;
      std::array<double, 24> corners{};
      kernels_.move_corners(witness.motion, corners_.data(), corners.data());
      rest &= ~free_in(witness.view, corners.data(), rest, [&]() -> const VoxelCentres& {
        kernels_.move(witness.motion, placed(), moved_);
        return moved_;
      });
    }
    return shown & ~rest;
  }

  const Clearance& now_;
  bool alone_;
  bool again_;
  double voxel_;
  const VoxelStore& store_;
  std::vector<FreeCube>& out_;
  Kernels kernels_ = kernels();
  std::array<Eigen::Vector3d, 8> to_child_;  // from the centre of a cube of side 1 to those of its eighths
  std::array<double, 24> to_voxel_{};  // from the centre of 2 x 2 x 2 voxels to theirs: all x, all y, all z
  std::vector<EndsLevel> levels_;
  LookView view_;
  std::vector<Witness> witnesses_;
  std::array<double, 24> corners_{};  // centres of its eight cubes of 2 x 2 x 2, in the camera's frame
  VoxelCentres centres_{}, moved_{};
  bool is_placed_ = false;
  std::size_t pending_ = 0;
};

/// Appends the tiles of a larger cube, or of a part of it the cube itself where no hit lies in it.
void divide(const FreeCube& cube, std::span<const std::uint64_t> hits, std::vector<FreeCube>& out) {
  if (hits.empty()) {
    out.push_back(cube);
    return;
  }
  if (cube.depth == kTileDepth) {
    FreeCube& tile = out.emplace_back(cube);
    for (const std::uint64_t hit : hits) tile.voxels[hit >> 6U & 7U] &= ~(std::uint64_t{1} << (hit & 63U));
    return;
  }
  const unsigned below = bits_below(cube.depth + 1);
  for (std::uint64_t i = 0; i < 8; ++i) {
    FreeCube part{cube.code | i << below, cube.depth + 1, {}};
    if (part.depth == kTileDepth) part.voxels.fill(kAll);
    const auto end = std::find_if(hits.begin(), hits.end(),
                                  [&](std::uint64_t hit) { return hit >> below != part.code >> below; });
    const auto count = static_cast<std::size_t>(end - hits.begin());
    divide(part, hits.first(count), out);
    hits = hits.subspan(count);
  }
}

}  // namespace

std::size_t find_free(const Clearance& now, std::span<const Clearance* const> earlier, bool alone, bool again,
                      double voxel, const VoxelStore& store, std::vector<FreeCube>& out) {
  return FreeSpaceSearch(now, earlier, alone, again, voxel, store, out).search();
}

void cut_out(std::vector<FreeCube>& cubes, std::span<const std::uint64_t> hits,
             std::vector<FreeCube>& scratch) {
  scratch.clear();
  auto hit = hits.begin();
  for (const FreeCube& cube : cubes) {
    while (hit != hits.end() && *hit < cube.code) ++hit;
    const auto first = hit;
    while (hit != hits.end() && *hit - cube.code < voxels_of(cube.depth)) ++hit;
    divide(cube, {first, hit}, scratch);
  }
  cubes.swap(scratch);
}

}  // namespace pade::mapping

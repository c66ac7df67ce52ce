#include "pade/mapping/tiles/free_search.hpp"

#include <algorithm>
#include <array>
#include <bit>

namespace pade::mapping {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};

struct Kernels {
  decltype(&baseline::move_eight) move_eight;
  decltype(&baseline::look_at_eight) look_at_eight;
  decltype(&baseline::free_voxels) free;
};

Kernels kernels() {
  const simd::InstructionSet set = simd::best();
  return {PADE_DISPATCH(move_eight, set), PADE_DISPATCH(look_at_eight, set), PADE_DISPATCH(free_voxels, set)};
}

/// What is known of a cube.
enum class View {
  nothing,  ///< no voxel in it is shown free
  partly,   ///< look at its parts
  free,     ///< every point of it lies before what the pixels that look at it have measured
};

/// Bit i becomes byte i.
std::uint64_t bytes_of(unsigned bits) {
  std::uint64_t spread = bits * 0x0101010101010101U & 0x8040201008040201U;
  spread |= spread >> 4U & 0x0f0f0f0f0f0f0f0fU;
  spread |= spread >> 2U & 0x3f3f3f3f3f3f3f3fU;
  spread |= spread >> 1U & 0x7f7f7f7f7f7f7f7fU;
  return (spread & 0x0101010101010101U) * 255U;
}

/// Bits of eight cubes.
constexpr unsigned kEach = 255;

/// Bit i says whether byte i has any.
unsigned bytes_in_use(std::uint64_t bits) {
  constexpr std::uint64_t kLow = 0x7f7f7f7f7f7f7f7fU;
  const std::uint64_t high_bits = (((bits & kLow) + kLow) | bits) & ~kLow;
  return static_cast<unsigned>((high_bits >> 7U) * 0x0102040810204080U >> 56U);
}

/// Walks space from the top as an octree, by the eight parts of a cube at once, all in the camera's frame.
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
      to_part_[i] = 0.25 * now.R_camera_world() * corner;
    }
    witnesses_.reserve(earlier.size());
    for (const Clearance* clearance : earlier) {
      Witness& witness = witnesses_.emplace_back();
      const Eigen::Matrix3d R_witness_now = clearance->R_camera_world() * now.R_camera_world().transpose();
      const Eigen::Vector3d t_witness_now = clearance->in_camera(now.origin());
      witness.view = clearance->for_voxels(witness.levels);
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
          witness.motion.r[3 * row + column] = R_witness_now(row, column);
        witness.motion.t[row] = t_witness_now[row];
      }
    }
  }

  std::size_t search() {
    const auto all = static_cast<std::uint32_t>((std::uint64_t{1} << witnesses_.size()) - 1);
    visit_parts({0, now_.in_camera(Eigen::Vector3d::Zero()), 2.0 * kTreeCentre * voxel_, 0}, false, all);
    return pending_;
  }

 private:
  struct Witness {
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
  using Points = std::array<double, 24>;  // eight: all x, all y, all z
  /// The eight parts of a cube, as the image and its witnesses see them.
  struct Parts {       // NOLINT(*-pro-type-member-init): filled as witnesses are asked
    Points centres{};  // in the camera's frame
    Eighths now{};
    std::array<Eighths, 32> witnessed;  // by those that were asked
    unsigned wanted = 0;                // what the image knows nothing of is left out
    std::uint32_t asked = 0;            // of the witnesses
  };

  [[nodiscard]] Cube part_of(const Cube& cube, std::uint64_t i) const {
    return {cube.code | i << bits_below(cube.depth + 1), cube.centre + cube.side * to_part_[i],
            0.5 * cube.side, cube.depth + 1};
  }
  [[nodiscard]] Points centres_of_parts(const Cube& cube) const {
    Points centres;
    for (std::size_t j = 0; j < 8; ++j) {
      const Eigen::Vector3d centre = cube.centre + cube.side * to_part_[j];
      for (std::size_t axis = 0; axis < 3; ++axis) centres[8 * axis + j] = centre[static_cast<int>(axis)];
    }
    return centres;
  }
  [[nodiscard]] Points moved(const Witness& witness, const Points& centres) const {
    Points there;
    kernels_.move_eight(witness.motion, centres.data(), there.data());
    return there;
  }

  /// @param free  whether the image shows all of the cube free
  /// @param wanted  of the parts
  void look_at_parts(const Cube& cube, bool free, unsigned wanted, Parts& parts) const {
    parts.centres = centres_of_parts(cube);
    parts.now = free ? Eighths{kEach, 0, kEach}
                     : kernels_.look_at_eight(view_, parts.centres.data(), 0.5 * cube.side, wanted);
    parts.wanted = wanted & ~parts.now.nothing;
    parts.asked = 0;
  }
  const Eighths& ask(std::size_t i, const Cube& cube, Parts& parts) const {
    const std::uint32_t bit = std::uint32_t{1} << i;
    if ((parts.asked & bit) == 0) {
      const Points there = moved(witnesses_[i], parts.centres);
      parts.witnessed[i] =
          kernels_.look_at_eight(witnesses_[i].view, there.data(), 0.5 * cube.side, parts.wanted);
      parts.asked |= bit;
    }
    return parts.witnessed[i];
  }
  /// What the witnesses in `open` say of a part: free where one of them does. Those that know nothing leave
  /// `open`.
  View ask_all(const Cube& cube, Parts& parts, std::size_t part, std::uint32_t& open) const {
    for (std::size_t i = 0; i < witnesses_.size(); ++i) {
      const std::uint32_t bit = std::uint32_t{1} << i;
      if ((open & bit) == 0) continue;
      const Eighths& seen = ask(i, cube, parts);
      if ((seen.free >> part & 1U) != 0) return View::free;
      if ((seen.nothing >> part & 1U) != 0) open &= ~bit;
    }
    return open == 0 ? View::nothing : View::partly;
  }

  /// @param free  whether the image shows all of the cube free
  /// @param open  witnesses that may know something of it
  void visit_parts(const Cube& cube, bool free, std::uint32_t open) {
    Parts parts;
    look_at_parts(cube, free, kEach, parts);
    for (unsigned rest = parts.wanted; rest != 0; rest &= rest - 1)
      visit(cube, parts, static_cast<std::size_t>(std::countr_zero(rest)), open);
  }

  void visit(const Cube& whole, Parts& parts, std::size_t part, std::uint32_t open) {
    const Cube cube = part_of(whole, part);
    const bool has_entry = cube.depth % 3 == 1 && cube.depth >= 4;
    if (!again_ && has_entry && store_.is_least(store_.find(cube.code, cube.depth))) return;
    const bool free = (parts.now.free >> part & 1U) != 0;
    if (free) {
      const View confirmed = alone_ ? View::free : ask_all(whole, parts, part, open);
      if (confirmed == View::free) {
        FreeCube& found = out_.emplace_back(FreeCube{cube.code, cube.depth, {}});
        if (cube.depth == kTileDepth) found.voxels.fill(kAll);
      }
      if (confirmed == View::nothing)
        pending_ += voxels_of(cube.depth) - store_.count_least(cube.code, cube.depth);
      if (confirmed != View::partly) return;
    }
    if (cube.depth == kTileDepth) return visit_tile(cube, free, open);
    visit_parts(cube, free, open);
  }

  void visit_tile(const Cube& tile, bool is_free, std::uint32_t open) {
    const VoxelStore::Entry& entry = store_.find(tile.code, kTileDepth);
    const VoxelTile* known = entry.has_parts() ? &store_.tile(entry) : nullptr;
    FreeCube free{tile.code, kTileDepth, {}};
    std::array<std::uint64_t, 8> all_asked{};
    unsigned wanted = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      all_asked[i] = known != nullptr && !again_ ? ~known->least[i] : kAll;
      wanted |= static_cast<unsigned>(all_asked[i] != 0) << i;
    }
    Parts parts;
    look_at_parts(tile, is_free, wanted, parts);
    std::uint64_t any = 0;
    for (unsigned open_parts = parts.wanted; open_parts != 0; open_parts &= open_parts - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(open_parts));
      const std::uint64_t asked = all_asked[i];
      const Points centres = centres_of_parts(part_of(tile, i));
      const bool whole = (parts.now.free >> i & 1U) != 0;
      const std::uint64_t shown = whole ? asked : free_in(view_, centres, asked);
      if (shown == 0) continue;
      free.voxels[i] = alone_ ? shown : confirmed(tile, parts, i, centres, shown, open);
      pending_ += static_cast<std::size_t>(std::popcount(shown & ~free.voxels[i]));
      any |= free.voxels[i];
    }
    if (any != 0) out_.push_back(free);
  }

  /// Of the voxels asked for of 4 x 4 x 4, those that are free in a view: cubes of 2 x 2 x 2 first.
  [[nodiscard]] std::uint64_t free_in(const LookView& view, const Points& centres,
                                      std::uint64_t asked) const {
    const Eighths eighths = kernels_.look_at_eight(view, centres.data(), 2 * voxel_, bytes_in_use(asked));
    const std::uint64_t whole = bytes_of(eighths.free) & asked;
    const std::uint64_t open = asked & ~bytes_of(eighths.free | eighths.nothing);
    return open == 0 ? whole : whole | kernels_.free(view, centres.data(), open, eighths.inside);
  }

  /// Of `shown`, what a witness shows too.
  std::uint64_t confirmed(const Cube& tile, Parts& parts, std::size_t part, const Points& centres,
                          std::uint64_t shown, std::uint32_t open) const {
    std::uint64_t rest = shown;
    for (std::size_t i = 0; i < witnesses_.size() && rest != 0; ++i) {
      if ((open >> i & 1U) == 0) continue;
      const Eighths& seen = ask(i, tile, parts);
      if ((seen.free >> part & 1U) != 0) return shown;
      if ((seen.nothing >> part & 1U) != 0) continue;
      rest &= ~free_in(witnesses_[i].view, moved(witnesses_[i], centres), rest);
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
  std::array<Eigen::Vector3d, 8> to_part_;  // from the centre of a cube of side 1 to those of its eighths
  std::vector<EndsLevel> levels_;
  LookView view_;
  std::vector<Witness> witnesses_;
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

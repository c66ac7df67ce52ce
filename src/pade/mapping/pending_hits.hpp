// Voxels that were hit, but not yet well enough to be obstacles: far or uncertain ones wait here for looks
// from other places.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace pade::mapping {

/// Evidence per voxel (Morton code) that waits. Bounded: what is not seen again while the camera moves on is
/// forgotten.
class PendingHits {
 public:
  struct Evidence {
    float weight = 0;    ///< sum over the looks; 1 = one certain hit
    float points = 0;    ///< sum over the looks
    int hits = 0;        ///< looks that hit it
    int first_view = 0;  ///< of the first look
    int last_view = 0;   ///< of the last look that counted
  };

  /// One look at a voxel; the first one of each view counts. Views are numbered from 0 on, never fall, and
  /// those of different numbers are from different places.
  /// @return of all looks; valid until the next change
  const Evidence& add(std::uint64_t code, float weight, float points, int view);
  /// 0 if nothing waits.
  [[nodiscard]] float weight(std::uint64_t code) const;
  void erase(std::uint64_t code);
  /// Drops what was seen last before this view.
  void forget_before(int view);

  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  struct Waiting {
    Evidence evidence;
    std::uint16_t voxel = 0;  // low nine bits of its Morton code
  };
  /// Of 8 x 8 x 8 voxels: voxels that are asked for one after the other mostly lie in one.
  struct Tile {
    std::uint64_t code = 0;                   // Morton code of its lower corner
    int last_view = 0;                        // of the last look at any of it
    std::array<std::uint16_t, 512> places{};  // by voxel: in `waiting`, plus one; 0 = does not wait
    std::vector<Waiting> waiting;             // with some that are forgotten, until room is needed
  };
  [[nodiscard]] bool is_forgotten(const Waiting& waiting) const {
    return waiting.evidence.last_view < oldest_view_;
  }
  [[nodiscard]] std::size_t slot_of(std::uint64_t tile) const;
  [[nodiscard]] Tile* find(std::uint64_t tile) const;
  Tile& opened(std::uint64_t tile);
  Waiting& opened(Tile& tile, std::size_t voxel, int view);
  void make_room(Tile& tile) const;
  void index_tiles(std::size_t slots);
  std::size_t& seen_last_in(int view);

  std::vector<std::uint32_t> slots_;          // number of a tile plus one; 0 = empty; a power of two of them
  std::vector<std::unique_ptr<Tile>> tiles_;  // the first `used_`
  std::size_t used_ = 0;
  Tile* last_ = nullptr;                // that was asked for
  int oldest_view_ = 0;                 // what was seen last before it is forgotten
  std::vector<std::size_t> seen_last_;  // voxels that wait, by the view of their last look, from the oldest
  std::size_t size_ = 0;
};

}  // namespace pade::mapping

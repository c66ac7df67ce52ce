// Voxels that were hit, but not yet well enough to be obstacles: far or uncertain ones wait here for looks
// from other places.
#pragma once

#include <cstddef>
#include <cstdint>
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

  /// One look at a voxel; the first one of each view counts. Views are numbered, and those of different
  /// numbers are from different places.
  const Evidence& add(std::uint64_t code, float weight, float points, int view);
  /// 0 if nothing waits.
  [[nodiscard]] float weight(std::uint64_t code) const;
  void erase(std::uint64_t code);
  /// Drops what was seen last before this view.
  void forget_before(int view);

  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  struct Slot {
    std::uint64_t code = kEmpty;
    Evidence evidence;
  };
  static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
  [[nodiscard]] std::size_t home_of(std::uint64_t code) const;
  [[nodiscard]] std::size_t slot_of(std::uint64_t code) const;
  void rehash(std::size_t slots, int oldest_view);
  [[nodiscard]] bool is_crowded() const { return 2 * size_ >= slots_.size(); }

  std::vector<Slot> slots_;  // open addressing; a power of two of them
  std::vector<Slot> spare_;  // the slots of before
  std::size_t size_ = 0;
};

}  // namespace pade::mapping

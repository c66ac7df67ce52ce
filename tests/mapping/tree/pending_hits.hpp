// Voxels that were hit, but not yet well enough to be obstacles: far or uncertain ones wait here for looks
// from other places.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>

namespace pade::mapping::tree {

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
  void erase(std::uint64_t code) { voxels_.erase(code); }
  /// Drops what was seen last before this view.
  void forget_before(int view);

  [[nodiscard]] std::size_t size() const { return voxels_.size(); }

 private:
  std::unordered_map<std::uint64_t, Evidence> voxels_;
};

}  // namespace pade::mapping::tree

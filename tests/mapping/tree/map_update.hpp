// The pieces of one update of the map: a set of hit voxels, the free cubes, and both applied to an octree in
// one pass.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <octomap/OcTree.h>

#include "pade/mapping/tiles/voxel_code.hpp"

#include "mapping/tree/clearance.hpp"
#include "mapping/tree/tree_map.hpp"

namespace pade::mapping::tree {

/// Keys interleaved bit by bit, x lowest: sorting by it walks the octree depth first.
std::uint64_t morton_code(const octomap::OcTreeKey& key);
octomap::OcTreeKey morton_key(std::uint64_t code);

/// An update of one cube.
struct CellUpdate {
  std::uint64_t code = 0;  ///< Morton code of its lower corner
  unsigned depth = kTreeDepth;
  float change = 0;  ///< of the log-odds: above 0 for a hit, below for a miss
};

/// Counts how often each voxel was hit. Open addressing; cleared at a cost proportional to what was used.
class HitCounter {
 public:
  static constexpr std::uint32_t kCertain = 256;
  struct Hit {
    octomap::OcTreeKey key;
    std::uint32_t count = 0;
    std::uint32_t certainty = 0;  ///< sum over its points
  };
  /// @param certainty  probability that the point lies in this voxel, in units of 1 / kCertain
  void add(const octomap::OcTreeKey& key, std::uint32_t certainty);
  void clear();
  /// How often a voxel was hit.
  [[nodiscard]] std::uint32_t count(const octomap::OcTreeKey& key) const;
  /// In no particular order.
  [[nodiscard]] std::span<const Hit> hits() const { return hits_; }

 private:
  [[nodiscard]] std::size_t slot_of(const octomap::OcTreeKey& key) const;
  void grow();
  std::vector<std::uint32_t> slots_;  // index into hits_ plus one; 0 = empty
  std::vector<Hit> hits_;
  std::size_t last_ = 0;  // neighbouring pixels mostly hit the same voxel
};

/// Appends the free cubes that `now` shows and, unless `alone`, at least one of `earlier` shows too, as large
/// as they can be, in Morton order, as misses of `change`. At most 32 earlier ones.
/// @return voxels that `now` alone shows free; 0 if `alone`
std::size_t find_free_cells(const Clearance& now, std::span<const Clearance* const> earlier, bool alone,
                            double voxel, float change, std::vector<CellUpdate>& out);

/// Appends `cells` without the voxels of `hits`, dividing cubes that hold some. All in Morton order.
void cut_out(std::span<const CellUpdate> cells, std::span<const CellUpdate> hits,
             std::vector<CellUpdate>& out);

/// An octree to which many updates are applied in one pass: each inner node on the way is visited once.
class UpdatableTree : public octomap::OcTree {
 public:
  using octomap::OcTree::OcTree;
  /// @param updates  in Morton order, disjoint
  /// @param change   what became occupied or free is appended
  void apply(std::span<const CellUpdate> updates, MapChange& change);

 private:
  void apply_below(octomap::OcTreeNode* node, bool created, unsigned depth,
                   std::span<const CellUpdate> updates, MapChange& change);
  void apply_to_all(octomap::OcTreeNode* node, bool created, unsigned depth, const CellUpdate& update,
                    MapChange& change);
  void settle(octomap::OcTreeNode* node);
};

}  // namespace pade::mapping::tree

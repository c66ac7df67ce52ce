#include "pade/mapping/tiles/octree.hpp"

#include <octomap/OcTree.h>

#include "pade/mapping/tiles/voxel_store.hpp"

namespace pade::mapping {
namespace {

class GrowingTree : public octomap::OcTree {
 public:
  using octomap::OcTree::OcTree;

  void add_leaf(std::uint64_t code, unsigned depth, float log_odds) {
    if (root == nullptr) {
      root = new octomap::OcTreeNode();  // NOLINT(cppcoreguidelines-owning-memory): OctoMap's
      ++tree_size;
    }
    octomap::OcTreeNode* node = root;
    for (unsigned d = 1; d <= depth; ++d) {
      const auto child = static_cast<unsigned>(code >> bits_below(d) & 7U);
      node = nodeChildExists(node, child) ? getNodeChild(node, child) : createNodeChild(node, child);
    }
    node->setLogOdds(log_odds);
    size_changed = true;
  }
};

}  // namespace

std::unique_ptr<octomap::OcTree> octree_of(const VoxelStore& store, const MapOptions& options) {
  GrowingTree growing(options.voxel);
  store.for_each(
      [&](std::uint64_t code, unsigned depth, float log_odds) { growing.add_leaf(code, depth, log_odds); });
  growing.updateInnerOccupancy();
  auto tree = std::make_unique<octomap::OcTree>(options.voxel);
  tree->setProbHit(options.p_hit);
  tree->setProbMiss(options.p_miss);
  tree->setClampingThresMin(options.clamp_min);
  tree->setClampingThresMax(options.clamp_max);
  tree->setOccupancyThres(options.occupancy_threshold);
  tree->swapContent(growing);
  return tree;
}

void take_over(const octomap::OcTree& octree, VoxelStore& store) {
  for (auto leaf = octree.begin_leafs(), end = octree.end_leafs(); leaf != end; ++leaf) {
    const octomap::OcTreeKey key = leaf.getKey();
    const unsigned below = bits_below(leaf.getDepth());
    const float log_odds = leaf->getLogOdds() + 0.0F;  // -0 becomes 0: there is one of each value
    store.set(morton_code({key[0], key[1], key[2]}) >> below << below, leaf.getDepth(), log_odds);
  }
}

}  // namespace pade::mapping

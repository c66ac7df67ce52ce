#include "pade/report/view_3d/voxel_list.hpp"

#include <algorithm>

namespace pade::evaluation {
namespace {

/// Neighbours in the list are neighbours in space, so what falls into one cube stands side by side.
void make_coarser(VoxelList& list) {
  ++list.doublings;
  for (std::uint64_t& code : list.codes) code >>= 3U;
  list.codes.erase(std::unique(list.codes.begin(), list.codes.end()), list.codes.end());
}

}  // namespace

VoxelList list_voxels(const LeafSource& leaves, std::size_t most) {
  VoxelList list;
  leaves([&](const mapping::MapLeaf& leaf) {
    if (!leaf.is_occupied) return;
    const std::uint64_t voxels = std::uint64_t{1} << 3 * (mapping::kTreeDepth - leaf.depth);
    list.voxels += voxels;
    for (std::uint64_t at = leaf.code; at < leaf.code + voxels;) {
      const std::uint64_t cube = at >> 3 * list.doublings;
      if (list.codes.empty() || list.codes.back() != cube) list.codes.push_back(cube);
      while (list.codes.size() > most) make_coarser(list);
      at = ((at >> 3 * list.doublings) + 1) << 3 * list.doublings;
    }
  });
  return list;
}

std::vector<unsigned char> encode_voxels(const std::vector<std::uint64_t>& codes) {
  constexpr unsigned kBits = 7;
  constexpr std::uint64_t kMore = 1U << kBits;
  std::vector<unsigned char> bytes;
  bytes.reserve(2 * codes.size());
  std::uint64_t last = 0;
  for (const std::uint64_t code : codes) {
    std::uint64_t step = code - last;
    for (; step >= kMore; step >>= kBits) bytes.push_back(static_cast<unsigned char>(step % kMore | kMore));
    bytes.push_back(static_cast<unsigned char>(step));
    last = code;
  }
  return bytes;
}

}  // namespace pade::evaluation

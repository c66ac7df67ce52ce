#include "map_content.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include <pade/io/formats/map_files.hpp>

namespace pade_ros {
namespace {

using pade::mapping::kTreeDepth;
using pade::mapping::MapLeaf;
using pade::mapping::MapView;

/// What follows the head of a file of OctoMap's: the bytes of octomap_msgs/Octomap.
std::vector<std::int8_t> data_of(const MapView& view, pade::io::MapFormat format) {
  const std::string file = pade::io::bytes_of(pade::io::encode_map(view, format));
  constexpr std::string_view kHeadEnd = "\ndata\n";
  const std::size_t at = file.find(kHeadEnd);
  if (at == std::string::npos) return {};
  return {file.begin() + static_cast<std::ptrdiff_t>(at + kHeadEnd.size()), file.end()};
}

/// Every third bit, from one of the lowest three on.
int coordinate(std::uint64_t code, unsigned axis) {
  int value = 0;
  for (unsigned bit = 0; bit < kTreeDepth; ++bit)
    value |= static_cast<int>(code >> (3 * bit + axis) & 1U) << bit;
  return value;
}

/// The lower corner of a leaf in voxels from the origin, and its side in voxels.
struct Box {
  std::array<int, 3> low{};
  int side = 1;
};

Box box_of(const MapLeaf& leaf) {
  constexpr int kHalf = 1 << (kTreeDepth - 1);
  Box box;
  for (unsigned axis = 0; axis < 3; ++axis) box.low[axis] = coordinate(leaf.code, axis) - kHalf;
  box.side = 1 << (kTreeDepth - leaf.depth);
  return box;
}

void add_voxels(const MapView& view, std::vector<std::array<float, 3>>& out) {
  const double voxel = view.voxel();
  view.for_each_leaf([&](const MapLeaf& leaf) {
    if (!leaf.is_occupied) return;
    const Box box = box_of(leaf);
    for (int z = 0; z < box.side; ++z)
      for (int y = 0; y < box.side; ++y)
        for (int x = 0; x < box.side; ++x)
          out.push_back({static_cast<float>((box.low[0] + x + 0.5) * voxel),
                         static_cast<float>((box.low[1] + y + 0.5) * voxel),
                         static_cast<float>((box.low[2] + z + 0.5) * voxel)});
  });
}

void add_seen_from_above(const MapView& view, double least_z, double most_z, MapResult& out) {
  const double voxel = view.voxel();
  std::array<int, 2> low = {1 << kTreeDepth, 1 << kTreeDepth},
                     high = {-(1 << kTreeDepth), -(1 << kTreeDepth)};
  const auto for_each_shown = [&](const auto& visitor) {
    view.for_each_leaf([&](const MapLeaf& leaf) {
      const Box box = box_of(leaf);
      if ((box.low[2] + box.side) * voxel > least_z && box.low[2] * voxel < most_z) visitor(leaf, box);
    });
  };
  for_each_shown([&](const MapLeaf&, const Box& box) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      low[axis] = std::min(low[axis], box.low[axis]);
      high[axis] = std::max(high[axis], box.low[axis] + box.side);
    }
  });
  if (low[0] >= high[0]) return;
  out.columns = high[0] - low[0];
  out.rows = high[1] - low[1];
  out.left = low[0] * voxel;
  out.bottom = low[1] * voxel;
  constexpr std::int8_t kUnknown = -1, kFree = 0, kOccupied = 100;
  out.cells.assign(static_cast<std::size_t>(out.columns) * static_cast<std::size_t>(out.rows), kUnknown);
  for_each_shown([&](const MapLeaf& leaf, const Box& box) {
    const std::int8_t state = leaf.is_occupied ? kOccupied : kFree;
    for (int y = box.low[1] - low[1]; y < box.low[1] - low[1] + box.side; ++y)
      for (int x = box.low[0] - low[0]; x < box.low[0] - low[0] + box.side; ++x) {
        auto& cell = out.cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(out.columns) +
                               static_cast<std::size_t>(x)];
        cell = std::max(cell, state);
      }
  });
}

}  // namespace

MapResult map_content(const MapView& view, const Wanted& wanted, double least_z, double most_z) {
  MapResult out;
  out.voxel = view.voxel();
  if (wanted.binary) out.binary = data_of(view, pade::io::MapFormat::bt);
  if (wanted.full) out.full = data_of(view, pade::io::MapFormat::ot);
  if (wanted.voxels) add_voxels(view, out.occupied);
  if (wanted.projected) add_seen_from_above(view, least_z, most_z, out);
  return out;
}

}  // namespace pade_ros

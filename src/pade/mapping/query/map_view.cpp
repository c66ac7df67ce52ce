#include "pade/mapping/query/map_view.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "pade/mapping/query/tile_builder.hpp"
#include "pade/mapping/query/voxel_grid.hpp"

namespace pade::mapping {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

const TileBounds kEverywhere{{0, 0, 0}, {kTilesPerAxis - 1, kTilesPerAxis - 1, kTilesPerAxis - 1}};

TileBounds window_in_tiles(const AlignedBox3d& window, double voxel) {
  return window.isEmpty() ? kEverywhere : tiles_of(window, voxel);
}

double probability_of(const Tile& tile, std::size_t in_tile, double step) {
  return 1 / (1 + std::exp(-step * tile.log_odds[in_tile]));
}

/// Adds the voxel to what is counted.
void count(const TileTree& tiles, const VoxelIndex& v, Contents& contents, int& highest) {
  if (!is_addressed(v)) {
    ++contents.unknown;
    return;
  }
  const Tile& tile = tiles.tile(v[0] >> 3, v[1] >> 3, v[2] >> 3);
  const Occupancy state = tile.at(v[0] & 7, v[1] & 7, v[2] & 7);
  if (state == Occupancy::unknown) {
    ++contents.unknown;
    return;
  }
  ++(state == Occupancy::occupied ? contents.occupied : contents.free);
  highest = std::max<int>(highest, tile.log_odds[index_in_tile(v)]);
}

/// A tile that knows anything, by the Morton code of its place among the tiles.
struct PlacedTile {
  std::uint64_t code;
  const Tile* tile;
};

bool knows_anything(const Tile& tile) {
  return std::any_of(tile.words.begin(), tile.words.end(),
                     [](const Tile::Word& word) { return word.known != 0; });
}

bool is_uniform(const Tile& tile) {
  const std::uint64_t occupied = tile.any_occupied ? ~std::uint64_t{0} : 0;
  return !tile.any_unknown && std::all_of(tile.words.begin(), tile.words.end(), [&](const Tile::Word& word) {
    return word.occupied == occupied;
  }) && std::all_of(tile.log_odds.begin(), tile.log_odds.end(), [&](std::int8_t value) {
    return value == tile.log_odds[0];
  });
}

void visit_tile(const PlacedTile& placed, double step, const std::function<void(const MapLeaf&)>& visitor) {
  const Tile& tile = *placed.tile;
  const std::uint64_t first = placed.code << 9U;
  const auto log_odds = [&](std::size_t i) { return static_cast<float>(step * tile.log_odds[i]); };
  if (is_uniform(tile))
    return visitor({first, kTileDepth, log_odds(0), tile.at(0, 0, 0) == Occupancy::occupied});
  for (std::uint64_t i = 0; i < tile.log_odds.size(); ++i) {
    const VoxelKey v = morton_key(i);
    const Occupancy state = tile.at(v[0], v[1], v[2]);
    if (state != Occupancy::unknown)
      visitor({first + i, kTreeDepth, log_odds(i), state == Occupancy::occupied});
  }
}

constexpr int kNothingKnown = -1000;

void set_probability(Contents& contents, int highest, double step) {
  contents.probability = highest == kNothingKnown ? std::numeric_limits<double>::quiet_NaN()
                                                  : 1 / (1 + std::exp(-step * highest));
}

}  // namespace

double Hit::time(std::span<const double> times) const {
  if (segment + 1 >= times.size()) return times.empty() ? 0 : times.back();
  return times[segment] + share * (times[segment + 1] - times[segment]);
}

MapView::MapView(TileTree tiles, const AlignedBox3d& window)
    : tiles_(std::make_unique<const TileTree>(std::move(tiles))), window_(window) {}

MapView::~MapView() = default;

std::shared_ptr<const MapView> MapView::of(const OccupancyMap& map) { return of(map, AlignedBox3d()); }

std::shared_ptr<const MapView> MapView::of(const OccupancyMap& map, const AlignedBox3d& window) {
  const std::array<TouchedCube, 1> all{};
  TileTree tiles = rebuilt(empty_tiles(map.voxels(), map.options().voxel), map.voxels(), all,
                           window_in_tiles(window, map.options().voxel));
  return std::shared_ptr<const MapView>(new MapView(std::move(tiles), window));
}

std::shared_ptr<const MapView> MapView::after(const OccupancyMap& map, const MapChange& change) const {
  std::vector<TouchedCube> touched;
  touched.reserve(change.touched.size());
  for (const MapCell& cell : change.touched) {
    touched.push_back({morton_code(cell.key), cell.depth});
  }
  TileTree tiles = rebuilt(*tiles_, map.voxels(), touched, window_in_tiles(window_, tiles_->voxel));
  return std::shared_ptr<const MapView>(new MapView(std::move(tiles), window_));
}

std::shared_ptr<const MapView> MapView::flown(std::span<const Vector3d> path, double radius) const {
  std::vector<std::pair<VoxelIndex, std::shared_ptr<const Tile>>> changed;
  for (const auto& [place, inside] : voxels_along(path, radius, tiles_->voxel)) {
    const Tile& old = tiles_->tile(place[0], place[1], place[2]);
    if (!old.any_unknown) continue;
    auto tile = std::make_shared<Tile>(old);
    for (std::size_t z = 0; z < 8; ++z) {
      std::uint64_t fresh = inside[z] & ~old.words[z].known;
      tile->words[z].known |= fresh;
      for (; fresh != 0; fresh &= fresh - 1)
        tile->log_odds[index_in_tile(std::countr_zero(fresh) & 7, std::countr_zero(fresh) >> 3,
                                     static_cast<int>(z))] = -127;
    }
    tile->summarise();
    changed.emplace_back(place, std::move(tile));
  }
  return std::shared_ptr<const MapView>(new MapView(with_tiles(*tiles_, std::move(changed)), window_));
}

double MapView::voxel() const { return tiles_->voxel; }

AlignedBox3d MapView::bounds() const {
  AlignedBox3d box;
  const TileBounds& tiles = tiles_->bounds;
  if (tiles.first[0] > tiles.last[0]) return box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    box.min()[axis] = (tiles.first[i] * kTileSide - kTreeCentre) * tiles_->voxel;
    box.max()[axis] = ((tiles.last[i] + 1) * kTileSide - kTreeCentre) * tiles_->voxel;
  }
  return box;
}

Occupancy TileTree::far_at(const Vector3d& point) const {
  VoxelIndex v;
  return voxel_at(point, per_voxel, v) ? at(v) : Occupancy::unknown;
}

Occupancy MapView::at(const Vector3d& point) const { return tiles_->state_at(point); }

double MapView::probability(const Vector3d& point) const {
  VoxelIndex v;
  if (!voxel_at(point, tiles_->per_voxel, v) || tiles_->at(v) == Occupancy::unknown)
    return std::numeric_limits<double>::quiet_NaN();
  return probability_of(tiles_->tile(v[0] >> 3, v[1] >> 3, v[2] >> 3), index_in_tile(v), tiles_->step);
}

Contents MapView::in_box(const AlignedBox3d& box) const {
  Contents contents;
  int highest = kNothingKnown;
  if (!box.isEmpty()) {
    const VoxelIndex first = voxel_beside(box.min(), tiles_->voxel);
    const VoxelIndex last = voxel_beside(box.max(), tiles_->voxel);
    VoxelIndex v{};
    for (v[2] = first[2]; v[2] <= last[2]; ++v[2])
      for (v[1] = first[1]; v[1] <= last[1]; ++v[1])
        for (v[0] = first[0]; v[0] <= last[0]; ++v[0]) count(*tiles_, v, contents, highest);
  }
  set_probability(contents, highest, tiles_->step);
  return contents;
}

Contents MapView::in_ball(const Vector3d& centre, double radius) const {
  Contents contents;
  int highest = kNothingKnown;
  if (centre.allFinite() && radius > 0) {
    const VoxelIndex first = voxel_beside(centre.array() - radius, tiles_->voxel);
    const VoxelIndex last = voxel_beside(centre.array() + radius, tiles_->voxel);
    VoxelIndex v{};
    for (v[2] = first[2]; v[2] <= last[2]; ++v[2])
      for (v[1] = first[1]; v[1] <= last[1]; ++v[1])
        for (v[0] = first[0]; v[0] <= last[0]; ++v[0])
          if (box_of(v, tiles_->voxel).squaredExteriorDistance(centre) < radius * radius)
            count(*tiles_, v, contents, highest);
  }
  set_probability(contents, highest, tiles_->step);
  return contents;
}

void MapView::for_each_leaf(const std::function<void(const MapLeaf&)>& visitor) const {
  const TileBounds& bounds = tiles_->bounds;
  std::vector<PlacedTile> known;
  constexpr int kSide = 1 << TileGroup::kBits;  // tiles of a group
  const auto group_of = [](int tile) { return tile / kSide; };
  for (int z = group_of(bounds.first[2]); z <= group_of(bounds.last[2]); ++z)
    for (int y = group_of(bounds.first[1]); y <= group_of(bounds.last[1]); ++y)
      for (int x = group_of(bounds.first[0]); x <= group_of(bounds.last[0]); ++x) {
        const TileGroup& group = tiles_->group(x, y, z);
        for (unsigned i = 0; i < group.children.size(); ++i) {
          if (!knows_anything(*group.children[i])) continue;
          const auto key = [&](int of_group, unsigned inside) {
            return static_cast<std::uint16_t>(of_group * kSide + static_cast<int>(inside & 7U));
          };
          known.push_back(
              {morton_code({key(x, i), key(y, i >> 3U), key(z, i >> 6U)}), group.children[i].get()});
        }
      }
  std::sort(known.begin(), known.end(),
            [](const PlacedTile& a, const PlacedTile& b) { return a.code < b.code; });
  for (const PlacedTile& tile : known) visit_tile(tile, tiles_->step, visitor);
}

}  // namespace pade::mapping

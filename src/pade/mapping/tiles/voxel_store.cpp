#include "pade/mapping/tiles/voxel_store.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace pade::mapping {
namespace {

constexpr std::size_t kTilesOfABlock = 256;  // of memory; and eighths

float log_odds_of(double probability) {
  return static_cast<float>(std::log(probability / (1 - probability)));
}

/// Appends the voxels of an eighth of a tile, eight that make a cube as one.
void append_cells(std::uint64_t voxels, std::uint64_t code, double voxel, std::vector<MapCell>& cells) {
  if (~voxels == 0) {
    cells.push_back(cell_of(code, kTileDepth + 1, voxel));
    return;
  }
  while (voxels != 0) {
    const auto bit = static_cast<unsigned>(std::countr_zero(voxels));
    if ((bit & 7U) == 0 && (voxels >> bit & 255U) == 255U) {
      cells.push_back(cell_of(code + bit, kTileDepth + 2, voxel));
      voxels &= ~(std::uint64_t{255} << bit);
    } else {
      cells.push_back(cell_of(code + bit, kTreeDepth, voxel));
      voxels &= voxels - 1;
    }
  }
}

}  // namespace

LogOdds::LogOdds(const MapOptions& options)
    : hit(log_odds_of(options.p_hit)),
      miss(log_odds_of(options.p_miss)),
      least(log_odds_of(options.clamp_min)),
      most(log_odds_of(options.clamp_max)),
      occupied(log_odds_of(options.occupancy_threshold)) {}

VoxelStore::VoxelStore(const LogOdds& rules, double voxel) : rules_(rules), voxel_(voxel), root_(4096) {}

const VoxelStore::Entry& VoxelStore::find(std::uint64_t code, unsigned depth) const {
  const Entry* entry = &root_[code >> bits_below(kRootDepth)];
  for (unsigned d = kRootDepth; d < depth && entry->has_parts(); d += 3) {
    Entry& part = (*nodes_[entry->part])[code >> bits_below(d + 3) & 511U];
    if (part.is_packed()) unpack(part);
    entry = &part;
  }
  return *entry;
}

bool VoxelStore::value_at(std::uint64_t code, float& log_odds) const {
  const Entry& entry = find(code, kTileDepth);
  if (!entry.has_parts()) {
    log_odds = entry.value;
    return entry.part == Entry::kUniform;
  }
  const VoxelTile& found = tile(entry);
  const std::size_t eighth = code >> 6U & 7U;
  const std::uint32_t values = found.values[eighth];
  log_odds = values == VoxelTile::kNoValues ? found.same[eighth] : own_values(values)[code & 63U];
  return (found.known[eighth] >> (code & 63U) & 1U) != 0;
}

std::uint64_t VoxelStore::count_least(std::uint64_t code, unsigned depth) const {
  const unsigned entry_depth = depth <= 4 ? 4 : depth <= 7 ? 7 : depth <= 10 ? 10 : 13;
  std::uint64_t count = 0;
  for (std::uint64_t at = code; at < code + voxels_of(depth); at += voxels_of(entry_depth)) {
    const Entry& entry = find(at, entry_depth);
    if (!entry.has_parts()) {
      if (is_least(entry)) count += voxels_of(entry_depth);
    } else if (entry_depth < kTileDepth) {
      for (std::uint64_t i = 0; i < 8; ++i)
        count += count_least(at + i * voxels_of(entry_depth + 1), entry_depth + 1);
    } else {
      for (const std::uint64_t word : tile(entry).least) count += static_cast<unsigned>(std::popcount(word));
    }
  }
  return count;
}

std::size_t VoxelStore::memory() const {
  return tiles_.size() * kTilesOfABlock * sizeof(VoxelTile) +
         values_.size() * kTilesOfABlock * sizeof(EighthValues) + nodes_.size() * sizeof(Node) +
         root_.size() * sizeof(Entry) + packed_bytes_;
}

std::uint32_t VoxelStore::new_tile() const {
  if (spare_tiles_.empty()) {
    const auto first = static_cast<std::uint32_t>(tiles_.size() * kTilesOfABlock);
    tiles_.push_back(std::make_unique<VoxelTile[]>(kTilesOfABlock));  // NOLINT(*-avoid-c-arrays)
    for (std::uint32_t i = kTilesOfABlock; i > 0; --i) spare_tiles_.push_back(first + i - 1);
  }
  const std::uint32_t number = spare_tiles_.back();
  spare_tiles_.pop_back();
  return number;
}

std::uint32_t VoxelStore::new_node(const Entry& all) const {
  if (spare_nodes_.empty()) {
    spare_nodes_.push_back(static_cast<std::uint32_t>(nodes_.size()));
    nodes_.push_back(std::make_unique<Node>());
  }
  const std::uint32_t number = spare_nodes_.back();
  spare_nodes_.pop_back();
  nodes_[number]->fill(all);
  return number;
}

void VoxelStore::free_parts(Entry& entry, unsigned depth) const {
  if (entry.is_packed()) release_packed(entry);
  if (!entry.has_parts()) return;
  if (depth == kTileDepth) {
    for (std::size_t eighth = 0; eighth < 8; ++eighth) free_eighth(own_tile(entry), eighth);
    spare_tiles_.push_back(entry.part);
  } else {
    for (Entry& part : *nodes_[entry.part]) free_parts(part, depth + 3);
    spare_nodes_.push_back(entry.part);
  }
}

void VoxelStore::fill(VoxelTile& tile, float log_odds) const {
  constexpr std::uint64_t kAll = ~std::uint64_t{0};
  tile.known.fill(kAll);
  tile.occupied.fill(is_occupied(log_odds) ? kAll : 0);
  tile.least.fill(log_odds <= rules_.least ? kAll : 0);
  tile.values.fill(VoxelTile::kNoValues);
  tile.same.fill(log_odds);
}

EighthValues VoxelStore::values_of(const VoxelTile& tile, std::size_t eighth) const {
  if (tile.values[eighth] != VoxelTile::kNoValues) return own_values(tile.values[eighth]);
  EighthValues values{};
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = (tile.known[eighth] >> i & 1U) != 0 ? tile.same[eighth] : 0;
  return values;
}

EighthValues& VoxelStore::opened_eighth(VoxelTile& tile, std::size_t eighth) const {
  if (tile.values[eighth] != VoxelTile::kNoValues) return own_values(tile.values[eighth]);
  if (spare_values_.empty()) {
    const auto first = static_cast<std::uint32_t>(values_.size() * kTilesOfABlock);
    values_.push_back(std::make_unique<EighthValues[]>(kTilesOfABlock));  // NOLINT(*-avoid-c-arrays)
    for (std::uint32_t i = kTilesOfABlock; i > 0; --i) spare_values_.push_back(first + i - 1);
  }
  const std::uint32_t number = spare_values_.back();
  spare_values_.pop_back();
  own_values(number) = values_of(tile, eighth);
  tile.values[eighth] = number;
  return own_values(number);
}

void VoxelStore::close_eighth(VoxelTile& tile, std::size_t eighth) const {
  if (tile.values[eighth] == VoxelTile::kNoValues) return;
  const EighthValues& values = own_values(tile.values[eighth]);
  std::uint64_t rest = tile.known[eighth];
  const float first = rest == 0 ? 0 : values[static_cast<std::size_t>(std::countr_zero(rest))];
  const auto bits = std::bit_cast<std::uint32_t>(first);  // 0 is not -0
  for (; rest != 0; rest &= rest - 1) {
    const float value = values[static_cast<std::size_t>(std::countr_zero(rest))];
    if (std::bit_cast<std::uint32_t>(value) != bits) return;
  }
  free_eighth(tile, eighth);
  tile.same[eighth] = first;
}

void VoxelStore::free_eighth(VoxelTile& tile, std::size_t eighth) const {
  if (tile.values[eighth] == VoxelTile::kNoValues) return;
  spare_values_.push_back(tile.values[eighth]);
  tile.values[eighth] = VoxelTile::kNoValues;
}

VoxelTile& VoxelStore::opened_tile(Entry& entry) {
  if (entry.has_parts()) return own_tile(entry);
  const Entry old = entry;
  entry.part = new_tile();
  VoxelTile& made = own_tile(entry);
  if (old.part == Entry::kUniform) {
    fill(made, old.value);
  } else {
    made = VoxelTile{};
  }
  return made;
}

VoxelStore::Node& VoxelStore::opened_node(Entry& entry) {
  if (entry.is_packed()) unpack(entry);
  if (!entry.has_parts()) entry = {new_node(entry), 0};
  return *nodes_[entry.part];
}

/// Makes the parts of `entry` one where they are all the same, as `part` is.
void VoxelStore::join(Entry& entry, unsigned depth, const Entry& part) {
  if (part.has_parts() || part.is_packed()) return;
  const Entry same = part;
  const Node& node = *nodes_[entry.part];
  if (!std::all_of(node.begin(), node.end(), [&](const Entry& other) { return other == same; })) return;
  free_parts(entry, depth);
  entry = same;
}

/// Calls update(entry) with the entry at depth `to` that holds the voxel, and joins what has become the same.
template <class Update>
void VoxelStore::descend(Entry& entry, unsigned depth, std::uint64_t code, unsigned to,
                         const Update& update) {
  if (depth == to) {
    if (entry.is_packed()) unpack(entry);
    update(entry);
    return;
  }
  Entry& part = opened_node(entry)[code >> bits_below(depth + 3) & 511U];
  descend(part, depth + 3, code, to, update);
  join(entry, depth, part);
}

float VoxelStore::added(float log_odds, float change) const {
  log_odds += change;
  if (log_odds < rules_.least) return rules_.least;
  return log_odds > rules_.most ? rules_.most : log_odds;
}

void VoxelStore::miss(VoxelTile& tile, std::size_t eighth, std::uint64_t voxels) const {
  EighthValues& log_odds = opened_eighth(tile, eighth);
  tile.known[eighth] |= voxels;
  for (std::uint64_t rest = voxels; rest != 0; rest &= rest - 1) {
    const auto bit = static_cast<unsigned>(std::countr_zero(rest));
    float& value = log_odds[bit];
    value = added(value, rules_.miss);
    const std::uint64_t mask = std::uint64_t{1} << bit;
    if (value <= rules_.least) tile.least[eighth] |= mask;
    tile.occupied[eighth] = is_occupied(value) ? tile.occupied[eighth] | mask : tile.occupied[eighth] & ~mask;
  }
}

void VoxelStore::put(VoxelTile& tile, std::size_t voxel, float log_odds) const {
  const std::size_t eighth = voxel / 64;
  const std::uint64_t mask = std::uint64_t{1} << voxel % 64;
  opened_eighth(tile, eighth)[voxel % 64] = log_odds;
  tile.known[eighth] |= mask;
  tile.least[eighth] = log_odds <= rules_.least ? tile.least[eighth] | mask : tile.least[eighth] & ~mask;
  tile.occupied[eighth] =
      is_occupied(log_odds) ? tile.occupied[eighth] | mask : tile.occupied[eighth] & ~mask;
}

/// One pass over a tile: `free` and `hits` are what lies in it.
void VoxelStore::update_tile(Entry& entry, const FreeCube& free, std::span<const VoxelHit> hits,
                             MapChange& change) {
  if (hits.empty() && is_least(entry)) return;
  VoxelTile& now = opened_tile(entry);
  bool touched = !hits.empty();
  const std::uint64_t tile_code = (hits.empty() ? free.code : hits.front().code) & ~std::uint64_t{511};
  for (std::size_t eighth = 0; eighth < 8; ++eighth) {
    const std::uint64_t misses = free.voxels[eighth] & ~now.least[eighth];
    const bool is_hit = !hits.empty() && (hits.front().code >> 6U & 7U) == eighth;
    if (misses == 0 && !is_hit) continue;
    touched = true;
    const std::uint64_t was_known = now.known[eighth];
    const std::uint64_t was_occupied = now.occupied[eighth];
    if (misses != 0) miss(now, eighth, misses);
    for (; !hits.empty() && (hits.front().code >> 6U & 7U) == eighth; hits = hits.subspan(1)) {
      const std::size_t voxel = hits.front().code & 511U;
      put(now, voxel, added(opened_eighth(now, eighth)[voxel % 64], hits.front().change));
    }
    close_eighth(now, eighth);
    const std::uint64_t is_free = now.known[eighth] & ~now.occupied[eighth];
    const std::uint64_t code = tile_code + 64 * eighth;
    append_cells(now.occupied[eighth] & ~was_occupied, code, voxel_, change.became_occupied);
    append_cells(is_free & (~was_known | was_occupied), code, voxel_, change.became_free);
  }
  if (touched) change.touched.push_back(cell_of(tile_code, kTileDepth, voxel_));
  if (!now.is_uniform()) return;
  const float first = now.same[0];
  free_parts(entry, kTileDepth);
  entry = {Entry::kUniform, first};
}

/// A miss for all voxels of an entry. @return whether it changed anything
bool VoxelStore::miss_all(Entry& entry, std::uint64_t code, unsigned depth, MapChange& change) {
  if (entry.is_packed()) unpack(entry);
  if (is_least(entry)) return false;
  if (!entry.has_parts()) {
    const bool was_free = entry.part == Entry::kUniform && !is_occupied(entry.value);
    const bool was_occupied = entry.part == Entry::kUniform && !was_free;
    entry = {Entry::kUniform, added(entry.value, rules_.miss)};
    const bool is_free = !is_occupied(entry.value);
    if (is_free && !was_free) change.became_free.push_back(cell_of(code, depth, voxel_));
    if (!is_free && !was_occupied) change.became_occupied.push_back(cell_of(code, depth, voxel_));
    return true;
  }
  if (depth == kTileDepth) {
    constexpr std::uint64_t kAll = ~std::uint64_t{0};
    FreeCube all{code, kTileDepth, {}};
    all.voxels.fill(kAll);
    const std::size_t touched = change.touched.size();
    update_tile(entry, all, {}, change);
    const bool changed = change.touched.size() > touched;
    change.touched.resize(touched);  // the caller names the larger cube
    return changed;
  }
  Node& node = *nodes_[entry.part];
  bool changed = false;
  for (std::size_t i = 0; i < node.size(); ++i)
    changed = miss_all(node[i], code + i * voxels_of(depth + 3), depth + 3, change) || changed;
  join(entry, depth, node.back());
  return changed;
}

void VoxelStore::miss_cube(const FreeCube& cube, MapChange& change) {
  const unsigned entries = cube.depth <= 4 ? 4 : cube.depth <= 7 ? 7 : cube.depth <= 10 ? 10 : 13;
  bool changed = false;
  for (std::uint64_t code = cube.code; code < cube.code + voxels_of(cube.depth); code += voxels_of(entries)) {
    if (is_least(find(code, entries))) continue;
    descend(root_[code >> bits_below(kRootDepth)], kRootDepth, code, entries,
            [&](Entry& entry) { changed = miss_all(entry, code, entries, change) || changed; });
  }
  if (changed) change.touched.push_back(cell_of(cube.code, cube.depth, voxel_));
}

void VoxelStore::apply(std::span<const FreeCube> free, std::span<const VoxelHit> hits, MapChange& change) {
  empty_ = empty_ && free.empty() && hits.empty();
  while (!free.empty() || !hits.empty()) {
    const bool hits_first = !hits.empty() && (free.empty() || hits.front().code < free.front().code);
    const FreeCube none{};
    const bool is_tile = !hits_first && free.front().depth == kTileDepth;
    if (!hits_first && !is_tile) {
      miss_cube(free.front(), change);
      free = free.subspan(1);
      continue;
    }
    const std::uint64_t code = hits_first ? hits.front().code : free.front().code;
    const auto end = std::find_if(hits.begin(), hits.end(),
                                  [code](const VoxelHit& hit) { return hit.code >> 9U != code >> 9U; });
    const auto in_tile = hits.first(static_cast<std::size_t>(end - hits.begin()));
    const bool has_free =
        !free.empty() && free.front().code >> 9U == code >> 9U && free.front().depth == kTileDepth;
    descend(root_[code >> bits_below(kRootDepth)], kRootDepth, code, kTileDepth,
            [&](Entry& entry) { update_tile(entry, has_free ? free.front() : none, in_tile, change); });
    hits = hits.subspan(in_tile.size());
    if (has_free) free = free.subspan(1);
  }
}

void VoxelStore::forget_free(std::uint64_t tile_code, const std::array<std::uint64_t, 8>& voxels,
                             MapChange& change) {
  if (find(tile_code, kTileDepth).part == Entry::kUnknown) return;
  descend(root_[tile_code >> bits_below(kRootDepth)], kRootDepth, tile_code, kTileDepth, [&](Entry& entry) {
    if (entry.part == Entry::kUniform && is_occupied(entry.value)) return;
    VoxelTile& now = opened_tile(entry);
    std::uint64_t left = 0;
    bool touched = false;
    for (std::size_t eighth = 0; eighth < 8; ++eighth) {
      const std::uint64_t gone = voxels[eighth] & now.known[eighth] & ~now.occupied[eighth];
      now.known[eighth] &= ~gone;
      now.least[eighth] &= ~gone;
      if (gone != 0 && now.values[eighth] != VoxelTile::kNoValues) {
        EighthValues& values = own_values(now.values[eighth]);
        for (std::uint64_t rest = gone; rest != 0; rest &= rest - 1)
          values[static_cast<std::size_t>(std::countr_zero(rest))] = 0;
        close_eighth(now, eighth);
      }
      append_cells(gone, tile_code + 64 * eighth, voxel_, change.became_unknown);
      touched = touched || gone != 0;
      left |= now.known[eighth];
    }
    if (touched) change.touched.push_back(cell_of(tile_code, kTileDepth, voxel_));
    if (left != 0) return;
    free_parts(entry, kTileDepth);
    entry = {};
  });
}

void VoxelStore::set(std::uint64_t code, unsigned depth, float log_odds) {
  empty_ = false;
  if (depth > kTileDepth) {
    descend(root_[code >> bits_below(kRootDepth)], kRootDepth, code, kTileDepth, [&](Entry& entry) {
      VoxelTile& now = opened_tile(entry);
      for (std::uint64_t at = code; at < code + voxels_of(depth); ++at) put(now, at & 511U, log_odds);
      close_eighth(now, code >> 6U & 7U);
      if (!now.is_uniform()) return;
      free_parts(entry, kTileDepth);
      entry = {Entry::kUniform, log_odds};
    });
    return;
  }
  const unsigned entries = depth <= 4 ? 4 : depth <= 7 ? 7 : depth <= 10 ? 10 : 13;
  for (std::uint64_t at = code; at < code + voxels_of(depth); at += voxels_of(entries)) {
    descend(root_[at >> bits_below(kRootDepth)], kRootDepth, at, entries, [&](Entry& entry) {
      free_parts(entry, entries);
      entry = {Entry::kUniform, log_odds};
    });
  }
}

}  // namespace pade::mapping

// Parts of the map that the vehicle is far from, as bytes: what is unknown or the same all over takes one,
// and a log-odds one or two, by its number in a list of those that occur.
#include <algorithm>
#include <bit>
#include <cstring>
#include <unordered_map>
#include <utility>

#include "pade/mapping/tiles/voxel_store.hpp"

namespace pade::mapping {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Of an eighth of a tile, two bits each.
enum class EighthKind : unsigned { unknown, uniform, known, partly };

template <class Value>
void put_value(Bytes& bytes, Value value) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof value);
  std::memcpy(&bytes[at], &value, sizeof value);
}

template <class Value>
Value take_value(const Bytes& bytes, std::size_t& at) {
  Value value{};
  std::memcpy(&value, &bytes[at], sizeof value);
  at += sizeof value;
  return value;
}

/// The log-odds that occur, numbered as they come.
class ValueList {
 public:
  std::uint32_t number_of(float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    if (!values_.empty() && bits == last_) return last_number_;
    const auto found = numbers_.try_emplace(bits, static_cast<std::uint32_t>(values_.size()));
    if (found.second) values_.push_back(value);
    last_ = bits;
    return last_number_ = found.first->second;
  }
  [[nodiscard]] const std::vector<float>& values() const { return values_; }
  /// Bytes of a number.
  [[nodiscard]] unsigned width() const {
    return values_.size() <= 0x100 ? 1 : values_.size() <= 0x10000 ? 2 : 4;
  }

 private:
  std::unordered_map<std::uint32_t, std::uint32_t> numbers_;
  std::vector<float> values_;
  std::uint32_t last_ = 0, last_number_ = 0;
};

EighthKind kind_of(std::uint64_t known, const EighthValues& values) {
  if (known == 0) return EighthKind::unknown;
  if (~known != 0) return EighthKind::partly;
  return std::all_of(values.begin(), values.end(), [&](float value) { return value == values[0]; })
             ? EighthKind::uniform
             : EighthKind::known;
}

/// Calls visit(value) for each log-odds of an eighth that is written, in order.
template <class Values, class Visit>
void for_values(Values& values, std::uint64_t known, EighthKind kind, const Visit& visit) {
  if (kind == EighthKind::uniform) return visit(values[0]);
  for (std::uint64_t rest = known; rest != 0; rest &= rest - 1)
    visit(values[static_cast<std::size_t>(std::countr_zero(rest))]);
}

}  // namespace

/// The values, then for each tile: what it is, the kinds of its eighths, what is known of them, their
/// log-odds.
Bytes VoxelStore::packed(const Node& node) const {
  ValueList list;
  for (const Entry& entry : node) {
    if (entry.part == Entry::kUniform) list.number_of(entry.value);
    if (!entry.has_parts()) continue;
    for (std::size_t eighth = 0; eighth < 8; ++eighth) {
      const std::uint64_t known = tile(entry).known[eighth];
      const EighthValues values = values_of(tile(entry), eighth);
      for_values(values, known, kind_of(known, values), [&](float value) { list.number_of(value); });
    }
  }
  const unsigned width = list.width();
  Bytes bytes;
  const auto put_number = [&](float value) {
    const std::uint32_t number = list.number_of(value);
    for (unsigned i = 0; i < width; ++i)
      bytes.push_back(static_cast<std::uint8_t>(number >> (8 * i) & 0xffU));
  };
  put_value(bytes, static_cast<std::uint32_t>(list.values().size()));
  for (const float value : list.values()) put_value(bytes, value);
  for (const Entry& entry : node) {
    const bool is_tile = entry.has_parts();
    bytes.push_back(is_tile ? 2 : entry.part == Entry::kUniform ? 1 : 0);
    if (entry.part == Entry::kUniform) put_number(entry.value);
    if (!is_tile) continue;
    std::array<EighthKind, 8> kinds{};
    unsigned all = 0;
    for (std::size_t eighth = 0; eighth < 8; ++eighth) {
      kinds[eighth] = kind_of(tile(entry).known[eighth], values_of(tile(entry), eighth));
      all |= static_cast<unsigned>(kinds[eighth]) << (2 * eighth);
    }
    put_value(bytes, static_cast<std::uint16_t>(all));
    for (std::size_t eighth = 0; eighth < 8; ++eighth) {
      if (kinds[eighth] == EighthKind::partly) put_value(bytes, tile(entry).known[eighth]);
      const EighthValues values = values_of(tile(entry), eighth);
      for_values(values, tile(entry).known[eighth], kinds[eighth], put_number);
    }
  }
  bytes.shrink_to_fit();
  return bytes;
}

void VoxelStore::unpack_node(const Bytes& bytes, Node& node) const {
  std::size_t at = 0;
  std::vector<float> values(take_value<std::uint32_t>(bytes, at));
  for (float& value : values) value = take_value<float>(bytes, at);
  const unsigned width = values.size() <= 0x100 ? 1 : values.size() <= 0x10000 ? 2 : 4;
  const auto next_value = [&] {
    std::uint32_t number = 0;
    for (unsigned i = 0; i < width; ++i) number |= static_cast<std::uint32_t>(bytes[at++]) << (8 * i);
    return values[number];
  };
  for (Entry& entry : node) {
    const std::uint8_t what = bytes[at++];
    entry = {};
    if (what == 1) entry = {Entry::kUniform, next_value()};
    if (what != 2) continue;
    entry = {new_tile(), 0};
    VoxelTile& made = own_tile(entry);
    made = VoxelTile{};
    const unsigned kinds = take_value<std::uint16_t>(bytes, at);
    for (std::size_t eighth = 0; eighth < 8; ++eighth) {
      const auto kind = static_cast<EighthKind>(kinds >> (2 * eighth) & 3U);
      if (kind == EighthKind::unknown) continue;
      made.known[eighth] =
          kind == EighthKind::partly ? take_value<std::uint64_t>(bytes, at) : ~std::uint64_t{0};
      if (kind == EighthKind::uniform) {
        made.same[eighth] = next_value();
        continue;
      }
      for_values(opened_eighth(made, eighth), made.known[eighth], kind,
                 [&](float& value) { value = next_value(); });
      close_eighth(made, eighth);
    }
    mark(made);
  }
}

void VoxelStore::mark(VoxelTile& tile) const {
  for (std::size_t eighth = 0; eighth < 8; ++eighth) {
    std::uint64_t occupied = 0;
    std::uint64_t least = 0;
    const EighthValues values = values_of(tile, eighth);
    for (std::uint64_t rest = tile.known[eighth]; rest != 0; rest &= rest - 1) {
      const auto bit = static_cast<unsigned>(std::countr_zero(rest));
      const float value = values[bit];
      if (is_occupied(value)) occupied |= std::uint64_t{1} << bit;
      if (value <= rules_.least) least |= std::uint64_t{1} << bit;
    }
    tile.occupied[eighth] = occupied;
    tile.least[eighth] = least;
  }
}

Bytes VoxelStore::release_packed(const Entry& entry) const {
  const std::uint32_t number = entry.part - Entry::kPacked;
  packed_bytes_ -= packed_[number].capacity() + sizeof(Bytes);
  spare_packed_.push_back(number);
  return std::exchange(packed_[number], {});
}

void VoxelStore::unpack(Entry& entry) const {
  const Bytes bytes = release_packed(entry);
  entry = {new_node({}), 0};
  unpack_node(bytes, *nodes_[entry.part]);
}

void VoxelStore::pack_parts(std::span<Entry> entries, std::uint64_t code, unsigned depth,
                            const VoxelKey& voxel, double distance) {
  for (std::size_t i = 0; i < entries.size(); ++i) {
    Entry& entry = entries[i];
    if (!entry.has_parts()) continue;
    const std::uint64_t corner = code + i * voxels_of(depth);
    if (depth < kPackDepth) {
      pack_parts(*nodes_[entry.part], corner, depth + 3, voxel, distance);
      continue;
    }
    const VoxelKey key = morton_key(corner);
    double square = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double from = key[axis];
      const double gap = std::max({from - voxel[axis], voxel[axis] - (from + kPackedSide - 1), 0.0});
      square += gap * gap;
    }
    if (square <= distance * distance) continue;
    Bytes bytes = packed(*nodes_[entry.part]);
    free_parts(entry, depth);
    if (spare_packed_.empty()) {
      spare_packed_.push_back(static_cast<std::uint32_t>(packed_.size()));
      packed_.emplace_back();
    }
    const std::uint32_t number = spare_packed_.back();
    spare_packed_.pop_back();
    packed_bytes_ += bytes.capacity() + sizeof(Bytes);
    packed_[number] = std::move(bytes);
    entry = {Entry::kPacked + number, 0};
  }
}

void VoxelStore::pack_beyond(const VoxelKey& voxel, double distance) {
  pack_parts(root_, 0, kRootDepth, voxel, distance);
}

}  // namespace pade::mapping

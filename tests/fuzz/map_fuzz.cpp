// Any bytes as a map file, .bt or .ot by its first line: refused by name, or a map that answers what a
// planner asks, and that is written and read again as the same.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include "pade/io/formats/map_files.hpp"
#include "pade/mapping/query/map_view.hpp"
#include "pade/mapping/tiles/voxel_code.hpp"

#include "expect.hpp"

namespace {

using Eigen::Vector3d;
using namespace pade::mapping;
using pade::io::MapFormat;

constexpr std::size_t kPlaces = 16;  // that a map is asked about

bool is_same(const MapLeaf& a, const MapLeaf& b) {
  return a.code == b.code && a.depth == b.depth && a.log_odds == b.log_odds && a.is_occupied == b.is_occupied;
}

template <class Map>
std::vector<MapLeaf> leaves_of(const Map& map) {
  std::vector<MapLeaf> leaves;
  map.for_each_leaf([&leaves](const MapLeaf& leaf) { leaves.push_back(leaf); });
  return leaves;
}

void ask(const OccupancyMap& map, const MapView& view, const MapLeaf& leaf) {
  const double voxel = map.options().voxel;
  const Vector3d centre = cell_of(leaf.code, leaf.depth, voxel).centre.cast<double>();
  const Vector3d place = centre.array() - 0.25 * voxel;
  const Occupancy state = leaf.is_occupied ? Occupancy::occupied : Occupancy::free;
  PADE_EXPECT(map.at(place) == state && view.at(place) == state);
  const double probability = view.probability(place);
  PADE_EXPECT(probability >= 0 && probability <= 1);
  const Contents contents = view.in_ball(place, 2.5 * voxel);
  PADE_EXPECT(leaf.is_occupied ? contents.occupied > 0 : contents.free > 0);
  PADE_EXPECT(contents.occupied + contents.free + contents.unknown >= 27);
  for (const UnknownSpace unknown : {UnknownSpace::blocked, UnknownSpace::free}) {
    const double reach = 100 * voxel;
    const auto ray = view.ray(place, Vector3d(1, 0.5, -0.25), reach, unknown);
    PADE_EXPECT(!leaf.is_occupied || (ray && ray->length == 0));
    PADE_EXPECT(!ray || (ray->state != Occupancy::free && ray->length >= 0 && ray->length <= reach));
    PADE_EXPECT(!ray || ray->state == Occupancy::occupied || unknown == UnknownSpace::blocked);
    const std::vector<Vector3d> path{place, place + Vector3d(30, -20, 10) * voxel};
    const auto swept = view.sweep(path, 1.5 * voxel, unknown);
    PADE_EXPECT(!leaf.is_occupied || (swept && swept->length == 0));
    PADE_EXPECT(!swept || (swept->state != Occupancy::free && swept->share >= 0 && swept->share <= 1));
  }
}

/// What is written is read as the same space.
template <class Map>
void write_and_read(const Map& map, MapFormat format, const OccupancyMap::Counts& counts) {
  const std::string bytes = pade::io::bytes_of(pade::io::encode_map(map, format));
  const auto again = pade::io::decode_map(bytes, "again");
  PADE_EXPECT(again.ok());
  PADE_EXPECT(again->counts().occupied == counts.occupied && again->counts().free == counts.free);
  // A view joins less of what has become the same by its coarse log-odds.
  const bool is_view = std::is_same_v<Map, MapView>;
  if (is_view && format == MapFormat::ot) return;
  PADE_EXPECT(pade::io::bytes_of(pade::io::encode_map(*again, format)) == bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view content(reinterpret_cast<const char*>(data), size);
  const auto map = pade::io::decode_map(content, "map");
  if (!map) {
    PADE_EXPECT(map.error().message.starts_with("map: "));
    return 0;
  }
  const auto view = MapView::of(*map);
  const std::vector<MapLeaf> leaves = leaves_of(*map);
  const std::size_t step = leaves.size() / kPlaces + 1;
  for (std::size_t i = 0; i < leaves.size(); i += step) ask(*map, *view, leaves[i]);
  const OccupancyMap::Counts counts = map->counts();
  for (const MapFormat format : {MapFormat::bt, MapFormat::ot}) {
    write_and_read(*map, format, counts);
    write_and_read(*view, format, counts);
  }
  const std::string bytes = pade::io::bytes_of(pade::io::encode_map(*map, MapFormat::ot));
  const auto again = pade::io::decode_map(bytes, "again");
  PADE_EXPECT(again.ok());
  const std::vector<MapLeaf> read = leaves_of(*again);
  PADE_EXPECT(read.size() == leaves.size());
  for (std::size_t i = 0; i < leaves.size(); ++i) PADE_EXPECT(is_same(read[i], leaves[i]));
  return 0;
}

#include "place_info.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "pade/mapping/query/distance_field.hpp"
#include "pade/mapping/query/map_view.hpp"
#include "pade/mapping/query/surroundings.hpp"

namespace pade::cli {
namespace {

using Eigen::Vector3d;
using mapping::kSectors;
using mapping::MapView;
using mapping::Occupancy;
using mapping::UnknownSpace;

constexpr double kReach = 5;          // of the distance, m
constexpr double kReachVoxels = 100;  // at most
constexpr double kSectorReach = 20;   // m
constexpr double kSectorHalf = 0.5;   // height of what counts, up and down, m

/// What is said of the place.
struct Place {
  Occupancy state;
  double probability;
  double reach;     ///< within which it is looked for, m
  double distance;  ///< of the nearest occupied voxel's centre; `reach` if none is nearer
  Vector3d away;    ///< unit vector from it; zero if there is none
  std::array<double, kSectors> sectors;
};

Place look(const mapping::OccupancyMap& map, const Vector3d& at) {
  const auto view = MapView::of(map);
  const double reach = std::min(kReach, kReachVoxels * view->voxel());
  const Eigen::AlignedBox3d box(at.array() - reach, at.array() + reach);
  const auto field = mapping::DistanceField::of(*view, box, UnknownSpace::free, reach);
  const Vector3d gradient = field.gradient(at);
  const bool has_way = gradient.allFinite() && gradient.norm() > 1e-9;
  return {view->at(at),
          view->probability(at),
          reach,
          field.distance(at),
          has_way ? Vector3d(gradient.normalized()) : Vector3d::Zero(),
          mapping::sectors(*view, at, kSectorReach, kSectorHalf, kSectorHalf, UnknownSpace::free)};
}

const char* name_of(Occupancy state) {
  return state == Occupancy::occupied ? "occupied" : state == Occupancy::free ? "free" : "unknown";
}

}  // namespace

nlohmann::ordered_json place_json(const mapping::OccupancyMap& map, const Vector3d& at) {
  const Place place = look(map, at);
  nlohmann::ordered_json sectors = nlohmann::ordered_json::array();
  for (const double distance : place.sectors)
    sectors.push_back(std::isfinite(distance) ? nlohmann::ordered_json(distance) : nullptr);
  nlohmann::ordered_json json = {{"at_m", {at.x(), at.y(), at.z()}},
                                 {"state", name_of(place.state)},
                                 {"probability", nullptr},
                                 {"nearest_occupied_m", nullptr},
                                 {"sectors_m", std::move(sectors)}};
  if (std::isfinite(place.probability)) json["probability"] = place.probability;
  if (place.distance < place.reach) json["nearest_occupied_m"] = place.distance;
  return json;
}

std::string place_text(const mapping::OccupancyMap& map, const Vector3d& at) {
  const Place place = look(map, at);
  std::string text =
      fmt::format("  {:<12} ({:g}, {:g}, {:g}) is {}", "place", at.x(), at.y(), at.z(), name_of(place.state));
  if (std::isfinite(place.probability)) text += fmt::format(", occupied with {:.2f}", place.probability);
  text +=
      place.distance < place.reach
          ? fmt::format(
                "\n  {:<12} {:.2f} m to the nearest occupied voxel, away from it ({:.2f}, {:.2f}, {:.2f})\n",
                "", place.distance, place.away.x(), place.away.y(), place.away.z())
          : fmt::format("\n  {:<12} no occupied voxel within {:g} m\n", "", place.reach);
  const auto nearest = std::min_element(place.sectors.begin(), place.sectors.end());
  if (std::isfinite(*nearest)) {
    text += fmt::format("  {:<12} at its height {:.2f} m, {} degrees counter-clockwise from x\n", "",
                        *nearest, 360 / kSectors * static_cast<std::size_t>(nearest - place.sectors.begin()));
  }
  return text;
}

}  // namespace pade::cli

#include "place_info.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "pade/mapping/query/distance_field.hpp"
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

Place look(const MapView& view, const Vector3d& at, double sector_reach) {
  const double reach = std::min(kReach, kReachVoxels * view.voxel());
  const Eigen::AlignedBox3d box(at.array() - reach, at.array() + reach);
  const auto field = mapping::DistanceField::of(view, box, UnknownSpace::free, reach);
  const Vector3d gradient = field.gradient(at);
  const bool has_way = gradient.allFinite() && gradient.norm() > 1e-9;
  return {view.at(at),
          view.probability(at),
          reach,
          field.distance(at),
          has_way ? Vector3d(gradient.normalized()) : Vector3d::Zero(),
          mapping::sectors(view, at, sector_reach, kSectorHalf, kSectorHalf, UnknownSpace::free)};
}

/// Twelve to a line: a sixth of the way round.
std::string sectors_text(const std::array<double, kSectors>& sectors, double reach) {
  constexpr std::size_t kOfALine = 12;
  std::string text =
      fmt::format("  {:<12} m to the nearest occupied voxel, up to {:g} m away and {:g} m higher or lower\n",
                  "sectors", reach, kSectorHalf);
  for (std::size_t i = 0; i < kSectors; ++i) {
    if (i % kOfALine == 0) text += fmt::format("  {:<12} {:3} deg ", "", 360 / kSectors * i);
    text += std::isfinite(sectors[i]) ? fmt::format(" {:6.2f}", sectors[i]) : fmt::format(" {:>6}", "-");
    if (i % kOfALine == kOfALine - 1) text += '\n';
  }
  return text;
}

}  // namespace

const char* state_name(Occupancy state) {
  return state == Occupancy::occupied ? "occupied" : state == Occupancy::free ? "free" : "unknown";
}

nlohmann::ordered_json place_json(const MapView& map, const Vector3d& at, double reach) {
  const Place place = look(map, at, reach);
  nlohmann::ordered_json sectors = nlohmann::ordered_json::array();
  for (const double distance : place.sectors)
    sectors.push_back(std::isfinite(distance) ? nlohmann::ordered_json(distance) : nullptr);
  nlohmann::ordered_json json = {{"at_m", {at.x(), at.y(), at.z()}}, {"state", state_name(place.state)},
                                 {"probability", nullptr},           {"nearest_occupied_m", nullptr},
                                 {"sectors_m", std::move(sectors)},  {"sectors_reach_m", reach},
                                 {"sectors_height_m", kSectorHalf}};
  if (std::isfinite(place.probability)) json["probability"] = place.probability;
  if (place.distance < place.reach) json["nearest_occupied_m"] = place.distance;
  return json;
}

std::string place_text(const MapView& map, const Vector3d& at, double reach) {
  const Place place = look(map, at, reach);
  std::string text = fmt::format("  {:<12} ({:g}, {:g}, {:g}) is {}", "place", at.x(), at.y(), at.z(),
                                 state_name(place.state));
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
  return text + sectors_text(place.sectors, reach);
}

}  // namespace pade::cli

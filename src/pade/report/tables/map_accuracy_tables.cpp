#include "pade/report/tables/map_accuracy_tables.hpp"

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace pade::evaluation {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr std::array<std::array<int, 2>, 3> kShownShells = {{{2, 3}, {4, 5}, {7, 8}}};

double share(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole)
                   : std::numeric_limits<double>::quiet_NaN();
}

std::string percent_cell(double value) {
  return std::isnan(value) ? fmt::format("{:>10}", "-") : fmt::format("{:8.2f} %", 100 * value);
}

/// A row with the figure of the map and, where there is one, of the ceiling.
std::string row(const MapAccuracy& a, const std::string& name,
                const std::function<std::string(const MapMeasures&)>& figure) {
  std::string line = fmt::format("  {:42}{}", name, figure(a.map));
  if (a.ceiling) line += "   " + figure(*a.ceiling);
  return line + "\n";
}

std::string count_cell(std::uint64_t n) { return fmt::format("{:10}", n); }

std::string heading(const MapAccuracy& a) {
  std::string text = fmt::format(
      "{} of {} frames have a pose ({:.1f} %); {} of them a true one; voxels of {} m, range {} m; nearest "
      "surface {:.2f} m\n",
      a.frames_with_pose, a.frames, 100 * share(a.frames_with_pose, a.frames), a.frames_compared, a.voxel,
      a.range, a.clearance);
  if (!a.alignment) return text + "Alignment: none, the map is taken as it lies\n";
  const RigidAlignment& r = *a.alignment;
  return text + fmt::format(
                    "Best rigid alignment over {} poses: ({:.3f}, {:.3f}, {:.3f}) m and {:.3f}°; left after "
                    "it {:.3f} m and {:.3f}° rms\n",
                    r.poses, r.shift.x(), r.shift.y(), r.shift.z(), r.rotation * kDegrees, r.rms_position,
                    r.rms_rotation * kDegrees);
}

std::string flight_end_rows(const MapAccuracy& a) {
  std::string text = fmt::format("\n{:44}{:>10}{}\n", "Map at the end of the flight", "map",
                                 a.ceiling ? "   OctoMap, exact depth" : "");
  text += row(a, "occupied voxels", [](const MapMeasures& m) { return count_cell(m.occupied); });
  text += row(a, "free voxels", [](const MapMeasures& m) { return count_cell(m.free); });
  if (a.reference) {
    text += fmt::format("  {:42}{}   of {} in {} over the same {} frames\n",
                        "occupied, as share of the reference",
                        percent_cell(share(a.map.occupied, a.reference->occupied)), a.reference->occupied,
                        a.reference->run, a.reference->frames);
  }
  text += row(a, fmt::format("surface voxels seen within {} m", a.seen_depth),
              [](const MapMeasures& m) { return count_cell(m.surface.voxels); });
  const auto of_surface = [](std::size_t SurfaceShares::*part) {
    return [part](const MapMeasures& m) { return percent_cell(share(m.surface.*part, m.surface.voxels)); };
  };
  text += row(a, "  occupied", of_surface(&SurfaceShares::occupied));
  text += row(a, "  occupied or a neighbour is", of_surface(&SurfaceShares::occupied_or_neighbour));
  text += row(a, "  free", of_surface(&SurfaceShares::free));
  text += row(a, "  unknown", of_surface(&SurfaceShares::unknown));
  for (std::size_t i = 0; i < Phantoms::distances.size(); ++i) {
    text += row(a, fmt::format("occupied, over {:.0f} cm from any surface", 100 * Phantoms::distances[i]),
                [i](const MapMeasures& m) {
                  return percent_cell(share(m.phantoms.farther[i], m.phantoms.occupied));
                });
  }
  return text;
}

std::string ahead_rows(const AheadShares& ahead) {
  const auto line = [&](const std::string& name, std::size_t part) {
    return fmt::format("  {:42}{}\n", name, percent_cell(share(part, ahead.points)));
  };
  return line("occupied within 15 cm", ahead.occupied_near) +
         line("its own voxel is occupied", ahead.occupied) + line("its own voxel is free", ahead.free) +
         line("its own voxel is unknown", ahead.unknown);
}

std::string ahead_title(const AheadShares& ahead, const std::string& when) {
  return fmt::format("\nSurface within 6° of the flight direction, up to 12 m, {} ({} pixels, {} frames)\n",
                     when, ahead.points, ahead.frames);
}

std::string replayed_rows(const ViewAheadResult& r) {
  std::string text = ahead_title(r.surface, "right after each frame") + ahead_rows(r.surface);
  text +=
      fmt::format("\nTruly free corridor of 0.5 m radius ahead, right after each of {} frames\n", r.frames);
  text += fmt::format("  {:42}{:>10}{:>13}{:>9}\n", "", "free", "occupied", "frames");
  for (const Shell& shell : r.shells) {
    const bool shown = std::any_of(kShownShells.begin(), kShownShells.end(),
                                   [&](const auto& s) { return s[0] == shell.from; });
    const double none = std::numeric_limits<double>::quiet_NaN();
    text +=
        fmt::format("{} {:42}{}   {}{:9}\n", shown ? '*' : ' ', fmt::format("{}-{} m", shell.from, shell.to),
                    percent_cell(shell.frames > 0 ? shell.known_free : none),
                    percent_cell(shell.frames > 0 ? shell.called_occupied : none), shell.frames);
  }
  text += fmt::format("\nKnown-free reach of a sphere of 0.35 m, {} frames{:13}{:>10}{:>10}\n",
                      r.reach.frames, "", "10 %", "median");
  text += fmt::format("  {:52}{:7.2f} m {:7.2f} m\n", "known free", r.reach.p10, r.reach.median);
  text += fmt::format("  {:52}{:7.2f} m {:7.2f} m\n", "truly free, at most 12 m", r.reach.true_p10,
                      r.reach.true_median);
  text += fmt::format("  {:52}{:7}\n", "frames in which it would fly into a surface", r.reach.past_surface);
  return text;
}

Json json_share(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? Json(share(part, whole)) : Json(nullptr);
}

Json json_of(const MapMeasures& m) {
  Json phantoms = Json::array();
  for (std::size_t i = 0; i < Phantoms::distances.size(); ++i) {
    phantoms.push_back({{"farther_than_m", Phantoms::distances[i]},
                        {"voxels", m.phantoms.farther[i]},
                        {"share", json_share(m.phantoms.farther[i], m.phantoms.occupied)}});
  }
  return {{"occupied_voxels", m.occupied},
          {"free_voxels", m.free},
          {"surface",
           {{"voxels", m.surface.voxels},
            {"occupied", json_share(m.surface.occupied, m.surface.voxels)},
            {"occupied_or_neighbour", json_share(m.surface.occupied_or_neighbour, m.surface.voxels)},
            {"free", json_share(m.surface.free, m.surface.voxels)},
            {"unknown", json_share(m.surface.unknown, m.surface.voxels)}}},
          {"phantoms", std::move(phantoms)}};
}

Json json_of(const AheadShares& ahead) {
  return {{"frames", ahead.frames},
          {"pixels", ahead.points},
          {"occupied_within_15_cm", json_share(ahead.occupied_near, ahead.points)},
          {"occupied", json_share(ahead.occupied, ahead.points)},
          {"free", json_share(ahead.free, ahead.points)},
          {"unknown", json_share(ahead.unknown, ahead.points)}};
}

Json json_of(const ViewAheadResult& r) {
  Json shells = Json::array();
  for (const Shell& shell : r.shells) {
    shells.push_back({{"from_m", shell.from},
                      {"to_m", shell.to},
                      {"frames", shell.frames},
                      {"known_free", shell.frames > 0 ? Json(shell.known_free) : Json(nullptr)},
                      {"called_occupied", shell.frames > 0 ? Json(shell.called_occupied) : Json(nullptr)}});
  }
  return {{"frames", r.frames},
          {"surface_ahead", json_of(r.surface)},
          {"corridor", std::move(shells)},
          {"reach",
           {{"frames", r.reach.frames},
            {"p10_m", r.reach.p10},
            {"median_m", r.reach.median},
            {"true_p10_m", r.reach.true_p10},
            {"true_median_m", r.reach.true_median},
            {"frames_past_surface", r.reach.past_surface}}}};
}

}  // namespace

std::string to_table(const MapAccuracy& a) {
  std::string text = heading(a) + flight_end_rows(a);
  text += ahead_title(a.ahead, "at the end of the flight") + ahead_rows(a.ahead);
  if (a.replayed) text += replayed_rows(*a.replayed);
  return text;
}

Json json_of(const MapAccuracy& a) {
  Json json = {{"frames", a.frames},
               {"frames_with_pose", a.frames_with_pose},
               {"frames_compared", a.frames_compared},
               {"voxel_m", a.voxel},
               {"range_m", a.range},
               {"seen_depth_m", a.seen_depth},
               {"clearance_m", a.clearance},
               {"alignment", nullptr}};
  if (a.alignment) {
    const RigidAlignment& r = *a.alignment;
    json["alignment"] = {{"poses", r.poses},
                         {"shift_m", {r.shift.x(), r.shift.y(), r.shift.z()}},
                         {"rotation_deg", r.rotation * kDegrees},
                         {"rms_position_m", r.rms_position},
                         {"rms_rotation_deg", r.rms_rotation * kDegrees}};
  }
  json["map"] = json_of(a.map);
  json["surface_ahead_at_the_end"] = json_of(a.ahead);
  json["replayed"] = a.replayed ? json_of(*a.replayed) : Json(nullptr);
  json["octomap_with_exact_depth"] = a.ceiling ? json_of(*a.ceiling) : Json(nullptr);
  json["reference"] = nullptr;
  if (a.reference) {
    json["reference"] = {{"run", a.reference->run},
                         {"frames", a.reference->frames},
                         {"occupied_voxels", a.reference->occupied},
                         {"occupied_share", json_share(a.map.occupied, a.reference->occupied)}};
  }
  return json;
}

}  // namespace pade::evaluation

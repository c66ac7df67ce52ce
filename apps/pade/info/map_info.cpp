#include "info/map_info.hpp"

#include <cstddef>
#include <memory>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <octomap/OcTree.h>

#include "pade/io/formats/map_files.hpp"
#include "pade/mapping/occupancy_map.hpp"
#include "pade/mapping/query/map_view.hpp"

#include "info/info_lines.hpp"
#include "options/json_text.hpp"
#include "options/unused_options.hpp"

namespace pade::cli {

Status inform_of_map(const std::filesystem::path& file, const MapQuestions& questions,
                     const CLI::App& command, bool as_json) {
  if (Status used = refuse_unused(command,
                                  {"--at", "--ray", "--box", "--ball", "--sweep", "--frontiers", "--reach",
                                   "--radius", "--unknown", "--json"},
                                  "a map");
      !used)
    return used;
  if (Status used = refuse_unused(command, options_of_map(questions), "no question that it is for"); !used)
    return used;
  const auto made_with = io::options_beside(file);
  if (!made_with) return made_with.error();
  const Result<mapping::OccupancyMap> map = io::read_map(file, *made_with);
  if (!map) return map.error();
  const auto view = mapping::MapView::of(*map);
  if (const Status sensible = check_questions(questions, *view); !sensible)
    return Error{fmt::format("{}: {}", file.string(), sensible.error().message)};
  const double voxel = map->options().voxel;
  const mapping::OccupancyMap::Counts counts = map->counts();
  const auto volume = [&](std::size_t voxels) { return static_cast<double>(voxels) * voxel * voxel * voxel; };
  const Eigen::AlignedBox3d bounds = map->bounds();
  const Eigen::Vector3d origin = io::local_origin_of(file);
  if (as_json) {
    nlohmann::ordered_json json = {{"kind", "map"},
                                   {"file", file.string()},
                                   {"voxel_m", voxel},
                                   {"nodes", map->octree()->size()},
                                   {"occupied_voxels", counts.occupied},
                                   {"free_voxels", counts.free},
                                   {"occupied_m3", volume(counts.occupied)},
                                   {"free_m3", volume(counts.free)},
                                   {"local_origin_m", json_of(origin)},
                                   {"bounds_m", nullptr}};
    if (!bounds.isEmpty())
      json["bounds_m"] = {{"from", json_of(bounds.min())}, {"to", json_of(bounds.max())}};
    json.update(answers_json(questions, *view));
    fmt::print("{}\n", json_text(json));
    return {};
  }
  fmt::print("{}: occupancy map with voxels of {:g} m\n", file.string(), voxel);
  line("nodes", "{}", map->octree()->size());
  line("occupied", "{} voxels, {:.3f} m3", counts.occupied, volume(counts.occupied));
  line("free", "{} voxels, {:.3f} m3", counts.free, volume(counts.free));
  if (!bounds.isEmpty()) line("bounds", "{} to {} m", vector_text(bounds.min()), vector_text(bounds.max()));
  if (!origin.isZero(0))
    line("local origin", "{} {} {}: add it to get back to the coordinates of the poses", origin.x(),
         origin.y(), origin.z());
  fmt::print("{}", answers_text(questions, *view));
  return {};
}

}  // namespace pade::cli

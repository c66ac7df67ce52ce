// OctoMap's files: `.bt` (free or occupied, small) and `.ot` (with probabilities), as octovis and other
// programs read them, and the side-car beside them with what the format has no place for.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "pade/core/result.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/world.hpp"
#include "pade/mapping/occupancy_map.hpp"
#include "pade/mapping/query/map_view.hpp"

namespace pade::io {

/// Of a map file, by its extension.
enum class MapFormat {
  bt,  ///< one of free, occupied, unknown per voxel
  ot,  ///< log-odds per voxel
};

/// The content of a map file. Same map, same bytes. The map must outlive what is returned.
ByteSource encode_map(const mapping::OccupancyMap& map, MapFormat format);
/// The same of a view, which another thread may take while the map goes on: as .bt the bytes of the whole
/// map, as .ot log-odds to 0.5 % of their range.
ByteSource encode_map(const mapping::MapView& view, MapFormat format);

/// Reads the content of a map file of either format; `file` is the name in messages. The whole structure is
/// checked before anything is built: a file that was cut short or is no octree gives an error, never a part
/// of a map. The voxel size is the file's, all else is that of `options`.
Result<mapping::OccupancyMap> decode_map(std::string_view content, std::string_view file,
                                         const mapping::MapOptions& options = {});

/// Writes `path`, which must end in .bt or .ot, whole or not at all; every byte is checked (a full disk is an
/// error).
Status write_map(const mapping::OccupancyMap& map, const std::filesystem::path& path, Overwrite overwrite);

/// Writes a view in the same way.
Status write_map(const mapping::MapView& view, const std::filesystem::path& path, Overwrite overwrite);

/// Reads a .bt or .ot file.
Result<mapping::OccupancyMap> read_map(const std::filesystem::path& path,
                                       const mapping::MapOptions& options = {});

/// The side-car of `map.bt` and `map.ot` is `map.json` beside them: options of the map and, where known,
/// where on Earth the origin of its world lies.
std::filesystem::path side_car_of(const std::filesystem::path& map_file);
/// The map file in the folder of a run, or the file itself.
std::filesystem::path map_file_of(const std::filesystem::path& map_or_run);
/// The options that the side-car of a map holds, with which it was made: above which occupancy a voxel of an
/// .ot counts as occupied. Defaults where there is none. Errors: it is no side-car.
Result<mapping::MapOptions> options_beside(const std::filesystem::path& map_file);
/// `local_origin` is RunInfo::local_origin: the point of the pose world that is 0 0 0 of the map.
std::string encode_side_car(const mapping::MapOptions& options, const std::optional<GeographicOrigin>& origin,
                            const Eigen::Vector3d& local_origin = Eigen::Vector3d::Zero());
/// The geographic origin in a side-car; empty if it is not known there.
Result<std::optional<GeographicOrigin>> decode_side_car(std::string_view content, std::string_view file);
/// The local origin in a side-car; zero if it has none.
Result<Eigen::Vector3d> decode_local_origin(std::string_view content, std::string_view file);

/// The local origin beside a map file; zero if there is no side-car, or none in it.
Eigen::Vector3d local_origin_of(const std::filesystem::path& map_file);

}  // namespace pade::io

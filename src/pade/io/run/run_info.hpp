// What a run says about itself: run.json and timing.json of the run folder (docs/design.md, "Files that
// people meet").
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/health.hpp"
#include "pade/core/hint.hpp"
#include "pade/core/result.hpp"
#include "pade/io/world.hpp"

namespace pade::io {

/// What the occupancy map holds, and what it was given.
struct MapSummary {
  double voxel = 0;  ///< edge of a voxel, metres
  std::uint64_t occupied_voxels = 0;
  std::uint64_t free_voxels = 0;

  std::uint64_t depths = 0;            ///< pixels (cells) with a depth, over the run
  std::uint64_t depths_beyond = 0;     ///< of them, farther than the range of the map
  std::uint64_t depths_uncertain = 0;  ///< of the others, too uncertain to place an obstacle
  std::uint64_t points_outside = 0;    ///< points beyond what the octree can address
  std::uint64_t hits = 0;              ///< voxels that got a hit, summed over the depth images
};

/// How the camera moved between the two frames of a pair, and how well that is known.
struct MotionSummary {
  std::uint64_t pairs = 0;
  std::uint64_t still_pairs = 0;  ///< where even a thing 1 m away moves by less than a pixel
  double baseline = 0;            ///< median distance between the two cameras, metres
  double rotation_sigma = 0;      ///< median, per axis, degrees; 0 = said to be exact
  double direction_sigma = 0;     ///< of the translation, median, per axis, degrees; 0 = said to be exact
  /// What the images say of their stamps, if they say anything (MapperHealth::stamp_offset).
  std::optional<StampOffset> stamp_offset;
};

/// run.json.
struct RunInfo {
  std::string version;             ///< of the program that wrote the run
  std::filesystem::path sequence;  ///< absolute
  std::string poses;               ///< name of the pose file
  std::string options = "{}";      ///< JSON object, the text of json_of(options)
  Camera camera;                   ///< of the undistorted images
  int window = 1;                  ///< n: one depth per n x n pixels (the stacks have full size all the same)
  double range_limit = 0;          ///< metres; depth beyond is none. 0 = no limit
  RunHealth health;
  std::optional<WorldUp> world_up;         ///< empty if nobody said and the cameras do not agree
  std::optional<GeographicOrigin> origin;  ///< of the pose world
  /// The point of the pose world that is 0 0 0 of this run (Sequence::local_origin): add it to what the run
  /// holds to get back to the coordinates of the poses. Metres.
  Eigen::Vector3d local_origin = Eigen::Vector3d::Zero();
  std::optional<MapSummary> map;
  MotionSummary motion;
  double masked_share = 0;  ///< of the image: mask and lens
  std::vector<Hint> hints;  ///< worst first; none if all is well

  // Filled by RunWriter.
  double depth_scale = 0;           ///< counts per metre of depth/<time>.png
  double sigma_scale = 0;           ///< counts per metre of sigma/<time>.png
  double bound_scale = 0;           ///< counts per metre of bound/<time>.png
  std::vector<std::string> stacks;  ///< of depth, sigma, state, bound, flow: those that were saved
  std::array<std::uint64_t, depth_state_names.size()> state_pixels =
      {};  ///< pixels (cells) of each DepthState over the run
};

/// Wall time of one stage over a run, milliseconds per frame.
struct StageTiming {
  std::string stage;
  std::uint64_t count = 0;
  double mean = 0, p50 = 0, p99 = 0, max = 0;
};

/// timing.json: the only file of a run that differs between two runs of the same input.
struct RunTiming {
  std::vector<StageTiming> stages;  ///< in the order of the pipeline; "total" is a frame's latency
  double frames_per_second = 0;     ///< frames over wall time of the whole run, reading and writing included
  std::uint64_t peak_memory = 0;    ///< bytes of resident memory
  double cpu_seconds = 0;           ///< of the process, all threads; 0 in runs of earlier versions
  double stages_cpu_seconds = 0;    ///< of the stages alone
};

/// Percentiles by nearest rank. Empty input gives count 0.
StageTiming summarise(std::string_view stage, std::vector<double> milliseconds);
/// Largest resident memory of this process so far, bytes.
std::uint64_t peak_memory();
/// Processor time of this process so far, all threads, s.
double cpu_seconds();
/// Processor time of the calling thread so far, s.
double thread_cpu_seconds();

/// The counts per metre of a 16-bit image that must hold `range` metres: the largest whole number that fits,
/// with one count to spare, so that what lies beyond (and saturates) still reads as beyond. Without a limit
/// (range not positive or infinite): 500, for 131 m.
double scale_for_range(double range);

nlohmann::ordered_json json_of(const RunInfo& info);
nlohmann::ordered_json json_of(const RunTiming& timing);
/// @{
/// The same as the text of run.json and timing.json; what is not UTF-8 is replaced.
std::string to_json(const RunInfo& info);
std::string to_json(const RunTiming& timing);
/// @}
/// `file` is what messages call the text.
Result<RunInfo> run_info_from_json(std::string_view text, std::string_view file);
Result<RunTiming> run_timing_from_json(std::string_view text, std::string_view file);

}  // namespace pade::io

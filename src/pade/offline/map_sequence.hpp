// A recorded flight through the obstacle mapper into the folder of a run: what `pade map` does.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string_view>

#include "pade/core/result.hpp"
#include "pade/evaluation/depth_accuracy.hpp"
#include "pade/io/run/run_info.hpp"
#include "pade/io/run/run_writer.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/mapping/cloud_builder.hpp"
#include "pade/navigation/navigator.hpp"
#include "pade/offline/checked_log.hpp"
#include "pade/pipeline/obstacle_mapper.hpp"

namespace pade {

/// How a sequence is mapped. Echoed whole into run.json.
struct MapSequenceOptions {
  ObstacleMapperOptions mapper;
  io::SequenceOptions sequence;
  std::string log;          ///< empty: the sensors are beside the images
  std::string time_offset;  ///< "": what the calibration says; seconds, or auto
  navigation::ImuClass imu = navigation::ImuClass::industrial;
  navigation::NavigatorOptions navigation;
  mapping::CloudOptions cloud;
  bool pcd = false;
  bool world_coordinates = false;
  bool report = true;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("mapper", self.mapper, "the pipeline");
    field("sequence", self.sequence, "how the recording is read");
    field("log", self.log, "where the sensors are, if not beside the images, where poses are from-imu-gnss");
    field("time_offset", self.time_offset,
          "time of a pose = time of the image + this, s, where poses are from-imu-gnss; auto: found from the "
          "turns of "
          "images and gyroscope; empty: what the calibration says");
    field("imu", self.imu, "industrial | consumer: class of the IMU where poses are from-imu-gnss");
    field("navigation", self.navigation,
          "the filter where poses are from-imu-gnss; what the calibration says of its mounting goes first");
    field("cloud", self.cloud, "the point cloud of the run");
    field("pcd", self.pcd, "also writes cloud.pcd");
    field("world_coordinates", self.world_coordinates,
          "also writes the clouds and the trajectory with the local origin added: cloud_world.ply, "
          "trajectory_world.txt");
    field("report", self.report, "writes report.html");
  }
};

/// Refuses what makes no sense (core/option_check.hpp).
Status check(const MapSequenceOptions& options);

/// Sets what a YAML text names; where that is another class of IMU, the rest of the filter's options are
/// those of the class. Errors: those of io::from_yaml().
Status read_options(std::string_view text, std::string_view file, MapSequenceOptions& options);
/// The class of the IMU, and the filter's options for it.
void set_imu(MapSequenceOptions& options, navigation::ImuClass imu);

/// Opens a sequence with the poses that the options ask for: read from a file, or from-imu-gnss, for which
/// the images are looked at first if navigation.filter.camera or time_offset (auto) say so. Error also if
/// navigation.filter.camera, log or time_offset is given with poses of another source, or the first with
/// mapper.refinement.on off; where the offset is to be found and cannot be (calibrate_clock()).
/// @param reader  of the sensors; empty: read_checked_log()
/// @param progress  of looking for the offset, as calibrate_clock() has it
Result<io::Sequence> open_sequence(const std::filesystem::path& folder, const MapSequenceOptions& options,
                                   const LogReader& reader = {},
                                   const std::function<bool(std::size_t, std::size_t)>& progress = {});

/// How far a run is.
struct MapProgress {
  std::size_t done = 0, total = 0;  ///< frames
  std::size_t mapped = 0, skipped = 0;
};

/// What a run found out, beside what it wrote.
struct MapResult {
  io::RunInfo info;
  io::RunTiming timing;
  std::optional<evaluation::DepthAccuracy> accuracy;  ///< empty where the sequence has no truth
};

/// Maps a sequence and writes the run. Nothing is left behind where this fails or `progress` returns false.
/// @param threads   1: everything on the calling thread. 2: the next frame is read ahead. Same bytes either
/// way.
/// @param progress  called after every frame; false stops the run with io::interrupted_error(). May be empty.
/// @param started   when the user began to wait: the run's frames per second count from there
Result<MapResult> map_sequence(
    const io::Sequence& sequence, const MapSequenceOptions& options, io::RunWriter& writer, int threads,
    const std::function<bool(const MapProgress&)>& progress = {},
    std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now());

}  // namespace pade

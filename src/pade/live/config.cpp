#include "pade/live/config.hpp"

#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "pade/core/option_check.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/sequence/calibration.hpp"
#include "pade/io/text.hpp"
#include "pade/live/camera/folder_source.hpp"
#include "pade/live/camera/v4l2_source.hpp"
#include "pade/live/camera/video_source.hpp"
#include "pade/live/dds/dds_camera.hpp"
#include "pade/live/dds/dds_poses.hpp"
#include "pade/mapping/tiles/voxel_code.hpp"

namespace pade::live {
namespace {

namespace fs = std::filesystem;

/// Of a folder: what its camera.yaml says, unless another file is named.
fs::path calibration_of(const CameraOptions& options) {
  if (!options.calibration.empty()) return options.calibration;
  return options.kind == CameraKind::folder ? fs::path(options.path) / "camera.yaml" : fs::path();
}

/// Of a topic that has no calibration the lens that it tells itself.
Result<std::unique_ptr<FrameSource>> open_topic(const LiveOptions& options, std::optional<Camera> camera,
                                                DdsParts& dds) {
  const std::string& topic = options.camera.path;
  if (!camera) {
    constexpr double kPatience = 10;  // s
    auto told = await_camera_info(*dds.network, options.dds.camera_info, topic, kPatience);
    if (!told) return told.error();
    camera = *told;
  }
  return open_dds_camera(*dds.network, dds.shared, topic, *camera);
}

Result<std::unique_ptr<FrameSource>> open_source(const LiveOptions& options,
                                                 const std::optional<Camera>& camera, DdsParts* dds) {
  switch (options.camera.kind) {
    case CameraKind::folder:
      return open_folder(options.camera.path, options.camera.calibration);
    case CameraKind::v4l2:
      return open_v4l2(options.camera.path, camera.value_or(Camera{}), options.camera.rate);
    case CameraKind::dds:
      return open_topic(options, camera, *dds);
    case CameraKind::video:
      return open_video(options.camera.path, camera.value_or(Camera{}));
  }
  return Error{"camera.kind: found none"};
}

}  // namespace

Status check(const LiveOptions& options) {
  const OptionRange ranges[] = {
      // Slower images are missing half of the time, slower poses leave gaps that nothing is put into.
      {"camera.rate", options.camera.rate, 5, 1000},
      {"autosave", options.autosave, 0, 3600},
      {"link.pose_rate", options.link.pose_rate, 5, 1000},
      {"link.baud", static_cast<double>(options.link.baud), 9600, 2'000'000},
  };
  if (const Status status = check_ranges(ranges); !status) return status;
  if (const Status status = check(options.session); !status) return status;
  if (const Status status = check(options.sectors); !status) return status;
  if (const Status status = check(options.web); !status) return status;
  if (const Status status = check(options.dds); !status) return status;
  if (!options.needs_dds() && io::json_of(options.dds) != io::json_of(DdsOptions{}))
    return Error{
        "dds: found options, but nothing uses them, expected dds.publish: true, camera.kind: dds or "
        "link.poses: dds"};
  if (options.link.port == no_port && options.link.poses != PoseMessages::dds)
    return Error{
        fmt::format("link.port: found none with link.poses: {}, expected an autopilot, or poses: dds",
                    to_name(options.link.poses))};
  if (options.camera.kind == CameraKind::dds && !is_topic(options.camera.path))
    return Error{fmt::format("camera.path: found \"{}\", expected a topic such as /camera/image_raw",
                             options.camera.path)};
  const bool known = options.map.empty() || options.map.ends_with(".bt") || options.map.ends_with(".ot");
  if (!known)
    return Error{fmt::format("map: found \"{}\", expected a name that ends in .bt or .ot", options.map)};
  const bool recordable =
      options.record.empty() || options.record.ends_with(".mcap") || options.record.ends_with(".bag");
  if (!recordable)
    return Error{
        fmt::format("record: found \"{}\", expected a name that ends in .mcap or .bag", options.record)};
  if (const Status status = within("navigator", navigation::check(options.navigator)); !status) return status;
  if (options.navigator.camera_time_offset != 0)
    return Error{
        fmt::format("navigator.camera_time_offset: found {}, expected 0: session.time_offset is for that",
                    options.navigator.camera_time_offset)};
  if (options.navigator.filter.raw_gnss || options.navigator.filter.camera)
    return Error{
        "navigator.filter.raw_gnss, camera: found one that is on, expected both off: an autopilot sends "
        "neither raw "
        "GNSS nor the motions of a camera"};
  if (const Status status = within("mapper", check(options.mapper)); !status) return status;
  const double reach = options.mapper.map.voxel * mapping::kTreeCentre / 2;
  if (options.sectors.max_distance > reach)
    return Error{
        fmt::format("sectors.max_distance: found {}, expected at most {:.3g} m: a map of voxels of {} m "
                    "reaches no farther",
                    options.sectors.max_distance, reach, options.mapper.map.voxel)};
  return {};
}

Status check_place(const std::string& field, const std::string& file) {
  if (file.empty()) return {};
  std::error_code failed;
  const fs::path folder = fs::absolute(file, failed).parent_path();
  if (failed || !fs::is_directory(folder, failed))
    return Error{
        fmt::format("{}: {}: found no folder {}, expected one that exists", field, file, folder.string())};
  if (::access(folder.c_str(), W_OK) != 0)
    return Error{fmt::format("{}: {}: the folder {} cannot be written to", field, file, folder.string())};
  return {};
}

Result<LiveOptions> read_live_options(const fs::path& file) {
  const auto text = io::read_file(file);
  if (!text) return text.error();
  LiveOptions options;
  if (const Status status = io::from_yaml(*text, file.string(), options); !status) return status.error();
  for (std::string* const input : {&options.camera.path, &options.camera.calibration}) {
    if (!input->empty() && !is_stream(*input))
      *input = (file.parent_path() / *input).string();  // an absolute one stays
  }
  return options;
}

Result<std::unique_ptr<DdsParts>> join_dds(const DdsOptions& options) {
  auto parts = std::make_unique<DdsParts>(options);
  auto network = DdsNetwork::open(options);
  if (!network) return network.error();
  parts->network = std::move(*network);
  return parts;
}

Result<OpenCamera> open_camera(const LiveOptions& live, DdsParts* dds) {
  const CameraOptions& options = live.camera;
  OpenCamera opened;
  opened.T_body_camera.rotation = Eigen::Quaterniond(forward_camera_rotation());
  const fs::path file = calibration_of(options);
  std::error_code code;
  const bool any = fs::exists(file, code);
  const bool needed = options.kind == CameraKind::v4l2 || options.kind == CameraKind::video ||
                      (options.kind == CameraKind::dds && !options.calibration.empty());
  if (!any && needed) {
    return Error{fmt::format("camera.calibration: found no file \"{}\", expected the calibration of {}",
                             file.string(), options.path)};
  }
  io::Calibration calibration;
  if (any) {
    auto read = io::read_calibration(file);
    if (!read) return read.error();
    calibration = std::move(*read);
  }
  if (calibration.T_body_camera) {
    opened.T_body_camera = *calibration.T_body_camera;
    opened.mounting_stated = true;
  }
  auto source = open_source(live, calibration.camera, dds);
  if (!source) return source.error();
  opened.source = std::move(*source);
  return opened;
}

Result<std::unique_ptr<AutopilotLink>> open_link(const LiveOptions& options, const Pose& T_body_camera,
                                                 DdsParts* dds) {
  auto port = open_port(options.link.port, options.link.baud);
  if (!port) return port.error();
  if (options.link.poses != PoseMessages::dds)
    return std::make_unique<AutopilotLink>(std::move(*port), options.link, options.navigator);
  auto poses = DdsPoses::open(*dds->network, dds->shared, options.dds, T_body_camera);
  if (!poses) return poses.error();
  return std::make_unique<AutopilotLink>(std::move(*port), options.link, std::move(*poses));
}

}  // namespace pade::live

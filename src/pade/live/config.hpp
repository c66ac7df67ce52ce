// The file that a live session is started from.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "pade/core/options.hpp"
#include "pade/core/result.hpp"
#include "pade/live/dds/dds_options.hpp"
#include "pade/live/dds/dds_shared.hpp"
#include "pade/live/dds/network.hpp"
#include "pade/live/interfaces.hpp"
#include "pade/live/link/autopilot_link.hpp"
#include "pade/live/sectors.hpp"
#include "pade/live/session.hpp"
#include "pade/live/web/web_options.hpp"
#include "pade/pipeline/obstacle_mapper.hpp"

namespace pade::live {

/// What delivers frames.
enum class CameraKind : std::uint8_t {
  folder,  ///< a recorded sequence at its real pace
  v4l2,    ///< a camera of the kernel's video interface
  dds,     ///< a topic of ROS 2
  video,   ///< a video file at its real pace, or a stream
};

/// Of the camera.
struct CameraOptions {
  CameraKind kind = CameraKind::v4l2;
  std::string path = "/dev/video0";  ///< device, folder, topic, file or address
  std::string calibration;           ///< file (docs/formats.md); empty: the folder's own, or dds.camera_info
  double rate = 15;                  ///< frames per second that a device is asked for

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("kind", self.kind,
          "v4l2; folder: a recorded sequence at its real pace; dds: a topic of ROS 2; video: a file at its "
          "real pace, or a stream");
    field("path", self.path,
          "device, folder, topic (one that ends in /compressed has sensor_msgs/CompressedImage), video file "
          "or address such as rtsp://192.168.0.10/main");
    field("calibration", self.calibration,
          "file with lens and mounting; empty: the folder's own, or the lens of dds.camera_info");
    field("rate", self.rate, "frames per second that a device is asked for");
  }
};

/// A flight may be long and over new ground: what is far from the vehicle is packed.
inline ObstacleMapperOptions mapper_of_long_flights() {
  ObstacleMapperOptions options;
  options.map.pack_beyond = 50;
  return options;
}

/// All of it.
struct LiveOptions {
  CameraOptions camera;
  LinkOptions link;
  navigation::NavigatorOptions navigator;  ///< of our own filter (link.poses: sensors)
  SessionOptions session;
  SectorOptions sectors;
  ObstacleMapperOptions mapper = mapper_of_long_flights();
  std::string map = "map.bt";  ///< where the map is saved; empty: nowhere
  double autosave = 10;        ///< s between one save and the next; 0: only at the end
  std::string record;          ///< MCAP file of what is mapped; empty: none
  WebOptions web;
  DdsOptions dds;

  /// Whether anything of it speaks DDS.
  [[nodiscard]] bool needs_dds() const {
    return dds.publish || camera.kind == CameraKind::dds || link.poses == PoseMessages::dds;
  }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("camera", self.camera, "where frames come from");
    field("link", self.link, "the autopilot");
    field("navigator", self.navigator, "our own filter, for link.poses: sensors");
    field("session", self.session, "how frames and poses meet");
    field("sectors", self.sectors, "what is sent as OBSTACLE_DISTANCE");
    field("mapper", self.mapper, "depth and map");
    field("map", self.map, "file (.bt, .ot) that the map is saved to; empty: nowhere");
    field("autosave", self.autosave, "between one save and the next, s; 0 = only at the end");
    field("record", self.record, "file (.mcap, .bag) that what is mapped is recorded in; empty: none");
    field("web", self.web, "the page and Foxglove, with --web");
    field("dds", self.dds, "topics of ROS 2, in and out");
  }
};
/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const LiveOptions& options);

/// Whether a file could be written there: known before the flight rather than after it.
/// @param field  in messages
/// @param file   empty: none is written
Status check_place(const std::string& field, const std::string& file);

/// Reads the YAML of a session. Errors name file, line and field. What is read (camera.calibration,
/// camera.path) lies beside the file where its name is relative; what is written goes to the folder in which
/// the program runs.
Result<LiveOptions> read_live_options(const std::filesystem::path& file);

/// A camera, and where it sits.
struct OpenCamera {
  std::unique_ptr<FrameSource> source;
  Pose T_body_camera;
  bool mounting_stated = false;  ///< else it looks ahead from the body's origin
};
/// What speaks DDS in a session.
struct DdsParts {
  explicit DdsParts(const DdsOptions& options) : shared(options) {}
  DdsShared shared;
  std::unique_ptr<DdsNetwork> network;
};
/// Errors: those of DdsNetwork::open.
Result<std::unique_ptr<DdsParts>> join_dds(const DdsOptions& options);

/// Errors: the camera or its calibration cannot be used.
/// @param dds  of a session that needs it, else null; must outlive the camera
Result<OpenCamera> open_camera(const LiveOptions& options, DdsParts* dds);

/// The talk with the autopilot, or none, with poses from where the options say. Errors: those of open_port
/// and of DdsPoses::open.
/// @param dds  as above; must outlive the link
Result<std::unique_ptr<AutopilotLink>> open_link(const LiveOptions& options, const Pose& T_body_camera,
                                                 DdsParts* dds);

}  // namespace pade::live

template <>
struct pade::EnumNames<pade::live::CameraKind> {
  static constexpr std::array names = {std::pair{pade::live::CameraKind::folder, std::string_view("folder")},
                                       std::pair{pade::live::CameraKind::v4l2, std::string_view("v4l2")},
                                       std::pair{pade::live::CameraKind::dds, std::string_view("dds")},
                                       std::pair{pade::live::CameraKind::video, std::string_view("video")}};
};

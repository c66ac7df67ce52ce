// The talk with the autopilot: its poses and clock in, sectors and health out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "pade/core/options.hpp"
#include "pade/live/autopilot_sensors.hpp"
#include "pade/live/interfaces.hpp"
#include "pade/live/link/health.hpp"
#include "pade/live/link/port.hpp"
#include "pade/live/link/pose_source.hpp"
#include "pade/live/link_clock.hpp"
#include "pade/live/mavlink/codec.hpp"
#include "pade/live/mavlink/link_messages.hpp"
#include "pade/live/mavlink/parser.hpp"
#include "pade/live/sectors.hpp"
#include "pade/navigation/navigator.hpp"

namespace pade::live {

/// How obstacles are told.
enum class ObstacleMessages : std::uint8_t {
  level,  ///< OBSTACLE_DISTANCE: distances around the vehicle
  faces,  ///< OBSTACLE_DISTANCE_3D: points in three dimensions; others than ArduPilot get OBSTACLE_DISTANCE
};

/// Options of AutopilotLink.
struct LinkOptions {
  std::string port = "udp:14540";                        ///< udp:PORT, a serial device, or none
  int baud = 921600;                                     ///< of a serial device
  PoseMessages poses = PoseMessages::estimate;           ///< where poses come from
  double pose_rate = 30;                                 ///< Hz that the autopilot is asked for
  ObstacleMessages obstacles = ObstacleMessages::level;  ///< what is sent

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("port", self.port, "udp:PORT, a serial device such as /dev/ttyAMA0, or none: no autopilot");
    field("baud", self.baud, "of a serial device");
    field(
        "poses", self.poses,
        "estimate: ATTITUDE_QUATERNION (else ATTITUDE) and LOCAL_POSITION_NED; odometry: ODOMETRY; sensors: "
        "IMU, GNSS, magnetometer and barometer in our own filter; dds: a topic of ROS 2 (dds.poses)");
    field("pose_rate", self.pose_rate, "Hz that the autopilot is asked for");
    field("obstacles", self.obstacles,
          "level: OBSTACLE_DISTANCE; faces: OBSTACLE_DISTANCE_3D, which ArduPilot alone knows");
  }
};

/// What the autopilot says of its GNSS receiver.
struct GnssState {
  std::uint8_t fix = 0;         ///< GPS_FIX_TYPE: 3 and more in three dimensions
  std::uint8_t satellites = 0;  ///< 255: it does not say
};

/// What a link has done so far.
struct LinkReport {
  mavlink::LinkCounts in;
  std::optional<Autopilot> autopilot;  ///< once its heartbeat has come
  bool synchronised = false;           ///< with its clock
  double clock_bound = 0;              ///< of the clock's error, s
  std::size_t clock_restarts = 0;
  std::size_t poses = 0;          ///< that have come (PoseSource::count)
  std::string poses_missing;      ///< why there are none; empty if there are
  std::string poses_summary;      ///< what has come for them
  std::size_t jumps = 0;          ///< of the poses
  std::optional<GnssState> gnss;  ///< empty: GPS_RAW_INT has not come for three seconds
  bool poses_come = false;        ///< so that there are poses
  std::size_t sectors_sent = 0;   ///< frames whose obstacles were sent
  bool level_instead = false;     ///< of OBSTACLE_DISTANCE_3D, which this autopilot does not know
  std::size_t sectors_stale = 0;  ///< too old when their turn came, so not sent
  std::size_t sectors_empty = 0;  ///< that said nothing, sent so that ArduPilot can be armed at rest
  std::size_t unsent = 0;         ///< packets that the port did not take
  std::string refused;            ///< the last request that the autopilot refused; empty if none
  Missing missing = Missing::autopilot;
};

/// For the pilot: what is missing, and of poses why; at most the 44 characters that a STATUSTEXT has left.
std::string text_of(const LinkReport& report);

/// The obstacles of a frame.
struct FrameObstacles {
  std::optional<mavlink::ObstacleDistance> level;      ///< empty: nothing could be said of any sector
  std::optional<std::vector<Eigen::Vector3d>> points;  ///< obstacle_points(), if they are to be sent as such
  SectorOptions options;                               ///< their limits
  double time_offset = 0;                              ///< time of the pose = time of the frame + this, s
};

/// One for each autopilot. At rest there is no parallax, and ArduPilot refuses to be armed where nothing has
/// come from its proximity sensor for half a second. So while its heartbeat says that it is disarmed, and all
/// but depth is there, it is sent OBSTACLE_DISTANCE that says nothing of any sector; never once it is armed.
/// step() belongs to one thread, all else to any.
class AutopilotLink : public NavigationSource {
 public:
  /// @param navigator  of our own filter; both options such as check() accepts
  AutopilotLink(std::unique_ptr<Port> port, const LinkOptions& options,
                const navigation::NavigatorOptions& navigator = {});
  /// @param poses  where they come from instead
  AutopilotLink(std::unique_ptr<Port> port, const LinkOptions& options, std::unique_ptr<PoseSource> poses)
      : port_(std::move(port)), options_(options), poses_(std::move(poses)) {}

  /// Waits for bytes, at most so long, ms.
  void wait(int milliseconds) { port_->wait(milliseconds); }
  /// Reads what has come, answers, and sends what is due. To be called a hundred times a second.
  void step(Time now, const Progress& progress);

  [[nodiscard]] PoseAnswer pose_at(Time time) const override;
  [[nodiscard]] std::optional<Matrix6d> motion_covariance(Time t1, Time t2,
                                                          const Pose& T_body_camera) const override;
  /// Obstacles of a frame, sent at the next step unless they are older than 0.3 s by then; those before them
  /// that were not sent are forgotten. Those that say nothing are not sent, since receivers would take them
  /// for a sign of health.
  void offer(const FrameObstacles& obstacles, Time frame);
  /// Tells the pilot something that is no missing input, once however often it is asked for.
  /// @param text  at most the 44 characters that a STATUSTEXT has left
  void warn(const std::string& text);
  /// Says that there will be no more sectors. To be called when nobody calls step() any more.
  void end();
  [[nodiscard]] LinkReport report() const;

 private:
  void take(const mavlink::Frame& frame, Time now);
  void take_timesync(const mavlink::Frame& frame, Time now);
  void ask(Time now);
  void send_sectors(Time now);
  void ask_for(const WantedMessage& message);
  bool send_level();
  bool send_points();
  void turn_to_newest_heading(mavlink::ObstacleDistance& sectors) const;
  [[nodiscard]] bool in_faces() const;
  [[nodiscard]] bool is_alone() const { return options_.port == no_port; }
  [[nodiscard]] std::optional<Time> time_of_poses(Time ours) const;
  [[nodiscard]] std::optional<Time> newest_pose() const;
  /// By the clock of the poses, of those of the frame that is offered.
  [[nodiscard]] std::optional<Time> offered_pose_time() const;
  void send_for_arming(Time now);
  void send_warning(Time now);
  void send_health(Time now, const Progress& progress);
  void say(std::uint8_t severity, std::string_view text);
  void send_heartbeat(std::uint8_t state);
  void refresh_report(Time now);
  template <class Message>
  bool send(const Message& message);

  std::unique_ptr<Port> port_;
  LinkOptions options_;
  mavlink::Parser parser_;
  mavlink::Sender sender_;
  Time next_question_, next_request_, next_heartbeat_, next_text_, earliest_heartbeat_;
  Time heard_;                        // the autopilot's heartbeat, last
  bool armed_ = true;                 // by that heartbeat
  Time gnss_heard_;                   // GPS_RAW_INT, last
  Time obstacles_sent_;               // last, whether or not they said anything
  std::string said_;                  // in the last text
  std::vector<WantedMessage> asked_;  // how many had come when the streams were last asked for
  std::uint32_t last_stamp_ = 0;      // of points, ms

  mutable std::mutex mutex_;  // of all below
  std::unique_ptr<PoseSource> poses_;
  LinkClock clock_;
  LinkReport report_;
  std::optional<FrameObstacles> offered_;
  Time offered_frame_;
  LinkProgress progress_;
  std::deque<std::string> warnings_;  // to be said
  std::set<std::string> warned_;      // all so far
};

}  // namespace pade::live

template <>
struct pade::EnumNames<pade::live::ObstacleMessages> {
  static constexpr std::array names = {
      std::pair{pade::live::ObstacleMessages::level, std::string_view("level")},
      std::pair{pade::live::ObstacleMessages::faces, std::string_view("faces")}};
};

// What a ROS node needs of PADE, in plain values: messages in, results out. The headers of ROS 1 ask for
// C++17 and PADE's for C++20; this one is read by both.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace pade_ros {

/// Nanoseconds since 1970 or, simulated, since any start.
using Stamp = std::int64_t;

/// A coordinate frame in another: rotation, then translation (m).
struct Placement {
  std::array<double, 3> position{};
  std::array<double, 4> xyzw{0, 0, 0, 1};
};

/// sensor_msgs/Image or CompressedImage.
struct Image {
  Stamp stamp = 0;
  std::string frame;
  std::uint32_t height = 0, width = 0, step = 0;  ///< of what is not compressed
  std::string encoding;                           ///< `format` of what is compressed
  bool big_endian = false;
  bool compressed = false;
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;               ///< bytes
  std::shared_ptr<const void> owner;  ///< of the bytes
};

/// sensor_msgs/CameraInfo.
struct CameraInfo {
  std::string frame;
  std::uint32_t height = 0, width = 0;
  std::string model;
  std::vector<double> d;
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0, binning_y = 0, x_offset = 0, y_offset = 0;
};

/// nav_msgs/Odometry, geometry_msgs/PoseStamped.
struct PoseMessage {
  Stamp stamp = 0;
  std::string frame;  ///< the world's
  std::string child;  ///< whose pose it is; empty where the message does not say
  Placement pose;
};

/// sensor_msgs/Imu: axes of the frame, rad/s, m/s².
struct ImuMessage {
  Stamp stamp = 0;
  std::string frame;
  std::array<double, 3> angular_rate{}, specific_force{};
  bool complete = true;  ///< false where the covariances say that one of them is not measured
};

/// sensor_msgs/NavSatFix.
struct FixMessage {
  Stamp stamp = 0;
  std::string frame;
  int status = 0;
  double latitude = 0, longitude = 0, height = 0;
  std::array<double, 9> covariance{};
  int covariance_kind = 0;  ///< 0: not known
};

/// geometry_msgs/TwistWithCovarianceStamped of a receiver: east, north, up, m/s; variances where above 0.
struct VelocityMessage {
  Stamp stamp = 0;
  std::array<double, 3> velocity{}, variance{};
};

/// sensor_msgs/MagneticField.
struct FieldMessage {
  Stamp stamp = 0;
  std::string frame;
  std::array<double, 3> tesla{};
};

/// sensor_msgs/FluidPressure.
struct PressureMessage {
  Stamp stamp = 0;
  double pascal = 0;
};

/// tf2, whichever ROS it belongs to. Any thread.
class Transforms {
 public:
  enum class Answer : std::uint8_t { valid, not_yet, never };
  Transforms() = default;
  Transforms(const Transforms&) = delete;
  Transforms& operator=(const Transforms&) = delete;
  virtual ~Transforms() = default;
  /// T_target_source at a time; `why` says what is missing.
  virtual Answer find(const std::string& target, const std::string& source, Stamp stamp, Placement& out,
                      std::string& why) = 0;
  /// The time has jumped back: what is known of later is worth nothing.
  virtual void clear() = 0;
};

/// A point of a cloud, in the world.
struct CloudPoint {
  float x = 0, y = 0, z = 0;  ///< m
  float sigma = 0;            ///< standard deviation of its depth, m
  std::uint8_t r = 0, g = 0, b = 0;
};

/// A pose of the camera.
struct PathPose {
  Stamp stamp = 0;
  Placement T_world_camera;
};

/// What became of a frame. Pointers are valid until the sink returns.
struct FrameResult {
  Stamp stamp = 0;                        ///< of the image that depth, sigma and cloud are of
  std::string world_frame, camera_frame;  ///< the map's world, in which cloud and path are
  Stamp pose_stamp = 0;                   ///< of the newest pose of the path, of `T_world_body` and `origin`
  std::string poses_frame;         ///< the world of the poses: `world_frame`, unless there is an origin
  std::array<double, 3> origin{};  ///< where the map's 0 0 0 is in it, m
  std::string body_frame;  ///< of `T_world_body`; empty where nobody needs to be told, or it is not known
  Placement T_world_body;  ///< of our own filter, in `poses_frame`
  int width = 0, height = 0;
  const float* depth = nullptr;       ///< Z, m, NaN: none; rows one behind the other
  std::shared_ptr<const void> owner;  ///< of the depth
  std::vector<float> sigma;           ///< of it, m; empty where it is not wanted
  std::vector<CloudPoint> cloud;      ///< empty where it is not wanted
  const std::vector<PathPose>* path = nullptr;
};

/// The map at one moment.
struct MapResult {
  Stamp stamp = 0;
  std::string world_frame;
  double voxel = 0.1;                          ///< m
  std::vector<std::int8_t> binary, full;       ///< as octomap_msgs/Octomap has them; empty where not wanted
  std::vector<std::array<float, 3>> occupied;  ///< centres of the occupied voxels, m; empty where not wanted
  int columns = 0, rows = 0;       ///< of the map seen from above; 0: not wanted, or nothing is known
  double left = 0, bottom = 0;     ///< its corner, m
  std::vector<std::int8_t> cells;  ///< 100 occupied, 0 free, -1 unknown, from the corner row by row
};

/// What somebody listens to.
struct Wanted {
  bool cloud = false, sigma = false, binary = false, full = false, voxels = false, projected = false;
};

/// How something is: diagnostic_msgs/DiagnosticStatus.
struct Diagnosis {
  enum Level : std::uint8_t { ok = 0, warning = 1, error = 2 };
  Level level = ok;
  std::string name, message;
  std::vector<std::pair<std::string, std::string>> values;
};

/// Takes results, in threads of the bridge: frames in one, maps in another.
class Sink {
 public:
  Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;
  virtual ~Sink() = default;
  virtual Wanted wanted() = 0;
  virtual void frame(const FrameResult& result) = 0;
  virtual void map(const MapResult& result) = 0;
  virtual void log(Diagnosis::Level level, const std::string& text) = 0;
};

/// Names of the node's parameters, dots between levels, and their values as text: "mapper.map.voxel", "0.2".
using Parameters = std::vector<std::pair<std::string, std::string>>;

/// Topics as the node has resolved them, for messages.
struct Topics {
  std::string image, camera_info, poses, imu, fix;
};

/// What the node itself has to know of the parameters.
struct Settings {
  std::string poses;        ///< "odometry", "pose", "tf", "sensors"
  bool compressed = false;  ///< CompressedImage in
  bool publish_tf = false;
  bool save_on_exit = false;
};
/// A parameter's number as text, with all its digits.
std::string text_of(double value);
/// Reads the parameters. False, with a message that names the parameter, where one is unknown or makes no
/// sense.
bool read_settings(const Parameters& parameters, Settings& settings, std::string& error);

/// Camera and poses in, map out. All functions may be called from any thread.
class Bridge {
 public:
  /// Null, with a message that names the parameter, where one is unknown or makes no sense. Sink and
  /// transforms must outlive it.
  static std::unique_ptr<Bridge> create(const Parameters& parameters, const Topics& topics, Sink& sink,
                                        Transforms& transforms, std::string& error);
  Bridge() = default;
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;
  /// Ends the threads.
  virtual ~Bridge() = default;

  virtual void add(const Image& message) = 0;
  virtual void add(const CameraInfo& message) = 0;
  virtual void add(const PoseMessage& message) = 0;
  virtual void add(const ImuMessage& message) = 0;
  virtual void add(const FixMessage& message) = 0;
  virtual void add(const VelocityMessage& message) = 0;
  virtual void add(const FieldMessage& message) = 0;
  virtual void add(const PressureMessage& message) = 0;

  /// Begins the map anew, and waits until it is done.
  virtual void reset() = 0;
  /// Writes the map to the file of the parameter `map_file`, or to `file`; never over another one.
  /// `message`: the file, or what went wrong.
  virtual bool save_map(const std::string& file, std::string& message) = 0;
  /// The map as it is now. False if nothing was mapped yet.
  virtual bool map_now(const Wanted& wanted, MapResult& result) = 0;
  /// One for each input, one for the mapper.
  virtual std::vector<Diagnosis> diagnose() = 0;
};

}  // namespace pade_ros

#include "pade/io/recording/messages/message_definitions.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>

#include "pade/io/text.hpp"

namespace pade::io {
namespace {

struct Definition {
  std::string_view type;
  std::string_view fields;
  std::string_view parts;  ///< types that it is made of, all the way down
  std::string_view md5;    ///< of those that are written themselves
};

constexpr std::string_view kHeader = "std_msgs/Header";
constexpr std::string_view kRos1Header = "uint32 seq\ntime stamp\nstring frame_id\n";
constexpr std::string_view kRos2Header = "builtin_interfaces/Time stamp\nstring frame_id\n";
constexpr std::string_view kCameraInfo = "sensor_msgs/CameraInfo";

constexpr std::array<Definition, 35> kDefinitions = {{
    {"sensor_msgs/Image",
     "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 "
     "step\nuint8[] "
     "data\n",
     "std_msgs/Header", "060021388200f6f0f447d0fcd9c64743"},
    {"sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n",
     "std_msgs/Header", "8f7a12909da2c9d3332d540a0977563f"},
    {kCameraInfo,
     "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] D\nfloat64[9] "
     "K\nfloat64[9] R\nfloat64[12] P\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n",
     "std_msgs/Header sensor_msgs/RegionOfInterest", "c9a58c1b0b154e0e6da7578cb991d214"},
    {"sensor_msgs/RegionOfInterest",
     "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n", "", ""},
    {"sensor_msgs/Imu",
     "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] "
     "orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\nfloat64[9] "
     "angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\nfloat64[9] "
     "linear_acceleration_covariance\n",
     "std_msgs/Header geometry_msgs/Quaternion geometry_msgs/Vector3", "6a62c6daae103f4ff57a132d6f95cec2"},
    {"sensor_msgs/NavSatFix",
     "uint8 COVARIANCE_TYPE_UNKNOWN=0\nuint8 COVARIANCE_TYPE_APPROXIMATED=1\nuint8 "
     "COVARIANCE_TYPE_DIAGONAL_KNOWN=2\nuint8 COVARIANCE_TYPE_KNOWN=3\nstd_msgs/Header "
     "header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\nfloat64 longitude\nfloat64 "
     "altitude\nfloat64[9] "
     "position_covariance\nuint8 position_covariance_type\n",
     "std_msgs/Header sensor_msgs/NavSatStatus", "2d3a8cd499b9b4a0249fb98fd05cfa48"},
    {"sensor_msgs/NavSatStatus",
     "int8 STATUS_NO_FIX=-1\nint8 STATUS_FIX=0\nint8 STATUS_SBAS_FIX=1\nint8 STATUS_GBAS_FIX=2\nuint16 "
     "SERVICE_GPS=1\nuint16 SERVICE_GLONASS=2\nuint16 SERVICE_COMPASS=4\nuint16 SERVICE_GALILEO=8\nint8 "
     "status\nuint16 service\n",
     "", ""},
    {"sensor_msgs/MagneticField",
     "std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\nfloat64[9] magnetic_field_covariance\n",
     "std_msgs/Header geometry_msgs/Vector3", "2f3b0b43eed0c9501de0fa3ff89a45aa"},
    {"sensor_msgs/FluidPressure", "std_msgs/Header header\nfloat64 fluid_pressure\nfloat64 variance\n",
     "std_msgs/Header", "804dc5cea1c5306d6a2eb80b9833befe"},
    {"nav_msgs/Odometry",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance "
     "pose\ngeometry_msgs/TwistWithCovariance twist\n",
     "std_msgs/Header geometry_msgs/PoseWithCovariance geometry_msgs/Pose geometry_msgs/Point "
     "geometry_msgs/Quaternion geometry_msgs/TwistWithCovariance geometry_msgs/Twist geometry_msgs/Vector3",
     "cd5e73d190d741a2f92e81eda573aca7"},
    {"geometry_msgs/PoseWithCovarianceStamped",
     "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n",
     "std_msgs/Header geometry_msgs/PoseWithCovariance geometry_msgs/Pose geometry_msgs/Point "
     "geometry_msgs/Quaternion",
     "953b798c0f514ff060a53a3498ce6246"},
    {"geometry_msgs/TwistWithCovarianceStamped",
     "std_msgs/Header header\ngeometry_msgs/TwistWithCovariance twist\n",
     "std_msgs/Header geometry_msgs/TwistWithCovariance geometry_msgs/Twist geometry_msgs/Vector3",
     "8927a1a12fb2607ceea095b2dc440a96"},
    {"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n",
     "geometry_msgs/TransformStamped std_msgs/Header geometry_msgs/Transform geometry_msgs/Vector3 "
     "geometry_msgs/Quaternion",
     "94810edda583a504dfda3829e70d7eec"},
    {"geometry_msgs/TransformStamped",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n", "", ""},
    {"geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n", "",
     ""},
    {"geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n", "", ""},
    {"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n", "", ""},
    {"geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n", "", ""},
    {"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n", "", ""},
    {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n", "", ""},
    {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n", "", ""},
    // Of what is shown (display_messages.hpp): only as ROS 2 (Humble) has them.
    {"sensor_msgs/PointCloud2",
     "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool "
     "is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
     "std_msgs/Header sensor_msgs/PointField", ""},
    {"sensor_msgs/PointField",
     "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\nuint8 "
     "FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n",
     "", ""},
    {"sensor_msgs/LaserScan",
     "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\nfloat32 "
     "time_increment\nfloat32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] "
     "intensities\n",
     "std_msgs/Header", ""},
    {"nav_msgs/Path", "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n",
     "std_msgs/Header geometry_msgs/PoseStamped geometry_msgs/Pose geometry_msgs/Point "
     "geometry_msgs/Quaternion",
     ""},
    {"geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n", "", ""},
    {"visualization_msgs/MarkerArray", "visualization_msgs/Marker[] markers\n",
     "visualization_msgs/Marker std_msgs/Header geometry_msgs/Pose geometry_msgs/Point "
     "geometry_msgs/Quaternion geometry_msgs/Vector3 std_msgs/ColorRGBA builtin_interfaces/Duration "
     "sensor_msgs/CompressedImage visualization_msgs/UVCoordinate visualization_msgs/MeshFile",
     ""},
    {"visualization_msgs/Marker",
     "int32 CUBE_LIST=6\nint32 ADD=0\nint32 DELETE=2\nint32 DELETEALL=3\nstd_msgs/Header header\nstring "
     "ns\nint32 id\nint32 type\nint32 action\ngeometry_msgs/Pose pose\ngeometry_msgs/Vector3 "
     "scale\nstd_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\nbool "
     "frame_locked\ngeometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring "
     "texture_resource\nsensor_msgs/CompressedImage texture\nvisualization_msgs/UVCoordinate[] "
     "uv_coordinates\nstring text\nstring mesh_resource\nvisualization_msgs/MeshFile mesh_file\nbool "
     "mesh_use_embedded_materials\n",
     "", ""},
    {"visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n", "", ""},
    {"visualization_msgs/MeshFile", "string filename\nuint8[] data\n", "", ""},
    {"std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n", "", ""},
    {"builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n", "", ""},
    {"diagnostic_msgs/DiagnosticArray", "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n",
     "std_msgs/Header diagnostic_msgs/DiagnosticStatus diagnostic_msgs/KeyValue", ""},
    {"diagnostic_msgs/DiagnosticStatus",
     "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\nstring message\nstring "
     "hardware_id\ndiagnostic_msgs/KeyValue[] values\n",
     "", ""},
    {"diagnostic_msgs/KeyValue", "string key\nstring value\n", "", ""},
}};
constexpr std::string_view kVector = "float64 x\nfloat64 y\nfloat64 z\n";

const Definition* find(std::string_view type) {
  const auto* const found =
      std::find_if(kDefinitions.begin(), kDefinitions.end(),
                   [&](const Definition& definition) { return definition.type == type; });
  return found == kDefinitions.end() ? nullptr : found;
}

std::string fields_of(std::string_view type, MessageEncoding encoding) {
  const bool ros2 = encoding == MessageEncoding::cdr;
  if (type == kHeader) return std::string(ros2 ? kRos2Header : kRos1Header);
  if (type == "geometry_msgs/Vector3") return std::string(kVector);
  if (type == "builtin_interfaces/Time") return "int32 sec\nuint32 nanosec\n";
  std::string fields(find(type)->fields);
  if (ros2 && type == kCameraInfo) {  // ROS 2 writes these names small
    for (const std::string_view name : {" D\n", " K\n", " R\n", " P\n"}) {
      fields[fields.find(name) + 1] = static_cast<char>(name[1] - 'A' + 'a');
    }
  }
  return fields;
}

}  // namespace

std::string message_definition(std::string_view type, MessageEncoding encoding) {
  const Definition* const definition = find(type);
  if (definition == nullptr) return {};
  std::string text = fields_of(type, encoding);
  std::vector<std::string_view> parts;
  for (const std::string_view part : split_fields(definition->parts)) {
    if (!part.empty()) parts.push_back(part);
  }
  if (encoding == MessageEncoding::cdr) parts.emplace_back("builtin_interfaces/Time");
  for (const std::string_view part : parts) {
    text += std::string(80, '=');
    text += fmt::format("\nMSG: {}\n{}", part, fields_of(part, encoding));
  }
  return text;
}

std::string_view message_md5(std::string_view type) {
  const Definition* const definition = find(type);
  return definition == nullptr ? std::string_view() : definition->md5;
}

}  // namespace pade::io

// The node of ROS 1: camera and poses in, obstacle map out (docs/ros.md).
#include <algorithm>
#include <cstdio>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <octomap_msgs/GetOctomap.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <std_srvs/Trigger.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>

#include "bridge.hpp"
#include "conversions.hpp"

// Of the messages as all others know them.
static_assert(ros::message_traits::MD5Sum<octomap_msgs::Octomap>::static_value1 == 0x9a45536b45c5e409ULL &&
              ros::message_traits::MD5Sum<octomap_msgs::Octomap>::static_value2 == 0xcd49f04bb2d9999fULL);

namespace pade_ros {
namespace {

/// The values of the private parameters as text. False if one is a list.
bool flatten(XmlRpc::XmlRpcValue& value, const std::string& name, Parameters& out, std::string& error) {
  using XmlRpc::XmlRpcValue;
  std::ostringstream text;
  switch (value.getType()) {
    case XmlRpcValue::TypeStruct:
      for (auto& [key, field] : value) {
        if (!flatten(field, name.empty() ? key : name + "." + key, out, error)) return false;
      }
      return true;
    case XmlRpcValue::TypeBoolean:
      text << (static_cast<bool>(value) ? "true" : "false");
      break;
    case XmlRpcValue::TypeInt:
      text << static_cast<int>(value);
      break;
    case XmlRpcValue::TypeDouble:
      text << text_of(static_cast<double>(value));
      break;
    case XmlRpcValue::TypeString:
      text << static_cast<std::string>(value);
      break;
    default:
      error = "parameter " + name + " is a list or a date, expected a number, a truth value or a text";
      return false;
  }
  out.emplace_back(name, text.str());
  return true;
}

class Tf : public Transforms {
 public:
  explicit Tf(tf2_ros::Buffer& buffer) : buffer_(buffer) {}
  Answer find(const std::string& target, const std::string& source, Stamp stamp, Placement& out,
              std::string& why) override {
    ros::Time time;
    time.fromNSec(static_cast<std::uint64_t>(std::max<Stamp>(stamp, 0)));
    const std::string what = "from " + source + " to " + target;
    try {
      out = value_of(buffer_.lookupTransform(target, source, time).transform);
      return Answer::valid;
    } catch (const tf2::ExtrapolationException&) {
      try {
        if (buffer_.lookupTransform(target, source, ros::Time(0)).header.stamp < time) {
          why = "no transform " + what + " in time";
          return Answer::not_yet;
        }
      } catch (const tf2::TransformException&) {
      }
      why = "the image is older than the transforms " + what;
      return Answer::never;
    } catch (const tf2::LookupException&) {
      why = "no transform " + what + ": one of the frames is not known";
    } catch (const tf2::TransformException&) {
      why = "no transform " + what + ": the frames are not connected";
    }
    return Answer::not_yet;
  }
  void clear() override { buffer_.clear(); }

 private:
  tf2_ros::Buffer& buffer_;
};

/// Where results go.
class Publishers : public Sink {
 public:
  Publishers(ros::NodeHandle& node, const Settings& settings) : settings_(settings) {
    constexpr bool kLatched = true;
    binary_ = node.advertise<octomap_msgs::Octomap>("octomap_binary", 1, kLatched);
    full_ = node.advertise<octomap_msgs::Octomap>("octomap_full", 1, kLatched);
    markers_ = node.advertise<visualization_msgs::MarkerArray>("occupied_cells_vis_array", 1, kLatched);
    centres_ = node.advertise<sensor_msgs::PointCloud2>("octomap_point_cloud_centers", 1, kLatched);
    grid_ = node.advertise<nav_msgs::OccupancyGrid>("projected_map", 1, kLatched);
    cloud_ = node.advertise<sensor_msgs::PointCloud2>("cloud", 2);
    depth_ = node.advertise<sensor_msgs::Image>("depth", 2);
    sigma_ = node.advertise<sensor_msgs::Image>("sigma", 2);
    path_ = node.advertise<nav_msgs::Path>("path", 1);
  }

  Wanted wanted() override {
    Wanted out;
    out.cloud = cloud_.getNumSubscribers() > 0;
    out.sigma = sigma_.getNumSubscribers() > 0;
    out.binary = binary_.getNumSubscribers() > 0;
    out.full = full_.getNumSubscribers() > 0;
    out.voxels = markers_.getNumSubscribers() > 0 || centres_.getNumSubscribers() > 0;
    out.projected = grid_.getNumSubscribers() > 0;
    return out;
  }
  void frame(const FrameResult& result) override {
    if (cloud_.getNumSubscribers() > 0) cloud_.publish(cloud_of(result));
    if (depth_.getNumSubscribers() > 0) depth_.publish(image_of(result, result.depth));
    if (!result.sigma.empty()) sigma_.publish(image_of(result, result.sigma.data()));
    if (path_.getNumSubscribers() > 0) path_.publish(path_of(result));
    const auto transforms = transforms_of(result, settings_.publish_tf);
    if (!transforms.empty()) broadcaster_.sendTransform(transforms);
  }
  void map(const MapResult& result) override {
    if (binary_.getNumSubscribers() > 0) binary_.publish(octomap_of(result, true));
    if (full_.getNumSubscribers() > 0) full_.publish(octomap_of(result, false));
    if (markers_.getNumSubscribers() > 0) markers_.publish(markers_of(result));
    if (centres_.getNumSubscribers() > 0) centres_.publish(centres_of(result));
    if (grid_.getNumSubscribers() > 0) grid_.publish(grid_of(result));
  }
  void log(Diagnosis::Level level, const std::string& text) override {
    if (level == Diagnosis::error)
      ROS_ERROR("%s", text.c_str());
    else if (level == Diagnosis::warning)
      ROS_WARN("%s", text.c_str());
    else
      ROS_INFO("%s", text.c_str());
  }

 private:
  Settings settings_;
  ros::Publisher binary_, full_, markers_, centres_, grid_, cloud_, depth_, sigma_, path_;
  tf2_ros::TransformBroadcaster broadcaster_;
};

int run() {
  ros::NodeHandle node, own("~");
  Parameters parameters;
  std::string error;
  Settings settings;
  XmlRpc::XmlRpcValue values;
  if (ros::param::get(ros::this_node::getName(), values) && !flatten(values, "", parameters, error)) {
    ROS_FATAL("%s", error.c_str());
    return 1;
  }
  if (!read_settings(parameters, settings, error)) {
    ROS_FATAL("%s (parameters stay with the master until rosparam delete %s)", error.c_str(),
              ros::this_node::getName().c_str());
    return 1;
  }
  tf2_ros::Buffer buffer(ros::Duration(10));
  tf2_ros::TransformListener listener(buffer);
  Tf transforms(buffer);
  Publishers sink(node, settings);

  const std::string image =
      settings.compressed ? node.resolveName("image") + "/compressed" : node.resolveName("image");
  const std::string pose = settings.poses == "pose" ? "pose" : "odometry";
  const Topics topics{image, node.resolveName("camera_info"), node.resolveName(pose), node.resolveName("imu"),
                      node.resolveName("fix")};
  const std::unique_ptr<Bridge> bridge = Bridge::create(parameters, topics, sink, transforms, error);
  if (!bridge) {
    ROS_FATAL("%s", error.c_str());
    return 1;
  }

  const auto hints = ros::TransportHints().tcpNoDelay();
  std::vector<ros::Subscriber> in;
  const auto listen = [&](auto type, const std::string& topic, std::uint32_t queue) {
    using Message = decltype(type);
    in.push_back(node.subscribe<Message>(
        topic, queue,
        [&bridge](const boost::shared_ptr<const Message>& message) { bridge->add(value_of(*message)); },
        ros::VoidConstPtr(), hints));
  };
  if (settings.compressed) {
    in.push_back(node.subscribe<sensor_msgs::CompressedImage>(
        image, 10, [&](const sensor_msgs::CompressedImageConstPtr& m) { bridge->add(value_of(m)); },
        ros::VoidConstPtr(), hints));
  } else {
    in.push_back(node.subscribe<sensor_msgs::Image>(
        image, 10, [&](const sensor_msgs::ImageConstPtr& m) { bridge->add(value_of(m)); },
        ros::VoidConstPtr(), hints));
  }
  listen(sensor_msgs::CameraInfo(), "camera_info", 10);
  if (settings.poses == "odometry") listen(nav_msgs::Odometry(), "odometry", 200);
  if (settings.poses == "pose") listen(geometry_msgs::PoseStamped(), "pose", 200);
  if (settings.poses == "sensors") {
    listen(sensor_msgs::Imu(), "imu", 2000);
    listen(sensor_msgs::NavSatFix(), "fix", 50);
    listen(geometry_msgs::TwistWithCovarianceStamped(), "velocity", 50);
    listen(sensor_msgs::MagneticField(), "magnetic_field", 200);
    listen(sensor_msgs::FluidPressure(), "pressure", 200);
  }

  using Empty = std_srvs::Empty;
  const auto reset =
      own.advertiseService<Empty::Request, Empty::Response>("reset", [&](Empty::Request&, Empty::Response&) {
        bridge->reset();
        return true;
      });
  using Trigger = std_srvs::Trigger;
  const auto save = own.advertiseService<Trigger::Request, Trigger::Response>(
      "save_map", [&](Trigger::Request&, Trigger::Response& response) {
        std::string file;
        own.getParam("map_file", file);  // as it is by now
        response.success = static_cast<std::uint8_t>(bridge->save_map(file, response.message));
        return true;
      });
  using GetOctomap = octomap_msgs::GetOctomap;
  const auto give = [&](bool binary) {
    return [&bridge, binary](GetOctomap::Request&, GetOctomap::Response& response) {
      Wanted wanted;
      (binary ? wanted.binary : wanted.full) = true;
      MapResult result;
      if (!bridge->map_now(wanted, result)) return false;
      response.map = octomap_of(result, binary);
      return true;
    };
  };
  const auto binary =
      node.advertiseService<GetOctomap::Request, GetOctomap::Response>("octomap_binary", give(true));
  const auto full =
      node.advertiseService<GetOctomap::Request, GetOctomap::Response>("octomap_full", give(false));

  ros::Publisher diagnostics = node.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 5);
  const ros::WallTimer timer = node.createWallTimer(ros::WallDuration(1), [&](const ros::WallTimerEvent&) {
    diagnostics.publish(diagnostics_of(bridge->diagnose(), ros::this_node::getName()));
  });

  ROS_INFO("images on %s, calibration on %s, poses: %s", topics.image.c_str(), topics.camera_info.c_str(),
           settings.poses == "tf"        ? "transforms"
           : settings.poses == "sensors" ? (topics.imu + " and " + topics.fix).c_str()
                                         : topics.poses.c_str());
  ros::AsyncSpinner spinner(3);
  spinner.start();
  ros::waitForShutdown();
  spinner.stop();
  if (settings.save_on_exit) {
    std::string message;
    const bool saved = bridge->save_map("", message);
    std::fprintf(stderr, "%s%s\n", saved ? "map saved to " : "map not saved: ", message.c_str());
    if (!saved) return 1;
  }
  return 0;
}

}  // namespace
}  // namespace pade_ros

int main(int argc, char** argv) {
  ros::init(argc, argv, "pade");
  return pade_ros::run();
}

// The node of ROS 2: camera and poses in, obstacle map out (docs/ros.md). Not run yet: see there.
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <octomap_msgs/srv/get_octomap.hpp>
#include <rclcpp/rclcpp.hpp>
#include <std_srvs/srv/empty.hpp>
#include <std_srvs/srv/trigger.hpp>
#include <tf2/exceptions.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>

#include "bridge.hpp"
#include "conversions.hpp"

namespace pade_ros {
namespace {

/// The values of the node's parameters as text; those of ROS itself apart. False if one is a list.
bool flatten(rclcpp::Node& node, Parameters& out, std::string& error) {
  for (const std::string& name : node.list_parameters({}, 0).names) {
    if (name == "use_sim_time" || name.rfind("qos_overrides", 0) == 0 ||
        name == "start_type_description_service")
      continue;
    const rclcpp::Parameter parameter = node.get_parameter(name);
    switch (parameter.get_type()) {
      case rclcpp::ParameterType::PARAMETER_BOOL:
      case rclcpp::ParameterType::PARAMETER_INTEGER:
      case rclcpp::ParameterType::PARAMETER_STRING:
        out.emplace_back(name, parameter.value_to_string());
        break;
      case rclcpp::ParameterType::PARAMETER_DOUBLE:  // of which value_to_string() has six decimals
        out.emplace_back(name, text_of(parameter.as_double()));
        break;
      case rclcpp::ParameterType::PARAMETER_NOT_SET:
        break;
      default:
        error = "parameter " + name + " is a list, expected a number, a truth value or a text";
        return false;
    }
  }
  return true;
}

class Tf : public Transforms {
 public:
  explicit Tf(tf2_ros::Buffer& buffer) : buffer_(buffer) {}
  Answer find(const std::string& target, const std::string& source, Stamp stamp, Placement& out,
              std::string& why) override {
    const tf2::TimePoint time{std::chrono::nanoseconds(stamp)};
    const std::string what = "from " + source + " to " + target;
    try {
      out = value_of(buffer_.lookupTransform(target, source, time).transform);
      return Answer::valid;
    } catch (const tf2::ExtrapolationException&) {
      try {
        const auto newest = buffer_.lookupTransform(target, source, tf2::TimePointZero).header.stamp;
        if (rclcpp::Time(newest).nanoseconds() < stamp) {
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
  Publishers(rclcpp::Node& node, Settings settings)
      : node_(node), settings_(std::move(settings)), broadcaster_(node) {
    const auto latched = rclcpp::QoS(1).reliable().transient_local();
    binary_ = node.create_publisher<octomap_msgs::msg::Octomap>("octomap_binary", latched);
    full_ = node.create_publisher<octomap_msgs::msg::Octomap>("octomap_full", latched);
    markers_ =
        node.create_publisher<visualization_msgs::msg::MarkerArray>("occupied_cells_vis_array", latched);
    centres_ = node.create_publisher<sensor_msgs::msg::PointCloud2>("octomap_point_cloud_centers", latched);
    grid_ = node.create_publisher<nav_msgs::msg::OccupancyGrid>("projected_map", latched);
    cloud_ = node.create_publisher<sensor_msgs::msg::PointCloud2>("cloud", 2);
    depth_ = node.create_publisher<sensor_msgs::msg::Image>("depth", 2);
    sigma_ = node.create_publisher<sensor_msgs::msg::Image>("sigma", 2);
    path_ = node.create_publisher<nav_msgs::msg::Path>("path", 1);
  }

  Wanted wanted() override {
    Wanted out;
    out.cloud = cloud_->get_subscription_count() > 0;
    out.sigma = sigma_->get_subscription_count() > 0;
    out.binary = binary_->get_subscription_count() > 0;
    out.full = full_->get_subscription_count() > 0;
    out.voxels = markers_->get_subscription_count() > 0 || centres_->get_subscription_count() > 0;
    out.projected = grid_->get_subscription_count() > 0;
    return out;
  }
  void frame(const FrameResult& result) override {
    if (cloud_->get_subscription_count() > 0) cloud_->publish(cloud_of(result));
    if (depth_->get_subscription_count() > 0) depth_->publish(image_of(result, result.depth));
    if (!result.sigma.empty()) sigma_->publish(image_of(result, result.sigma.data()));
    if (path_->get_subscription_count() > 0) path_->publish(path_of(result));
    const auto transforms = transforms_of(result, settings_.publish_tf);
    if (!transforms.empty()) broadcaster_.sendTransform(transforms);
  }
  void map(const MapResult& result) override {
    if (binary_->get_subscription_count() > 0) binary_->publish(octomap_of(result, true));
    if (full_->get_subscription_count() > 0) full_->publish(octomap_of(result, false));
    if (markers_->get_subscription_count() > 0) markers_->publish(markers_of(result));
    if (centres_->get_subscription_count() > 0) centres_->publish(centres_of(result));
    if (grid_->get_subscription_count() > 0) grid_->publish(grid_of(result));
  }
  void log(Diagnosis::Level level, const std::string& text) override {
    if (level == Diagnosis::error)
      RCLCPP_ERROR(node_.get_logger(), "%s", text.c_str());
    else if (level == Diagnosis::warning)
      RCLCPP_WARN(node_.get_logger(), "%s", text.c_str());
    else
      RCLCPP_INFO(node_.get_logger(), "%s", text.c_str());
  }

 private:
  rclcpp::Node& node_;
  Settings settings_;
  tf2_ros::TransformBroadcaster broadcaster_;
  rclcpp::Publisher<octomap_msgs::msg::Octomap>::SharedPtr binary_, full_;
  rclcpp::Publisher<visualization_msgs::msg::MarkerArray>::SharedPtr markers_;
  rclcpp::Publisher<sensor_msgs::msg::PointCloud2>::SharedPtr centres_, cloud_;
  rclcpp::Publisher<nav_msgs::msg::OccupancyGrid>::SharedPtr grid_;
  rclcpp::Publisher<sensor_msgs::msg::Image>::SharedPtr depth_, sigma_;
  rclcpp::Publisher<nav_msgs::msg::Path>::SharedPtr path_;
};

int run() {
  const auto node = std::make_shared<rclcpp::Node>(
      "pade", rclcpp::NodeOptions().automatically_declare_parameters_from_overrides(true));
  Parameters parameters;
  std::string error;
  Settings settings;
  if (!flatten(*node, parameters, error) || !read_settings(parameters, settings, error)) {
    RCLCPP_FATAL(node->get_logger(), "%s", error.c_str());
    return 1;
  }
  tf2_ros::Buffer buffer(node->get_clock());
  const tf2_ros::TransformListener listener(buffer);
  Tf transforms(buffer);
  Publishers sink(*node, settings);

  const auto resolved = [&](const std::string& name) {
    return node->get_node_topics_interface()->resolve_topic_name(name);
  };
  // Topics that the user has not renamed are under the image's own name.
  const std::string image = resolved("image") + (settings.compressed ? "/compressed" : "");
  const std::string pose = settings.poses == "pose" ? "pose" : "odometry";
  const Topics topics{image, resolved("camera_info"), resolved(pose), resolved("imu"), resolved("fix")};
  const std::unique_ptr<Bridge> bridge = Bridge::create(parameters, topics, sink, transforms, error);
  if (!bridge) {
    RCLCPP_FATAL(node->get_logger(), "%s", error.c_str());
    return 1;
  }

  // Sensors are lossy, as their drivers offer them; best effort takes reliable ones too.
  const auto lossy = [](std::size_t depth) { return rclcpp::QoS(depth).best_effort(); };
  std::vector<std::shared_ptr<rclcpp::SubscriptionBase>> in;
  const auto listen = [&](auto type, const std::string& topic, std::size_t depth) {
    using Message = decltype(type);
    in.push_back(node->create_subscription<Message>(
        topic, lossy(depth),
        [&bridge](std::shared_ptr<const Message> message) { bridge->add(value_of(*message)); }));
  };
  if (settings.compressed) {
    using Message = sensor_msgs::msg::CompressedImage;
    in.push_back(node->create_subscription<Message>(
        image, lossy(5),
        [&bridge](std::shared_ptr<const Message> message) { bridge->add(value_of(message)); }));
  } else {
    using Message = sensor_msgs::msg::Image;
    in.push_back(node->create_subscription<Message>(
        image, lossy(5),
        [&bridge](std::shared_ptr<const Message> message) { bridge->add(value_of(message)); }));
  }
  listen(sensor_msgs::msg::CameraInfo(), "camera_info", 5);
  if (settings.poses == "odometry") listen(nav_msgs::msg::Odometry(), "odometry", 200);
  if (settings.poses == "pose") listen(geometry_msgs::msg::PoseStamped(), "pose", 200);
  if (settings.poses == "sensors") {
    listen(sensor_msgs::msg::Imu(), "imu", 2000);
    listen(sensor_msgs::msg::NavSatFix(), "fix", 50);
    listen(geometry_msgs::msg::TwistWithCovarianceStamped(), "velocity", 50);
    listen(sensor_msgs::msg::MagneticField(), "magnetic_field", 200);
    listen(sensor_msgs::msg::FluidPressure(), "pressure", 200);
  }

  using Empty = std_srvs::srv::Empty;
  const auto reset = node->create_service<Empty>(
      "~/reset",
      [&](const std::shared_ptr<Empty::Request>, std::shared_ptr<Empty::Response>) { bridge->reset(); });
  using Trigger = std_srvs::srv::Trigger;
  const auto save = node->create_service<Trigger>(
      "~/save_map",
      [&](const std::shared_ptr<Trigger::Request>, std::shared_ptr<Trigger::Response> response) {
        std::string file;
        node->get_parameter("map_file", file);  // as it is by now
        response->success = bridge->save_map(file, response->message);
      });
  using GetOctomap = octomap_msgs::srv::GetOctomap;
  const auto give = [&](bool binary) {
    return [&bridge, binary](const std::shared_ptr<GetOctomap::Request>,
                             std::shared_ptr<GetOctomap::Response> response) {
      Wanted wanted;
      (binary ? wanted.binary : wanted.full) = true;
      MapResult result;
      if (bridge->map_now(wanted, result)) response->map = octomap_of(result, binary);
    };
  };
  const auto binary = node->create_service<GetOctomap>("octomap_binary", give(true));
  const auto full = node->create_service<GetOctomap>("octomap_full", give(false));

  const auto diagnostics = node->create_publisher<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", 5);
  const auto timer = node->create_wall_timer(std::chrono::seconds(1), [&] {
    diagnostics->publish(
        diagnostics_of(bridge->diagnose(), node->get_fully_qualified_name(), node->now().nanoseconds()));
  });

  rclcpp::spin(node);
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
  rclcpp::init(argc, argv);
  const int status = pade_ros::run();
  rclcpp::shutdown();
  return status;
}

#include "pade/simulation/sdf/sdf_repair.hpp"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include <fmt/format.h>
#include <ignition/math/Pose3.hh>

#include "pade/simulation/sdf/sdf_warnings.hpp"

namespace pade::simulation {
namespace {

constexpr std::string_view kSun =
    "<?xml version=\"1.0\"?>\n<sdf version=\"1.5\"><light type=\"directional\" "
    "name=\"sun\"><cast_shadows>true"
    "</cast_shadows><pose>0 0 10 0 0 0</pose><diffuse>0.8 0.8 0.8 1</diffuse><specular>0.2 0.2 0.2 "
    "1</specular>"
    "<direction>-0.5 0.1 -0.9</direction></light></sdf>\n";
constexpr std::string_view kGround =
    "<?xml version=\"1.0\"?>\n<sdf version=\"1.5\"><model name=\"ground_plane\"><static>true</static><link "
    "name=\"link\"><visual name=\"visual\"><cast_shadows>false</cast_shadows><geometry><plane><normal>0 0 "
    "1</normal>"
    "<size>100 100</size></plane></geometry><material><diffuse>0.7 0.7 0.7 "
    "1</diffuse></material></visual></link>"
    "</model></sdf>\n";

std::vector<sdf::ElementPtr> children_of(const sdf::ElementPtr& element) {
  std::vector<sdf::ElementPtr> children;
  for (sdf::ElementPtr child = element->GetFirstElement(); child; child = child->GetNextElement()) {
    children.push_back(child);
  }
  return children;
}

bool has_name(const std::string& element) {
  static const std::set<std::string> kNamed = {"visual", "link",      "sensor", "light",
                                               "model",  "collision", "joint"};
  return kNamed.contains(element);
}

class Repair {
 public:
  explicit Repair(std::string file) : file_(std::move(file)) {}

  void walk(const sdf::ElementPtr& element) {
    if (element->GetName() == "model") drop_dangling_joints(element);
    std::map<std::string, std::set<std::string>> names;  // by kind of element: siblings only
    for (const sdf::ElementPtr& child : children_of(element)) {
      const std::string& kind = child->GetName();
      // Frames may hang on joints, so that these stay where they can.
      if (kind == "collision" || kind == "inertial" || kind == "plugin" || kind == "actor" ||
          is_unknown(child)) {
        element->RemoveChild(child);
        continue;
      }
      if (has_name(kind) && child->HasAttribute("name")) tell_apart(child, names[kind]);
      if (kind == "script") give_uri(child);
      walk(child);
    }
  }

  std::vector<std::string> warnings;

 private:
  /// Warns of a sensor, light or joint of a type that is none.
  bool is_unknown(const sdf::ElementPtr& element) {
    static const std::map<std::string, std::set<std::string>> kTypes = {
        {"sensor",
         {"none",
          "altimeter",
          "camera",
          "contact",
          "depth",
          "depth_camera",
          "force_torque",
          "gps",
          "navsat",
          "gpu_lidar",
          "gpu_ray",
          "imu",
          "lidar",
          "ray",
          "logical_camera",
          "magnetometer",
          "air_pressure",
          "multicamera",
          "rfid",
          "rfidtag",
          "rgbd",
          "rgbd_camera",
          "sonar",
          "thermal",
          "thermal_camera",
          "triggered_camera",
          "segmentation",
          "segmentation_camera",
          "wide_angle_camera",
          "wireless_receiver",
          "wireless_transmitter",
          "custom"}},
        {"light", {"point", "directional", "spot"}},
        {"joint",
         {"ball", "continuous", "fixed", "gearbox", "prismatic", "revolute", "revolute2", "screw",
          "universal"}}};
    const auto known = kTypes.find(element->GetName());
    if (known == kTypes.end() || !element->HasAttribute("type")) return false;
    const auto type = element->Get<std::string>("type");
    if (known->second.contains(type)) return false;
    warnings.push_back(fmt::format("{}: {} of type '{}', which is not known, is left out",
                                   place_of(element, file_), element->GetName(), type));
    return true;
  }

  /// The name of a material is enough; the parser puts "__default__" where a file says nothing.
  static void give_uri(const sdf::ElementPtr& script) {
    if (!script->HasElementDescription("uri")) return;  // of an actor
    const auto uri = script->GetElement("uri");
    const auto text = uri->Get<std::string>();
    if (text.empty() || text == "__default__") {
      uri->Set(std::string("file://media/materials/scripts/gazebo.material"));
    }
  }

  /// A joint to a link that is not there makes libsdformat refuse the whole world.
  void drop_dangling_joints(const sdf::ElementPtr& model) {
    std::set<std::string> names = {"world", "__model__"};
    for (const sdf::ElementPtr& child : children_of(model)) {
      if (child->HasAttribute("name")) names.insert(child->Get<std::string>("name"));
    }
    for (const sdf::ElementPtr& joint : children_of(model)) {
      if (joint->GetName() != "joint") continue;
      for (const char* end : {"parent", "child"}) {
        const auto name = joint->HasElement(end) ? joint->GetElement(end)->Get<std::string>() : std::string();
        if (name.find("::") != std::string::npos || names.contains(name)) continue;
        warnings.push_back(
            fmt::format("{}: joint '{}' has the {} '{}', which is not there: the joint is left out",
                        place_of(joint, file_), joint->Get<std::string>("name"), end, name));
        model->RemoveChild(joint);
        break;
      }
    }
  }

  void tell_apart(const sdf::ElementPtr& element, std::set<std::string>& taken) {
    const auto name = element->Get<std::string>("name");
    if (taken.insert(name).second) return;
    std::string other;
    for (int i = 2; other.empty() || !taken.insert(other).second; ++i) other = fmt::format("{}_{}", name, i);
    element->GetAttribute("name")->Set(other);
    warnings.push_back(fmt::format("{}: {} '{}' is there twice; this one is called '{}'",
                                   place_of(element, file_), element->GetName(), name, other));
  }

  std::string file_;
};

Pose pose_in(const sdf::ElementPtr& element) {
  if (!element->HasElement("pose")) return {};
  const auto p = element->Get<ignition::math::Pose3d>("pose");
  return {Eigen::Quaterniond(p.Rot().W(), p.Rot().X(), p.Rot().Y(), p.Rot().Z()).normalized(),
          {p.Pos().X(), p.Pos().Y(), p.Pos().Z()}};
}

void read_model_state(const sdf::ElementPtr& model, const std::string& prefix, WorldState& state,
                      const std::string& file) {
  const std::string name = prefix + model->Get<std::string>("name");
  state.poses[name] = pose_in(model);
  for (const sdf::ElementPtr& child : children_of(model)) {
    if (child->GetName() == "link") {
      state.poses[name + "::" + child->Get<std::string>("name")] = pose_in(child);
    } else if (child->GetName() == "model") {
      read_model_state(child, name + "::", state, file);
    } else if (child->GetName() == "scale" && child->GetExplicitlySetInFile()) {
      const auto scale = child->Get<ignition::math::Vector3d>();
      if (scale != ignition::math::Vector3d::One) {
        state.warnings.push_back(
            fmt::format("{}: the scale of '{}' in <state> is not applied", place_of(child, file), name));
      }
    }
  }
}

}  // namespace

std::vector<std::string> repair_sdf(const sdf::ElementPtr& root, const std::string& file) {
  Repair repair(file);
  if (root) repair.walk(root);
  return std::move(repair.warnings);
}

bool is_harmless(const sdf::Error& error) {
  switch (error.Code()) {
    case sdf::ErrorCode::MODEL_CANONICAL_LINK_INVALID:
    case sdf::ErrorCode::MODEL_WITHOUT_LINK:
    case sdf::ErrorCode::LINK_INERTIA_INVALID:
    case sdf::ErrorCode::JOINT_CHILD_LINK_INVALID:
    case sdf::ErrorCode::JOINT_PARENT_LINK_INVALID:
    case sdf::ErrorCode::JOINT_PARENT_SAME_AS_CHILD:
    case sdf::ErrorCode::VERSION_DEPRECATED:
    case sdf::ErrorCode::ELEMENT_DEPRECATED:
    case sdf::ErrorCode::ATTRIBUTE_DEPRECATED:
    case sdf::ErrorCode::RESERVED_NAME:
      return true;
    default:
      return false;
  }
}

WorldState read_state(const sdf::ElementPtr& world, const std::string& file) {
  WorldState state;
  if (!world || !world->HasElement("state")) return state;
  for (const sdf::ElementPtr& child : children_of(world->GetElement("state"))) {
    const std::string& kind = child->GetName();
    if (kind == "model" || kind == "light") {
      read_model_state(child, "", state, file);
    } else if (kind == "insertions") {
      for (const sdf::ElementPtr& inserted : children_of(child)) {
        if (inserted->GetName() == "model") state.insertions.push_back(inserted);
      }
    } else if (kind == "deletions") {
      for (const sdf::ElementPtr& name : children_of(child)) {
        if (name->GetName() == "name") state.deletions.push_back(name->Get<std::string>());
      }
    }
  }
  return state;
}

BuiltinModels::BuiltinModels() {
  std::error_code failed;
  const std::filesystem::path parent = std::filesystem::temp_directory_path(failed);
  if (failed) return;
  std::string name = (parent / "pade_models_XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) return;
  folder_ = name;
  for (const auto& [model, text] : {std::pair{"sun", kSun}, std::pair{"ground_plane", kGround}}) {
    const std::filesystem::path folder = std::filesystem::path(folder_) / model;
    std::filesystem::create_directory(folder, failed);
    std::ofstream(folder / "model.sdf") << text;
    std::ofstream(folder / "model.config") << "<?xml version=\"1.0\"?><model><name>" << model
                                           << "</name><sdf version=\"1.5\">model.sdf</sdf></model>\n";
  }
}

BuiltinModels::~BuiltinModels() {
  std::error_code ignored;
  if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

}  // namespace pade::simulation

#include "pade/simulation/sdf/sdf_warnings.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string_view>

#include <fmt/format.h>

#include "pade/io/text.hpp"

namespace pade::simulation {
namespace {

const std::set<std::string>& shown() {
  static const std::set<std::string> names = {"sdf",
                                              "world",
                                              "model",
                                              "link",
                                              "visual",
                                              "geometry",
                                              "pose",
                                              "frame",
                                              "include",
                                              "uri",
                                              "name",
                                              "placement_frame",
                                              "box",
                                              "size",
                                              "sphere",
                                              "radius",
                                              "ellipsoid",
                                              "radii",
                                              "cylinder",
                                              "length",
                                              "capsule",
                                              "plane",
                                              "normal",
                                              "mesh",
                                              "submesh",
                                              "center",
                                              "polyline",
                                              "point",
                                              "script",
                                              "scale",
                                              "material",
                                              "diffuse",
                                              "ambient",
                                              "pbr",
                                              "metal",
                                              "albedo_map",
                                              "cast_shadows",
                                              "transparency",
                                              "light",
                                              "direction",
                                              "intensity",
                                              "scene",
                                              "background",
                                              "sky",
                                              "sensor",
                                              "camera",
                                              "horizontal_fov",
                                              "image",
                                              "width",
                                              "height",
                                              "format",
                                              "distortion",
                                              "k1",
                                              "k2",
                                              "k3",
                                              "p1",
                                              "p2",
                                              "lens",
                                              "intrinsics",
                                              "fx",
                                              "fy",
                                              "cx",
                                              "cy",
                                              "noise",
                                              "type",
                                              "mean",
                                              "stddev",
                                              "bias_mean",
                                              "bias_stddev",
                                              "dynamic_bias_stddev",
                                              "dynamic_bias_correlation_time",
                                              "imu",
                                              "angular_velocity",
                                              "linear_acceleration",
                                              "x",
                                              "y",
                                              "z",
                                              "update_rate",
                                              "pade:pattern",
                                              "xmlns:pade"};
  return names;
}

/// With everything inside: dynamics, contacts, user interfaces, and defaults that do not touch the image.
const std::set<std::string>& without_picture() {
  static const std::set<std::string> names = {"physics",
                                              "gravity",
                                              "magnetic_field",
                                              "atmosphere",
                                              "wind",
                                              "collision",
                                              "inertial",
                                              "joint",
                                              "self_collide",
                                              "kinematic",
                                              "static",
                                              "allow_auto_disable",
                                              "enable_wind",
                                              "velocity_decay",
                                              "must_be_base_link",
                                              "gui",
                                              "spherical_coordinates",
                                              "audio",
                                              "always_on",
                                              "visualize",
                                              "topic",
                                              "enable_metrics",
                                              "gripper",
                                              "specular",
                                              "clip",
                                              "s",
                                              "grid",
                                              "shadows",
                                              "origin_visual",
                                              "precision",
                                              "attenuation",
                                              "state",
                                              "pose_relative_to",
                                              "author",
                                              "description",
                                              "roughness",
                                              "metalness",
                                              "laser_retro",
                                              "visibility_flags"};
  return names;
}

struct Note {
  std::string where;
  int count = 0;
};

void walk(const sdf::ElementPtr& element, const std::string& file, std::map<std::string, Note>& notes) {
  for (sdf::ElementPtr child = element->GetFirstElement(); child; child = child->GetNextElement()) {
    const std::string& name = child->GetName();
    // What is not in the schema stands in the file; the rest may be libsdformat's defaults.
    const bool foreign = !element->HasElementDescription(name);
    if (!foreign && (!child->GetExplicitlySetInFile() || !child->LineNumber())) continue;
    if (without_picture().contains(name)) continue;
    if (!shown().contains(name)) {
      Note& note = notes[fmt::format("<{}> in <{}>", name, element->GetName())];
      if (note.count++ == 0) {
        const std::string& own = child->FilePath();
        note.where = fmt::format("{}:{}", own.empty() || own.front() == '<' ? file : own,
                                 child->LineNumber().value_or(element->LineNumber().value_or(0)));
      }
      continue;  // what is inside goes with it
    }
    walk(child, file, notes);
  }
}

}  // namespace

std::vector<std::string> unsupported_elements(const sdf::ElementPtr& root, const std::string& file) {
  std::map<std::string, Note> notes;
  if (root) walk(root, file, notes);
  std::vector<std::string> sentences;
  for (const auto& [what, note] : notes) {
    sentences.push_back(
        note.count == 1
            ? fmt::format("{}: {} is not supported and left out", note.where, what)
            : fmt::format("{}: {} is not supported and left out, {} times", note.where, what, note.count));
  }
  return sentences;
}

std::string place_of(const sdf::ElementPtr& element, const std::string& file) {
  if (!element) return file;
  const std::string& own = element->FilePath();
  const std::string where = own.empty() || own.front() == '<' ? file : own;
  return element->LineNumber() ? fmt::format("{}:{}", where, *element->LineNumber()) : where;
}

Status check_numbers(const sdf::ElementPtr& root, const std::string& file) {
  static const std::array<std::string_view, 9> numeric = {
      "double", "float", "int", "unsigned int", "vector3", "vector2d", "vector2i", "pose", "color"};
  if (!root || (without_picture().contains(root->GetName()) && root->GetName() != "state")) return {};
  const sdf::ParamPtr value = root->GetValue();
  if (value && std::find(numeric.begin(), numeric.end(), value->GetTypeName()) != numeric.end()) {
    std::istringstream words(value->GetAsString());
    for (std::string word; words >> word;) {
      if (!io::parse_number(word)) {
        return Error{fmt::format("{}: field <{}>: found '{}', expected a number (with a decimal point)",
                                 place_of(root, file), root->GetName(), word)};
      }
    }
  }
  for (sdf::ElementPtr child = root->GetFirstElement(); child; child = child->GetNextElement()) {
    if (const Status s = check_numbers(child, file); !s) return s;
  }
  return {};
}

std::optional<std::string> printed_error(const std::string& printed) {
  static const std::regex colours("\x1b\\[[0-9;]*m");
  std::istringstream lines(std::regex_replace(printed, colours, ""));
  for (std::string line; std::getline(lines, line);) {
    const auto begin = line.find("Error");
    if (begin == std::string::npos || line.find("'robot' element") != std::string::npos) continue;  // no URDF
    const auto text = line.find("] ", begin);  // after "[file.cc:line]"
    std::string message = text == std::string::npos ? line.substr(begin) : line.substr(text + 2);
    while (!message.empty() && (message.back() == '.' || message.back() == '\n' || message.back() == '\r'))
      message.pop_back();
    if (!message.empty()) return message;
  }
  return std::nullopt;
}

}  // namespace pade::simulation

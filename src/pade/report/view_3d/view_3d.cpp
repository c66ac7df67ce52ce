#include "pade/report/view_3d/view_3d.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/report/map_axes.hpp"
#include "pade/report/report_pictures.hpp"
#include "pade/report/report_text.hpp"

namespace pade::evaluation {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMostPoints = 2000;  // of a way
constexpr std::string_view kWayColour = "#ff5fd2", kPlanColour = "#ffffff";

/// As red, green, blue and opacity, 0 to 1.
ordered_json colour_json(std::string_view hex) {
  ordered_json colour = ordered_json::array();
  for (const std::size_t at : {1, 3, 5})
    colour.push_back(std::stoi(std::string(hex.substr(at, 2)), nullptr, 16) / 255.0);
  colour.push_back(1);
  return colour;
}

/// Millimetres are enough, and short.
double to_millimetre(double metres) { return std::round(1e3 * metres) / 1e3; }

ordered_json place_json(const Eigen::Vector3d& point, const MapAxes& axes) {
  ordered_json place = ordered_json::array();
  for (const double value : axes.along(point)) place.push_back(to_millimetre(value));
  return place;
}

/// Of a long way as many points as a picture can show, the first and the last among them.
ordered_json way_json(const std::vector<Eigen::Vector3d>& way, const MapAxes& axes, std::string_view colour) {
  ordered_json points = ordered_json::array();
  const std::size_t count = std::min(way.size(), kMostPoints);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = count > 1 ? i * (way.size() - 1) / (count - 1) : 0;
    for (const auto& value : place_json(way[at], axes)) points.push_back(value);
  }
  return {{"points", std::move(points)}, {"colour", colour_json(colour)}};
}

std::string says_of(const VoxelList& list, const View3d& scene) {
  if (list.voxels == 0) return scene.leaves ? "Nothing is occupied in this map." : "There is no map.";
  const std::string voxels =
      fmt::format("{} occupied voxels of {:g} m", grouped_text(list.voxels), scene.voxel);
  if (list.doublings == 0) return voxels;
  return fmt::format("{},\ndrawn as {} cubes of {:g} m", voxels, grouped_text(list.codes.size()),
                     scene.voxel * std::pow(2.0, list.doublings));
}

/// What stands in a <script> and is no script: nothing in it ends that element.
std::string script_text(const ordered_json& json) {
  std::string text;
  for (const char c : json.dump()) {
    if (c == '<')
      text += "\\u003c";
    else
      text += c;
  }
  return text;
}

std::string key_item(std::string_view colour, std::string_view name) {
  return fmt::format("<span class=\"item\"><span class=\"swatch\" style=\"background:{}\"></span>{}</span>",
                     colour, name);
}

}  // namespace

std::string view_3d(const View3d& scene) {
  if (!scene.leaves && scene.way.empty() && scene.plan.empty()) return {};
  const MapAxes axes = map_axes(scene.up);
  const VoxelList list = scene.leaves ? list_voxels(scene.leaves, scene.most_cubes) : VoxelList();
  const double cube = std::pow(2.0, list.doublings);  // voxels to a side
  constexpr double kMiddleKey = 1U << (mapping::kTreeDepth - 1);
  constexpr std::array kCompass = {" (east)", " (north)", " (up)"};
  ordered_json data = {{"axes", ordered_json::array()}, {"names", ordered_json::array()}};
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d& axis = axes.direction[i];
    data["axes"].push_back({axis.x(), axis.y(), axis.z()});
    data["names"].push_back(axes.name[i] + (scene.is_enu ? kCompass[i] : ""));
  }
  data["north"] = scene.is_enu;
  data["says"] = says_of(list, scene);
  data["side"] = scene.voxel * cube;
  data["zero"] = kMiddleKey / cube;
  data["ways"] = ordered_json::object();
  data["labels"] = ordered_json::array();
  std::string key;
  const auto add = [&](const std::string& name, const std::vector<Eigen::Vector3d>& way,
                       std::string_view colour) {
    if (way.empty()) return;
    data["ways"][name] = way_json(way, axes, colour);
    key += key_item(colour, escape_html(name));
  };
  add(scene.plan_name, scene.plan, kPlanColour);
  add("way of the vehicle", scene.way, kWayColour);
  const std::vector<Eigen::Vector3d>& named = scene.way.empty() ? scene.plan : scene.way;
  if (!named.empty()) {
    data["labels"].push_back({{"words", "start"}, {"at", place_json(named.front(), axes)}});
    data["labels"].push_back({{"words", "end"}, {"at", place_json(named.back(), axes)}});
  }
  data["cubes"] = list.codes.size();
  data["keys"] = base64(encode_voxels(list.codes));
  return fmt::format(
      "<figure class=\"map3d\"><div><p>The view that one can turn needs JavaScript and WebGL 2, and one of "
      "them "
      "is missing here. The pictures of this page show the same map.</p></div>\n<figcaption>Drag to "
      "turn; wheel (once it is clicked) or two fingers to zoom; right button, shift or two fingers to move; "
      "double click for all of it. The squares of the grid say how long they are at its edge. "
      "<span class=\"states\">{}</span></figcaption>\n<script "
      "type=\"application/json\">{}</script></figure>\n",
      key, script_text(data));
}

}  // namespace pade::evaluation

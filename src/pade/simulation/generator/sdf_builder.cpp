#include "pade/simulation/generator/sdf_builder.hpp"

#include <cmath>

#include <fmt/format.h>

namespace pade::simulation {
namespace {

/// Millimetres are enough, and make short files.
std::string number(double value) {
  std::string text = fmt::format("{:.3f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string numbers(const Eigen::Vector3d& v) {
  return number(v.x()) + ' ' + number(v.y()) + ' ' + number(v.z());
}

}  // namespace

SdfBuilder::SdfBuilder(std::string_view world, std::string_view remark) {
  files_.sdf = fmt::format(
      "<?xml version=\"1.0\"?>\n<!-- {} -->\n<sdf version=\"1.9\" "
      "xmlns:pade=\"https://github.com/pade/pade/sdf\">\n"
      "<world name=\"{}\">\n",
      remark, world);
}

void SdfBuilder::light(const Eigen::Vector3d& direction, double sun, double ambient, bool sky) {
  files_.sdf += fmt::format(
      "  <scene><ambient>{0} {0} {1} 1</ambient><background>0.72 0.83 0.95 1</background>{2}</scene>\n"
      "  <light type=\"directional\" name=\"sun\"><direction>{3}</direction><diffuse>1 0.97 0.9 1</diffuse>"
      "<intensity>{4}</intensity><cast_shadows>true</cast_shadows></light>\n",
      number(ambient), number(ambient * 1.06), sky ? "<sky/>" : "", numbers(direction), number(sun));
}

void SdfBuilder::model(std::string_view name) {
  close_model();
  files_.sdf +=
      fmt::format("  <model name=\"{}_{}\"><static>true</static><link name=\"link\">\n", name, ++models_);
  open_ = true;
  visuals_ = 0;
}

void SdfBuilder::close_model() {
  if (open_) files_.sdf += "  </link></model>\n";
  open_ = false;
}

WorldFiles SdfBuilder::finish() {
  close_model();
  files_.sdf += "</world>\n</sdf>\n";
  return std::move(files_);
}

void SdfBuilder::visual(const std::string& geometry, const Eigen::Vector3d& position,
                        const Eigen::Vector3d& rotation, const Finish& finish) {
  if (!open_) model("part");
  std::string pattern;
  if (!finish.pattern.empty()) {
    pattern = "<pade:pattern";
    if (finish.scale != 1) pattern += " scale=\"" + number(finish.scale) + '"';
    if (finish.contrast != 1) pattern += " contrast=\"" + number(finish.contrast) + '"';
    pattern += fmt::format(">{}</pade:pattern>", finish.pattern);
  }
  files_.sdf += fmt::format(
      "    <visual name=\"v{}\"><pose>{} {}</pose><geometry>{}</geometry><material><diffuse>{} "
      "1</diffuse>{}</material></visual>\n",
      ++visuals_, numbers(position), numbers(rotation), geometry, numbers(finish.tint), pattern);
}

void SdfBuilder::box(const Eigen::Vector3d& centre, const Eigen::Vector3d& size, const Finish& finish,
                     const Eigen::Vector3d& rotation) {
  visual(fmt::format("<box><size>{}</size></box>", numbers(size)), centre, rotation, finish);
}

void SdfBuilder::cylinder(const Eigen::Vector3d& centre, double radius, double length, const Finish& finish,
                          const Eigen::Vector3d& rotation) {
  visual(fmt::format("<cylinder><radius>{}</radius><length>{}</length></cylinder>", number(radius),
                     number(length)),
         centre, rotation, finish);
}

void SdfBuilder::rod(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius,
                     const Finish& finish) {
  const Eigen::Vector3d along = to - from;
  // Pitch tips z toward x, yaw turns it about the vertical.
  const double pitch = std::atan2(along.head<2>().norm(), along.z());
  const double yaw = std::atan2(along.y(), along.x());
  cylinder(0.5 * (from + to), radius, along.norm(), finish, {0, pitch, yaw});
}

void SdfBuilder::sphere(const Eigen::Vector3d& centre, double radius, const Finish& finish) {
  visual(fmt::format("<sphere><radius>{}</radius></sphere>", number(radius)), centre, Eigen::Vector3d::Zero(),
         finish);
}

void SdfBuilder::ground(const Eigen::Vector3d& centre, const Eigen::Vector2d& size, const Finish& finish) {
  visual(fmt::format("<plane><normal>0 0 1</normal><size>{} {}</size></plane>", number(size.x()),
                     number(size.y())),
         centre, Eigen::Vector3d::Zero(), finish);
}

void SdfBuilder::mesh(std::string_view file, const Eigen::Vector3d& position, double yaw,
                      const Eigen::Vector3d& scale, const Finish& finish) {
  visual(fmt::format("<mesh><uri>meshes/{}</uri><scale>{}</scale></mesh>", file, numbers(scale)), position,
         {0, 0, yaw}, finish);
}

}  // namespace pade::simulation

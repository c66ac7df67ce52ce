// A world put together from pieces that the bytes choose: it is refused by name or read into shapes that can
// be drawn. The text is always XML, since what is not is the library's to refuse.
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <variant>

#include <unistd.h>

#include "pade/simulation/sdf/sdf_reader.hpp"

#include "expect.hpp"

namespace {

namespace fs = std::filesystem;
using namespace pade::simulation;

/// What the bytes choose from.
constexpr std::array<std::string_view, 84> kElements = {"world",
                                                        "model",
                                                        "link",
                                                        "visual",
                                                        "geometry",
                                                        "pose",
                                                        "frame",
                                                        "include",
                                                        "uri",
                                                        "name",
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
                                                        "height",
                                                        "script",
                                                        "scale",
                                                        "material",
                                                        "diffuse",
                                                        "ambient",
                                                        "pbr",
                                                        "metal",
                                                        "albedo_map",
                                                        "light",
                                                        "direction",
                                                        "intensity",
                                                        "scene",
                                                        "sky",
                                                        "sensor",
                                                        "camera",
                                                        "horizontal_fov",
                                                        "image",
                                                        "width",
                                                        "lens",
                                                        "intrinsics",
                                                        "fx",
                                                        "fy",
                                                        "cx",
                                                        "cy",
                                                        "distortion",
                                                        "k1",
                                                        "noise",
                                                        "type",
                                                        "stddev",
                                                        "imu",
                                                        "angular_velocity",
                                                        "x",
                                                        "update_rate",
                                                        "pade:pattern",
                                                        "state",
                                                        "insertions",
                                                        "deletions",
                                                        "joint",
                                                        "parent",
                                                        "child",
                                                        "collision",
                                                        "inertial",
                                                        "plugin",
                                                        "transparency",
                                                        "placement_frame",
                                                        "empty",
                                                        "heightmap",
                                                        "actor",
                                                        "population",
                                                        "road",
                                                        "gui",
                                                        "physics",
                                                        "background",
                                                        "cast_shadows",
                                                        "static",
                                                        "format",
                                                        "mean"};
constexpr std::array<std::string_view, 32> kValues = {"",
                                                      "0",
                                                      "1",
                                                      "-1",
                                                      "0.5",
                                                      "1 1 1",
                                                      "0 0 0",
                                                      "1 2 3 0.1 0.2 0.3",
                                                      "nan",
                                                      "inf",
                                                      "1e308",
                                                      "1e-320",
                                                      "0,4",
                                                      "1 1",
                                                      "-1 2 3",
                                                      "0 0 1",
                                                      "a",
                                                      "b",
                                                      "a::b",
                                                      "model://a",
                                                      "model://sun",
                                                      "model://ground_plane",
                                                      "mesh.obj",
                                                      "image.png",
                                                      "true",
                                                      "false",
                                                      "gaussian",
                                                      "R8G8B8",
                                                      "Gazebo/Grey",
                                                      "brick",
                                                      "1 0 0 1",
                                                      "640"};
constexpr std::array<std::string_view, 12> kAttributes = {
    " name=\"a\"",        " name=\"b\"",           " name=\"\"",    " name=\"world\"",
    " type=\"camera\"",   " type=\"directional\"", " type=\"imu\"", " relative_to=\"a\"",
    " relative_to=\"b\"", " attached_to=\"a\"",    " scale=\"-1\"", " canonical_link=\"b\""};

/// Reads bytes as choices.
class Choices {
 public:
  Choices(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  [[nodiscard]] bool any() const { return next_ < size_; }
  std::size_t among(std::size_t count) { return next_ < size_ ? data_[next_++] % count : 0; }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t next_ = 0;
};

void write_children(Choices& choices, std::string& out, int depth) {
  constexpr int kDeepest = 12;
  while (choices.any()) {
    const std::size_t what = choices.among(4);
    if (what == 0) return;  // closes the parent
    const std::string_view name = kElements[choices.among(kElements.size())];
    out += "<" + std::string(name);
    const std::size_t attribute = choices.among(2 * kAttributes.size());
    if (attribute < kAttributes.size()) out += kAttributes[attribute];
    out += ">";
    if (what == 1 || depth == kDeepest) {
      out += kValues[choices.among(kValues.size())];
    } else {
      write_children(choices, out, depth + 1);
    }
    out += "</" + std::string(name) + ">\n";
  }
}

void check_shape(const Shape& shape) {
  const auto length = [](double metres) { PADE_EXPECT(std::isfinite(metres) && metres > 0); };
  if (const auto* box = std::get_if<Box>(&shape)) {
    for (const double metres : box->size) length(metres);
  } else if (const auto* ellipsoid = std::get_if<Ellipsoid>(&shape)) {
    for (const double metres : ellipsoid->radii) length(metres);
  } else if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
    length(cylinder->radius);
    length(cylinder->length);
  } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    length(capsule->radius);
    length(capsule->length);
  } else if (const auto* rectangle = std::get_if<Rectangle>(&shape)) {
    for (const double metres : rectangle->size) length(metres);
    length(rectangle->normal.norm());
  } else if (const auto* mesh = std::get_if<Mesh>(&shape)) {
    PADE_EXPECT(mesh->scale.allFinite());
    for (const auto& triangle : mesh->triangles->triangles) {
      for (const auto corner : triangle) {
        PADE_EXPECT(corner < mesh->triangles->vertices.size());
        PADE_EXPECT(mesh->triangles->vertices[corner].allFinite());
      }
    }
  }
}

fs::path folder() {
  static const fs::path made = [] {
    const fs::path folder = fs::temp_directory_path() / ("pade_world_fuzz_" + std::to_string(::getpid()));
    fs::create_directories(folder / "models" / "a");
    std::ofstream(folder / "mesh.obj") << "o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::ofstream(folder / "image.png") << "no image";
    std::ofstream(folder / "models" / "a" / "model.sdf")
        << "<sdf version=\"1.6\"><model name=\"a\"><link name=\"a\"><visual "
           "name=\"a\"><geometry><box><size>1 1 "
           "1</size></box></geometry></visual></link></model></sdf>";
    return folder;
  }();
  return made;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Choices choices(data, size);
  constexpr std::array<std::string_view, 4> kVersions = {"1.6", "1.9", "1.4", "1.11"};
  std::string text = "<?xml version=\"1.0\"?>\n<sdf version=\"" + std::string(kVersions[choices.among(4)]) +
                     "\" xmlns:pade=\"pade\">\n";
  if (choices.among(8) != 0) {
    // The way to what is drawn, which chance would hardly find.
    text += "<world name=\"w\"><model name=\"m\"><link name=\"l\">";
    if (choices.among(4) != 0) {
      text += "<visual name=\"v\"><geometry>";
      write_children(choices, text, 4);
      text += "</geometry>";
      write_children(choices, text, 3);
      text += "</visual>";
    }
    write_children(choices, text, 3);
    text += "</link>";
    write_children(choices, text, 2);
    text += "</model>";
    write_children(choices, text, 1);
    text += "</world>";
  }
  write_children(choices, text, 0);
  text += "</sdf>\n";
  const fs::path file = folder() / "w.sdf";
  std::ofstream(file) << text;
  const auto world = read_sdf(file);
  if (!world) {
    PADE_EXPECT(world.error().message.find(folder().filename().string()) != std::string::npos);
    return 0;
  }
  PADE_EXPECT(world->ambient.allFinite() && world->background.allFinite());
  if (world->sun) PADE_EXPECT(world->sun->direction.allFinite() && world->sun->colour.allFinite());
  for (const Visual& visual : world->visuals) {
    PADE_EXPECT(visual.T_world_shape.is_finite() && visual.material.colour.allFinite());
    PADE_EXPECT(std::abs(visual.T_world_shape.rotation.norm() - 1) < 1e-9);
    check_shape(visual.shape);
  }
  for (const CameraSensor& sensor : world->cameras) {
    PADE_EXPECT(sensor.camera.width > 0 && std::isfinite(sensor.camera.fx) && std::isfinite(sensor.rate));
    PADE_EXPECT(sensor.T_body_camera.is_finite());
  }
  return 0;
}

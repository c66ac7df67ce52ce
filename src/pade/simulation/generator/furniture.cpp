#include "pade/simulation/generator/furniture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace pade::simulation {
namespace {

using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;
constexpr int kTrees = 3;  // different meshes

}  // namespace

Vector3d Furniture::tint(double low, double high) {
  const double base = random_.uniform(low, high);
  return {base * random_.uniform(0.94, 1.0), base * random_.uniform(0.92, 1.0),
          base * random_.uniform(0.86, 1.0)};
}

void Furniture::add_tree_meshes(const TreeShape& shape) {
  for (int i = 0; i < kTrees; ++i) {
    const TreeMeshes tree = grow_tree(shape, random_);
    out_.add_mesh_file(fmt::format("tree{}_wood.obj", i), tree.wood);
    out_.add_mesh_file(fmt::format("tree{}_leaves.obj", i), tree.leaves);
  }
}

void Furniture::add_stone_meshes() {
  for (int i = 0; i < kStones; ++i) out_.add_mesh_file(fmt::format("stone{}.obj", i), break_stone(random_));
}

void Furniture::tree(const Vector3d& foot, double scale) {
  const int kind = static_cast<int>(kTrees * random_.uniform());
  const double yaw = random_.uniform(0, 2 * kPi);
  const Vector3d size = scale * random_.uniform_zyx({0.9, 0.9, 0.9}, {1.15, 1.15, 1.2});
  out_.model("tree");
  out_.mesh(fmt::format("tree{}_wood.obj", kind), foot, yaw, size, {"bark", tint(0.8, 1.0), 0.6});
  out_.mesh(fmt::format("tree{}_leaves.obj", kind), foot, yaw, size, {"leaves", tint(0.8, 1.0)});
}

void Furniture::lamp(const Vector3d& foot, double height, double toward_y) {
  out_.model("lamp");
  out_.rod(foot, foot + Vector3d(0, 0, height), 0.06, finish::metal);
  out_.rod(foot + Vector3d(0, 0, height), foot + Vector3d(0, toward_y, height + 0.15), 0.035, finish::metal);
  out_.box(foot + Vector3d(0, toward_y, height + 0.12), {0.2, 0.5, 0.1}, {"plaster", {0.9, 0.9, 0.87}, 0.3});
  out_.cylinder(foot + Vector3d(0, 0, 0.3), 0.11, 0.6, {"concrete"});
}

void Furniture::car(const Vector3d& at, double yaw) {
  const Finish paint{"concrete", tint(0.5, 1.0), 0.5, 1.2};
  const auto place = [&](double x, double y, double z) -> Vector3d {
    return at + Vector3d(std::cos(yaw) * x - std::sin(yaw) * y, std::sin(yaw) * x + std::cos(yaw) * y, z);
  };
  out_.model("car");
  out_.box(place(0, 0, 0.55), {4.2, 1.75, 0.6}, paint, {0, 0, yaw});
  out_.box(place(-0.2, 0, 1.1), {2.2, 1.55, 0.55}, finish::glass, {0, 0, yaw});
  out_.box(place(-0.2, 0, 1.42), {2.0, 1.5, 0.1}, paint, {0, 0, yaw});
  out_.box(place(2.11, 0.6, 0.62), {0.05, 0.3, 0.15}, {"", {0.9, 0.9, 0.85}}, {0, 0, yaw});
  out_.box(place(2.11, -0.6, 0.62), {0.05, 0.3, 0.15}, {"", {0.9, 0.9, 0.85}}, {0, 0, yaw});
  for (const double x : {-1.3, 1.3}) {
    for (const double y : {-0.8, 0.8})
      out_.cylinder(place(x, y, 0.33), 0.33, 0.22, finish::dark, {kPi / 2, 0, yaw});
  }
}

void Furniture::windows_facing_x(double wall_x, double y0, double y1, double z0, double z1, double side) {
  const int columns = std::max(1, static_cast<int>((y1 - y0) / 2.6));
  const int rows = std::max(1, static_cast<int>((z1 - z0) / 2.9));
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Vector3d centre(wall_x, y0 + (column + 0.5) * (y1 - y0) / columns,
                            z0 + (row + 0.55) * (z1 - z0) / rows);
      out_.box(centre + side * Vector3d(0.01, 0, 0), {0.04, 1.2, 1.5}, finish::glass);
      out_.box(centre + Vector3d(side * 0.06, 0, -0.82), {0.22, 1.5, 0.1}, {"concrete", tint(0.8, 1.0)});
      out_.box(centre + Vector3d(side * 0.03, 0, 0), {0.06, 0.07, 1.5}, {"plaster", {0.95, 0.95, 0.92}, 0.3});
      out_.box(centre + Vector3d(side * 0.04, 0, 0.78), {0.1, 1.36, 0.08},
               {"plaster", {0.95, 0.95, 0.92}, 0.3});
      if (random_.uniform() < 0.3)
        out_.box(centre + Vector3d(side * 0.04, 0.95, 0), {0.05, 0.6, 1.5}, {"bark", tint(0.7, 1.0), 0.5});
    }
  }
}

void Furniture::windows_facing_y(double wall_y, double x0, double x1, double z0, double z1, double side) {
  const int columns = std::max(1, static_cast<int>((x1 - x0) / 2.6));
  const int rows = std::max(1, static_cast<int>((z1 - z0) / 2.9));
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Vector3d centre(x0 + (column + 0.5) * (x1 - x0) / columns, wall_y,
                            z0 + (row + 0.55) * (z1 - z0) / rows);
      out_.box(centre + side * Vector3d(0, 0.01, 0), {1.2, 0.04, 1.5}, finish::glass);
      out_.box(centre + Vector3d(0, side * 0.06, -0.82), {1.5, 0.22, 0.1}, {"concrete", tint(0.8, 1.0)});
      out_.box(centre + Vector3d(0, side * 0.03, 0), {0.07, 0.06, 1.5}, {"plaster", {0.95, 0.95, 0.92}, 0.3});
      if (random_.uniform() < 0.25)
        out_.box(centre + Vector3d(0, side * 0.35, -0.95), {1.6, 0.7, 0.12}, {"concrete"});
    }
  }
}

void Furniture::house(double x0, double x1, double front_y, double depth, double height) {
  const double side = front_y > 0 ? -1 : 1;  // the way out of the front
  const char* const patterns[] = {"brick", "plaster", "plaster", "concrete", "brick"};
  const std::string_view pattern = patterns[static_cast<int>(5 * random_.uniform())];
  out_.model("house");
  out_.box({0.5 * (x0 + x1), front_y - side * 0.5 * depth, 0.5 * height}, {x1 - x0, depth, height},
           {pattern, tint(0.75, 1.0)});
  out_.box({0.5 * (x0 + x1), front_y - side * 0.5 * depth, height + 0.15}, {x1 - x0 + 0.5, depth + 0.5, 0.3},
           {"concrete", tint(0.5, 0.8)});
  out_.box({0.5 * (x0 + x1), front_y + side * 0.05, 0.4}, {x1 - x0, 0.12, 0.8}, {"concrete", tint(0.6, 0.8)});
  windows_facing_y(front_y, x0 + 0.5, x1 - 0.5, 1.0, height - 0.4, side);
  out_.box({x0 + 1.6, front_y + side * 0.08, 1.05}, {1.1, 0.12, 2.1}, {"bark", tint(0.6, 0.9), 1.5});
}

}  // namespace pade::simulation

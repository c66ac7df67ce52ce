#include "pade/simulation/generator/world_generator.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "pade/io/text.hpp"
#include "pade/simulation/generator/furniture.hpp"

namespace pade::simulation {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;

/// The five kinds.
class Generator : Furniture {
 public:
  Generator(std::string_view name, std::uint64_t seed)
      : Furniture(name, fmt::format("Made by pade simulate, random {}, seed {}", name, seed),
                  seed * 1000003 + 17) {}

  WorldFiles building();
  WorldFiles street();
  WorldFiles forest();
  WorldFiles rubble();
  WorldFiles corridor();

 private:
  void scaffold();
  void lift_shaft();
  void hedges();
};

/// Before the tower: two poles, ledgers and boards.
void Generator::scaffold() {
  constexpr double kX = 24.4;
  for (const double y : {17.4, 20.4}) out_.rod({kX, y, 0}, {kX, y, 26}, 0.05, finish::rust);
  for (int i = 1; i <= 8; ++i) {
    const double z = 3.0 * i - 1.1;
    out_.rod({kX, 17.4, z}, {kX, 20.4, z + 0.4 * (i % 2)}, 0.035, finish::rust);
    if (random_.uniform() < 0.6)
      out_.box({kX + 0.5, 18.9, z - 0.1}, {0.9, 3.4, 0.06}, {"bark", tint(0.8, 1.0)});
  }
}

/// Of brick, with a band of concrete at each floor, in front of the tower.
void Generator::lift_shaft() {
  out_.box({25.6, 22.6, 14}, {2.8, 2.4, 28}, {"brick", tint(0.85, 1.0), random_.uniform(0.8, 1.1)});
  for (int floor = 1; floor < 9; ++floor) {
    out_.box({25.6, 22.6, 3.1 * floor}, {2.9, 2.5, 0.25}, {"concrete", tint(0.7, 0.95), 0.6});
    if (random_.uniform() < 0.7) out_.box({24.19, 22.3, 3.1 * floor + 1.4}, {0.1, 0.9, 0.9}, finish::glass);
  }
}

/// Along the walk before the house, with a way to the door.
void Generator::hedges() {
  for (double y = -15; y < 13.5; y += random_.uniform(3.2, 4.4)) {
    if (std::abs(y - 3) < 2.6) continue;
    const double length = random_.uniform(1.8, 2.6);
    const double top = random_.uniform(1.2, 1.9);
    out_.box({22.9, y, 0.25}, {0.7, length + 0.2, 0.5}, {"concrete", tint(0.7, 0.95), 0.5});
    out_.box({22.9, y, 0.5 * (0.5 + top)}, {0.6, length, top - 0.5}, {"leaves", tint(0.8, 1.0), 0.8});
  }
}

WorldFiles Generator::building() {
  out_.light({0.55, 0.35, -0.75}, 0.85, 0.68, true);
  add_tree_meshes(TreeShape::garden());
  out_.model("ground");
  out_.ground({0, 0, 0}, {160, 160}, {"grass"});
  out_.box({22.5, 4, 0.01}, {7, 46, 0.06}, {"concrete"});
  out_.box({6, 3, 0.0}, {32, 3, 0.06}, {"gravel"});
  out_.model("main_house");
  out_.box({32, 0, 4.5}, {12, 30, 9}, {"brick", tint(0.85, 1.0)});
  out_.box({32, 0, 9.2}, {12.8, 30.8, 0.4}, {"concrete", tint(0.6, 0.8)});
  out_.box({25.98, 0, 0.5}, {0.1, 30, 1.0}, {"concrete", tint(0.7, 0.9)});
  windows_facing_x(26, -14.5, 1.6, 1.0, 8.8, -1);
  windows_facing_x(26, 4.4, 14.5, 1.0, 8.8, -1);
  out_.box({25.95, 3, 1.3}, {0.14, 1.8, 2.6}, {"bark", tint(0.6, 0.9), 1.5});
  out_.box({24.9, 3, 2.9}, {2.2, 3.4, 0.2}, {"concrete"});
  for (const double y : {1.6, 4.4}) out_.cylinder({24.1, y, 1.45}, 0.14, 2.9, {"plaster"});
  out_.model("tower");
  out_.box({32, 20, 16}, {10, 10, 32}, {"plaster", tint(0.8, 1.0)});
  windows_facing_x(27, 15.4, 24.6, 1.0, 31, -1);
  for (int floor = 1; floor < 10; ++floor) {
    if (random_.uniform() < 0.3) continue;
    const double y = random_.uniform() < 0.5 ? 17.4 : 19.6;
    out_.box({26.2, y, 3.1 * floor}, {1.6, 3.2, 0.16}, {"concrete"});
    for (int i = 0; i <= 8; ++i)
      out_.rod({25.45, y - 1.55 + 0.387 * i, 3.1 * floor}, {25.45, y - 1.55 + 0.387 * i, 3.1 * floor + 1},
               0.018, finish::metal);
    out_.rod({25.45, y - 1.55, 3.1 * floor + 1}, {25.45, y + 1.55, 3.1 * floor + 1}, 0.03, finish::metal);
  }
  scaffold();
  lift_shaft();
  for (int i = 0; i < 7; ++i) {
    const double height = random_.uniform(2.6, 3.6);
    lamp({22.9, -12.5 + 3.6 * i + random_.uniform(-0.5, 0.5), 0}, height, 0.5);
  }
  hedges();
  for (int i = 0; i < 9; ++i) {
    const double y = -15 + 4 * i + random_.uniform(-1, 1);
    const double x = random_.uniform(23.2, 24.2);
    const double scale = random_.uniform(0.4, 0.6);
    if (std::abs(y - 3) > 1.2 && y < 14) tree({x, y, 0}, scale);
  }
  for (int i = 0; i < 14; ++i) {
    const double side = i % 2 == 0 ? 1 : -1;
    const double x = random_.uniform(-2, 18);
    const double y = 3 + side * random_.uniform(3.4, 10);
    const double scale = random_.uniform(0.6, 1.0);
    const double from_diagonal =
        std::abs(0.7 * (x - 4) + 0.68 * (y - 16.5));  // a lane of the paper's flights
    if (from_diagonal > 1.2 + 2 * scale) tree({x, y, 0}, scale);
  }
  for (int i = 0; i < 24; ++i) {
    const double angle = random_.uniform(0.25 * kPi, 1.75 * kPi);
    const double scale = random_.uniform(1.0, 1.5);
    tree({8 + random_.uniform(22, 45) * std::cos(angle), random_.uniform(22, 45) * std::sin(angle), 0},
         scale);
  }
  for (int i = 0; i < 4; ++i)
    out_.box({13 + 2.0 * i, 0.9 - 0.1 * i, 0.35}, {1.2, 0.45, 0.7}, {"leaves", tint(0.7, 1.0)});
  car({16.5, -8.5, 0.03}, 1.4);
  car({17.5, 12, 0.03}, 1.7);
  return out_.finish();
}

WorldFiles Generator::street() {
  out_.light({0.35, 0.55, -0.7}, 0.85, 0.66, true);
  add_tree_meshes(TreeShape::garden());
  out_.model("ground");
  out_.ground({30, 0, -0.02}, {260, 260}, {"gravel"});
  out_.box({30, 0, -0.05}, {130, 8, 0.1}, {"asphalt"});
  for (const double side : {-1.0, 1.0}) out_.box({30, side * 5.4, 0.0}, {130, 2.8, 0.26}, {"concrete"});
  for (int i = 0; i < 30; ++i)
    out_.box({-30 + 4.0 * i, 0, 0.003}, {1.8, 0.14, 0.006}, {"plaster", {0.97, 0.97, 0.94}, 0.5, 1.5});
  for (const double side : {-1.0, 1.0}) {
    double x = -32;
    while (x < 84) {
      const double width = random_.uniform(7, 13);
      const double height = random_.uniform(5.5, 12.5);
      const double depth = random_.uniform(8, 12);
      house(x, x + width, side * random_.uniform(6.8, 7.8), depth, height);
      x += width + (random_.uniform() < 0.3 ? random_.uniform(1.5, 4) : 0.1);
    }
    for (double at = -26; at < 76; at += random_.uniform(5.5, 9)) {
      const double what = random_.uniform();
      if (what < 0.55) car({at, side * 2.9, 0.0}, side > 0 ? 0.0 : kPi);
      if (what >= 0.35 && what < 0.8)
        lamp({at + 2.6, side * 4.25, 0.1}, random_.uniform(3.5, 5), -side * 1.2);
      if (what >= 0.6) tree({at, side * 4.9, 0.1}, random_.uniform(0.55, 0.8));
    }
    for (double at = -20; at < 70; at += 1.6) {
      if (random_.uniform() < 0.5)
        out_.cylinder({at, side * 4.15, 0.5}, 0.06, 0.9, {"concrete", tint(0.5, 0.9), 0.3, 1.5});
    }
  }
  out_.model("wires");
  for (double at = -10; at < 70; at += random_.uniform(6, 11)) {
    const Vector3d to{at + random_.uniform(-1, 1), 7.2, random_.uniform(4.6, 5.4)};
    out_.rod({at, -7.2, random_.uniform(4.6, 5.4)}, to, 0.02, finish::wire);
  }
  for (double at = 2; at < 64; at += random_.uniform(7, 10)) {  // signs beside the lane
    const double side = random_.uniform() < 0.5 ? -1 : 1;
    out_.rod({at, side * 1.75, 0}, {at, side * 1.75, 2.5}, 0.03, finish::metal);
    out_.box({at, side * 1.75, 2.2}, {0.03, 0.5, 0.5}, {"concrete", tint(0.8, 1.0), 0.3, 2}, {kPi / 4, 0, 0});
  }
  house(84, 110, 30, 60, 11);
  out_.box({88, 0, 5}, {6, 30, 10}, {"brick", tint(0.8, 1.0)});
  windows_facing_x(85, -14, 14, 1, 9.6, -1);
  return out_.finish();
}

WorldFiles Generator::forest() {
  out_.light({0.4, -0.45, -0.8}, 0.95, 0.74, true);
  add_tree_meshes(TreeShape::forest());
  add_stone_meshes();
  out_.model("ground");
  out_.ground({20, 0, 0}, {200, 200}, {"grass", {0.95, 0.9, 0.75}});
  for (int i = -1; i < 10; ++i) {  // the row to be flown around
    const double scale = random_.uniform(0.95, 1.15);
    tree({7.0 * i, random_.uniform(-0.15, 0.15), 0}, scale);
  }
  for (int i = 0; i < 260; ++i) {
    const double x = random_.uniform(-25, 85);
    const double y = random_.uniform(-32, 32);
    const double scale = random_.uniform(0.8, 1.4);
    if (std::abs(y) < 2.7) continue;
    tree({x, y, 0}, scale);
  }
  out_.model("undergrowth");
  for (int i = 0; i < 160; ++i) {
    const double y = random_.uniform(-12, 12);
    const double z = random_.uniform(0, 0.1);
    const double x = random_.uniform(-8, 60);
    const double size = random_.uniform(0.2, 0.7);
    const int kind = static_cast<int>(kStones * random_.uniform());
    const bool bush = random_.uniform() < 0.55;
    const Finish finish =
        bush ? Finish{"leaves", tint(0.7, 1.0)} : Finish{"concrete", tint(0.6, 0.9), 0.5, 1.6};
    const double yaw = random_.uniform(0, 2 * kPi);
    out_.mesh(fmt::format("stone{}.obj", kind), {x, y, z}, yaw, size * Vector3d(1.3, 1, bush ? 1.2 : 0.6),
              finish);
  }
  for (int i = 0; i < 10; ++i) {  // fallen trunks
    const double y = random_.uniform(-10, 10);
    const Vector3d at(random_.uniform(0, 55), y, 0.18);
    const double angle = random_.uniform(0, kPi);
    const Finish bark{"bark", tint(0.7, 1.0), 0.6};
    out_.rod(at, at + random_.uniform(2, 5) * Vector3d(std::cos(angle), std::sin(angle), 0.02), 0.17, bark);
  }
  return out_.finish();
}

WorldFiles Generator::rubble() {
  out_.light({0.3, 0.5, -0.65}, 0.8, 0.7, true);
  add_stone_meshes();
  const auto slab = [&](const Vector3d& at, const Vector3d& size, const Vector3d& turn, bool bare) {
    out_.box(at, size,
             bare ? Finish{"plaster", tint(0.75, 0.95), 1, 0.5} : Finish{"concrete", tint(0.7, 1.0)}, turn);
  };
  out_.model("ground");
  out_.ground({20, 0, 0}, {160, 160}, {"gravel", {0.95, 0.93, 0.9}, 0.8});
  out_.model("hall");
  for (const double side : {-1.0, 1.0}) {
    double x = -14;
    while (x < 62) {
      const double width = random_.uniform(2.5, 6);
      const double height = random_.uniform(1.5, 6);
      const bool bare = random_.uniform() < 0.6;
      const Vector3d turn{random_.uniform(-0.08, 0.08), 0, random_.uniform(-0.06, 0.06)};
      slab({x + 0.5 * width, side * random_.uniform(6.2, 7.4), 0.5 * height}, {width, 0.35, height}, turn,
           bare);
      x += width + (random_.uniform() < 0.35 ? random_.uniform(0.5, 2) : 0.0);
    }
    for (double at = -12; at < 60; at += random_.uniform(3.5, 5)) {
      const double height = random_.uniform(1.2, 5.5);
      const double y = side * random_.uniform(2.8, 4.4);
      slab({at, y, 0.5 * height}, {0.45, 0.45, height},
           {random_.uniform(-0.15, 0.15), random_.uniform(-0.1, 0.1), random_.uniform(0, 1)}, false);
      for (int i = 0; i < 4; ++i) {  // reinforcement that sticks out
        const double top_y = y + random_.uniform(-0.15, 0.15);
        const Vector3d top(at + random_.uniform(-0.15, 0.15), top_y, height);
        out_.rod(top, top + random_.uniform_zyx({-0.4, -0.4, 0.4}, {0.4, 0.4, 1.3}), 0.012, finish::rust);
      }
    }
    for (double at = -8; at < 58; at += random_.uniform(4, 7)) {
      const bool bare = random_.uniform() < 0.4;
      const Vector3d turn{side * random_.uniform(0.5, 0.9), random_.uniform(-0.3, 0.3),
                          random_.uniform(-0.5, 0.5)};
      const Vector3d size{random_.uniform(2, 3.5), random_.uniform(2, 3), 0.22};
      slab({at, side * random_.uniform(3.2, 4.8), random_.uniform(0.8, 1.6)}, size, turn, bare);
    }
  }
  out_.model("poles");
  for (double at = -6; at < 60; at += random_.uniform(2.6, 4.2)) {
    const double side = random_.uniform() < 0.5 ? -1 : 1;
    const double y = side * random_.uniform(1.05, 1.6);
    const bool bare = random_.uniform() < 0.5;
    out_.rod({at, y, 0},
             {at + random_.uniform(-0.2, 0.2), y + side * random_.uniform(0, 0.5), random_.uniform(1.8, 4)},
             bare ? 0.015 : 0.045, bare ? finish::rust : finish::metal);
  }
  for (double at = -4; at < 60; at += random_.uniform(3, 6)) {
    const Vector3d to{at + random_.uniform(-2, 2), 6.3, random_.uniform(2.6, 4.6)};
    out_.rod({at, -6.3, random_.uniform(2.6, 4.6)}, to, 0.008, finish::wire);
  }
  for (double at = 3; at < 60; at += random_.uniform(7, 10)) {
    const Vector3d turn{random_.uniform(-0.12, 0.12), 0, random_.uniform(-0.2, 0.2)};
    slab({at, random_.uniform(-0.6, 0.6), random_.uniform(3.3, 4.2)}, {0.4, 13, 0.45}, turn, false);
  }
  out_.model("stones");
  for (int i = 0; i < 380; ++i) {
    const Vector3d at = random_.uniform_zyx({-12, -6.4, 0}, {62, 6.4, 0.15});
    const double size = std::abs(at.y()) < 1 ? random_.uniform(0.1, 0.5) : random_.uniform(0.2, 1.3);
    const Finish finish =
        random_.uniform() < 0.7 ? Finish{"concrete", tint(0.7, 1.0), 0.6} : Finish{"brick", tint(0.8, 1.0)};
    const double yaw = random_.uniform(0, 2 * kPi);
    const int kind = static_cast<int>(kStones * random_.uniform());
    out_.mesh(fmt::format("stone{}.obj", kind), at, yaw, size * Vector3d(1.2, 1, 0.7), finish);
  }
  slab({64, 0, 4}, {0.4, 22, 8}, {0, -0.05, 0.05}, true);
  windows_facing_x(63.7, -9, 9, 1, 7, -1);
  return out_.finish();
}

WorldFiles Generator::corridor() {
  constexpr double kHalfWidth = 2.2;
  constexpr double kHeight = 3.3;
  constexpr double kFrom = -14;
  constexpr double kTo = 40;
  constexpr double kMiddle = 0.5 * (kFrom + kTo);
  out_.light({0.35, -0.75, -0.75}, 0.95, 0.82, false);
  const Finish wall{"plaster", tint(0.85, 1.0)};
  out_.model("shell");
  out_.box({kMiddle, 0, -0.1}, {kTo - kFrom, 2 * kHalfWidth + 0.6, 0.2},
           {"concrete", {0.8, 0.78, 0.75}, 0.5, 1.4});
  out_.box({kMiddle, 0, kHeight + 0.1}, {kTo - kFrom, 2 * kHalfWidth + 0.6, 0.2},
           {"plaster", {0.95, 0.95, 0.95}});
  out_.box({kMiddle, -kHalfWidth - 0.15, 0.5 * kHeight}, {kTo - kFrom, 0.3, kHeight}, wall);
  out_.box({kMiddle, -kHalfWidth + 0.01, 0.55}, {kTo - kFrom, 0.02, 1.1}, {"concrete", tint(0.5, 0.8), 0.7});
  out_.box({kTo + 0.15, 0, 0.5 * kHeight}, {0.3, 5, kHeight}, {"brick", tint(0.8, 1.0)});
  out_.box({kFrom - 0.15, 0, 0.5 * kHeight}, {0.3, 5, kHeight}, wall);
  // The left wall has windows: sill, lintel, and piers between.
  out_.box({kMiddle, kHalfWidth + 0.15, 0.5}, {kTo - kFrom, 0.3, 1.0}, wall);
  out_.box({kMiddle, kHalfWidth + 0.15, 2.75}, {kTo - kFrom, 0.3, 1.1}, wall);
  for (double at = kFrom; at < kTo; at += 3)
    out_.box({at + 0.6, kHalfWidth + 0.15, 1.6}, {random_.uniform(1.1, 1.7), 0.3, 1.2}, wall);
  out_.model("doors");
  for (double at = kFrom + 2; at < kTo - 2; at += random_.uniform(3, 5)) {
    out_.box({at, -kHalfWidth + 0.03, 1.05}, {0.95, 0.08, 2.1}, {"bark", tint(0.6, 1.0), 1.5});
    for (const double x : {-0.52, 0.52})
      out_.box({at + x, -kHalfWidth + 0.06, 1.07}, {0.09, 0.14, 2.14}, {"plaster", tint(0.5, 1.0), 0.4});
    if (random_.uniform() < 0.6)
      out_.box({at + 1.5, -kHalfWidth + 0.03, 1.6}, {0.9, 0.05, 0.7}, {"leaves", tint(0.8, 1.0), 0.6});
  }
  out_.model("furniture");
  for (double at = kFrom + 3; at < kTo - 1; at += random_.uniform(4, 6)) {
    const double side = random_.uniform() < 0.6 ? 1 : -1;
    out_.box({at, side * (kHalfWidth - 0.18), 0.5 * kHeight}, {0.36, 0.36, kHeight},
             {"concrete", tint(0.8, 1.0)});
    if (random_.uniform() < 0.7)
      out_.box({at + 1.4, side * (kHalfWidth - 0.2), 0.42}, {0.7, 0.38, 0.84},
               {"brick", tint(0.7, 1.0), 0.6});
    if (random_.uniform() < 0.7)
      out_.cylinder({at + 2.3, -side * (kHalfWidth - 0.22), 0.45}, 0.2, 0.9,
                    {"concrete", tint(0.5, 0.95), 0.5, 1.4});
    if (random_.uniform() < 0.6)
      out_.rod({at + 0.8, side * 1.2, 0}, {at + 0.8, side * 1.25, kHeight}, 0.03, finish::metal);
  }
  for (const double y : {1.85, 1.65})
    out_.rod({kFrom, y, kHeight - 0.2}, {kTo, y, kHeight - 0.2}, 0.06, finish::metal);
  out_.rod({kFrom, -1.9, kHeight - 0.15}, {kTo, -1.9, kHeight - 0.15}, 0.02, finish::wire);
  for (double at = kFrom + 2; at < kTo; at += 4) {
    out_.box({at, 0, kHeight - 0.25}, {1.2, 0.2, 0.08}, {"", {0.95, 0.95, 0.9}});
    out_.rod({at, 0, kHeight}, {at, 0, kHeight - 0.22}, 0.01, finish::wire);
  }
  out_.model("outside");
  out_.ground({kMiddle, 0, -0.3}, {200, 200}, {"grass"});
  for (int i = 0; i < 12; ++i) {
    const Finish brick{"brick", tint(0.7, 1.0)};
    const double length = random_.uniform(2, 5);
    out_.box({kFrom + 5.0 * i, random_.uniform(9, 16), random_.uniform(1, 3)}, {length, 2, 6}, brick);
  }
  return out_.finish();
}

/// In the name of a file and in a URI within XML: bytes that mean something there are written as others.
std::string mesh_name(std::string_view world, std::string_view mesh) {
  std::string name;
  for (const char c : world) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || c == '.';
    name += plain ? std::string(1, c) : fmt::format("+{:02x}", static_cast<unsigned char>(c));
  }
  return fmt::format("{}_{}", name, mesh);
}

}  // namespace

WorldFiles generate_world(WorldKind kind, std::uint64_t seed) {
  Generator generator(to_name(kind), seed);
  switch (kind) {
    case WorldKind::building:
      return generator.building();
    case WorldKind::street:
      return generator.street();
    case WorldKind::forest:
      return generator.forest();
    case WorldKind::rubble:
      return generator.rubble();
    case WorldKind::corridor:
      break;
  }
  return generator.corridor();
}

WorldFiles with_own_meshes(const WorldFiles& files, const std::filesystem::path& world_file) {
  const std::string name =
      (world_file.extension() == ".sdf" ? world_file.stem() : world_file.filename()).string();
  WorldFiles own;
  for (const auto& [mesh, content] : files.meshes) own.meshes[mesh_name(name, mesh)] = content;
  constexpr std::string_view kUri = "<uri>meshes/";  // as SdfBuilder::mesh() writes it
  std::string_view rest = files.sdf;
  for (std::size_t at = rest.find(kUri); at != std::string_view::npos; at = rest.find(kUri)) {
    const std::size_t from = at + kUri.size();
    const std::size_t to = std::min(rest.find('<', from), rest.size());
    own.sdf += rest.substr(0, from);
    own.sdf += mesh_name(name, rest.substr(from, to - from));
    rest.remove_prefix(to);
  }
  own.sdf += rest;
  return own;
}

Status write_world(const WorldFiles& files, const fs::path& world_file, io::Overwrite overwrite) {
  const fs::path folder = world_file.parent_path();
  std::vector<std::pair<fs::path, const std::string*>> all;
  for (const auto& [name, content] : files.meshes) all.emplace_back(folder / "meshes" / name, &content);
  all.emplace_back(world_file, &files.sdf);
  if (overwrite == io::Overwrite::refuse) {
    for (const auto& [file, content] : all) {
      std::error_code failed;
      if (!fs::is_regular_file(file, failed)) continue;
      const auto old = io::read_file(file);
      if (old && *old == *content) continue;
      return Error{
          fmt::format("{}: the file exists with another content; choose another name for the world "
                      "or replace it with --force",
                      file.string())};
    }
  }
  for (const auto& [file, content] : all) {
    std::error_code failed;
    if (file.has_parent_path()) fs::create_directories(file.parent_path(), failed);
    if (failed)
      return Error{fmt::format("{}: cannot be made: {}", file.parent_path().string(), failed.message())};
    if (const Status s = io::write_file(file, *content, io::Overwrite::replace); !s) return s;
  }
  return {};
}

}  // namespace pade::simulation

#include "pade/simulation/generator/open_world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include "pade/simulation/generator/furniture.hpp"

namespace pade::simulation {
namespace {

using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;
constexpr double kWest = -12;
constexpr double kEast = 72;
constexpr double kHalfWidth = 25;
constexpr double kWay = 60;         // from start to goal
constexpr double kFreeStart = 2.5;  // around it
constexpr double kFreeGoal = 2;
constexpr double kApart = 1.2;   // between the places of two things
constexpr double kHeight = 1.6;  // of start and goal

class OpenGenerator : Furniture {
 public:
  OpenGenerator(std::string_view kind, std::uint64_t seed, double density, int attempt)
      : Furniture(kind,
                  fmt::format("Made by pade simulate, random {}, seed {}, density {}, attempt {}", kind, seed,
                              density, attempt + 1),
                  (seed * 1000003 + 29) * 64 + static_cast<std::uint64_t>(attempt)),
        density_(density) {}

  OpenWorld forest();
  OpenWorld rubble();
  OpenWorld building_site();
  OpenWorld street();

 private:
  [[nodiscard]] int count(double half_width) const {
    return static_cast<int>(std::lround(density_ * (kEast - kWest) * 2 * half_width / 1e4));
  }
  /// Whether a thing of that reach leaves start and goal free.
  [[nodiscard]] static bool leaves_room(const Vector3d& foot, double reach) {
    const Vector3d level(foot.x(), foot.y(), 0);
    return level.norm() > kFreeStart + reach && (level - Vector3d(kWay, 0, 0)).norm() > kFreeGoal + reach;
  }
  bool place(double half_width, double reach, Vector3d& foot);
  template <class Make>
  void scatter(int things, double half_width, double reach, const Make& make);
  void leaning_trunk(const Vector3d& foot);
  void pillar(const Vector3d& foot);
  void pole(const Vector3d& foot, double radius);
  void slab(const Vector3d& foot);
  void stones(int things, double half_width);
  void wire(double x, double half_width);
  void wall_piece(const Vector3d& foot);
  void scaffold(const Vector3d& foot);
  void stack(const Vector3d& foot);
  OpenWorld finish_world();

  double density_;
  std::vector<Vector3d> taken_;
};

/// A place whose things of that reach leave start and goal free; false if chance finds none.
bool OpenGenerator::place(double half_width, double reach, Vector3d& foot) {
  for (int i = 0; i < 60; ++i) {
    foot = {random_.uniform(kWest, kEast), random_.uniform(-half_width, half_width), 0};
    if (leaves_room(foot, reach) && std::none_of(taken_.begin(), taken_.end(), [&](const Vector3d& other) {
          return (other - foot).norm() < kApart;
        })) {
      taken_.push_back(foot);
      return true;
    }
  }
  return false;
}

template <class Make>
void OpenGenerator::scatter(int things, double half_width, double reach, const Make& make) {
  Vector3d foot;
  for (int i = 0; i < things; ++i) {
    if (place(half_width, reach, foot)) make(foot);
  }
}

OpenWorld OpenGenerator::finish_world() { return {out_.finish(), {0, 0, kHeight}, {kWay, 0, kHeight}}; }

void OpenGenerator::leaning_trunk(const Vector3d& foot) {
  const double azimuth = random_.uniform(0, 2 * kPi);
  const double lean = random_.uniform(0.2, 1.0);
  const double length = random_.uniform(2.5, 5);
  const Finish bark{"bark", tint(0.7, 1.0), 0.6};
  const double radius = random_.uniform(0.06, 0.14);
  out_.rod(foot,
           foot + length * Vector3d(std::sin(lean) * std::cos(azimuth), std::sin(lean) * std::sin(azimuth),
                                    std::cos(lean)),
           radius, bark);
}

OpenWorld OpenGenerator::forest() {
  out_.light({0.4, -0.45, -0.8}, 0.95, 0.74, true);
  add_tree_meshes(TreeShape::forest());
  add_stone_meshes();
  out_.model("ground");
  out_.ground({30, 0, 0}, {220, 200}, {"grass", {0.95, 0.9, 0.75}});
  const int trees = count(kHalfWidth);
  scatter(trees, kHalfWidth, 0.4, [&](const Vector3d& foot) { tree(foot, random_.uniform(0.8, 1.4)); });
  out_.model("undergrowth");
  scatter(trees / 4, kHalfWidth, 1.2, [&](const Vector3d& foot) {
    const double size = random_.uniform(0.8, 1.6);
    const Finish leaves{"leaves", tint(0.7, 1.0)};
    const double height = random_.uniform(1.0, 2.6);
    const double yaw = random_.uniform(0, 2 * kPi);
    const int kind = static_cast<int>(kStones * random_.uniform());
    out_.mesh(fmt::format("stone{}.obj", kind), foot, yaw, size * Vector3d(0.9, 0.8, height), leaves);
  });
  scatter(trees / 16, kHalfWidth, 5, [&](const Vector3d& foot) { leaning_trunk(foot); });
  stones(160, 20);
  return finish_world();
}

void OpenGenerator::pillar(const Vector3d& foot) {
  const double height = random_.uniform(1.2, 5.5);
  const double width = random_.uniform(0.3, 0.6);
  const Vector3d turn{random_.uniform(-0.15, 0.15), random_.uniform(-0.1, 0.1), random_.uniform(0, 1)};
  out_.box(foot + Vector3d(0, 0, 0.5 * height), {width, width, height}, {"concrete", tint(0.7, 1.0)}, turn);
}

void OpenGenerator::pole(const Vector3d& foot, double radius) {
  const Finish& finish = random_.uniform() < 0.5 ? finish::rust : finish::metal;
  out_.rod(foot, foot + random_.uniform_zyx({-0.5, -0.5, 2}, {0.5, 0.5, 4.5}), radius, finish);
}

void OpenGenerator::slab(const Vector3d& foot) {
  const bool bare = random_.uniform() < 0.4;
  const Vector3d turn{random_.uniform(-1, 1), random_.uniform(-0.6, 0.6), random_.uniform(0, 2 * kPi)};
  const Finish finish =
      bare ? Finish{"plaster", tint(0.75, 0.95), 1, 0.5} : Finish{"concrete", tint(0.7, 1.0)};
  const Vector3d size{random_.uniform(1.5, 3), random_.uniform(1, 2.5), 0.22};
  out_.box(foot + Vector3d(0, 0, random_.uniform(0.6, 1.6)), size, finish, turn);
}

/// A stone that would reach into the room about start or goal is drawn like the others and left out, so that
/// nothing else of the world changes with it.
void OpenGenerator::stones(int things, double half_width) {
  constexpr double kReach = 0.7;  // of the mesh, at size 1
  const auto lay = [&](const std::string& file, const Vector3d& at, double yaw, const Vector3d& size,
                       const Finish& finish) {
    if (leaves_room(at, kReach * size.maxCoeff())) out_.mesh(file, at, yaw, size, finish);
  };
  out_.model("stones");
  for (int i = 0; i < things; ++i) {
    const Vector3d at = random_.uniform_zyx({kWest, -half_width, 0}, {kEast, half_width, 0.1});
    const Finish concrete{"concrete", tint(0.6, 0.95), 0.6, 1.4};
    const double size = random_.uniform(0.15, 0.7);
    const double yaw = random_.uniform(0, 2 * kPi);
    const int kind = static_cast<int>(kStones * random_.uniform());
    lay(fmt::format("stone{}.obj", kind), at, yaw, size * Vector3d(1.2, 1, 0.7), concrete);
  }
}

void OpenGenerator::wire(double x, double half_width) {
  const double y = random_.uniform(-half_width, half_width);
  const double reach = random_.uniform(2, 5);
  const double low = random_.uniform(2.2, 4.2);
  out_.rod({x, y - reach, low}, {x + random_.uniform(-1.5, 1.5), y + reach, low + random_.uniform(-0.3, 0.8)},
           0.012, finish::wire);
}

OpenWorld OpenGenerator::rubble() {
  out_.light({0.3, 0.5, -0.65}, 0.8, 0.7, true);
  add_stone_meshes();
  out_.model("ground");
  out_.ground({30, 0, 0}, {220, 200}, {"gravel", {0.95, 0.93, 0.9}, 0.8});
  out_.model("remains");
  scatter(count(kHalfWidth), kHalfWidth, 1.9, [&](const Vector3d& foot) {
    const double what = random_.uniform();
    if (what < 0.35) {
      pillar(foot);
    } else if (what < 0.6) {
      slab(foot);
    } else if (what < 0.8) {
      pole(foot, random_.uniform(0.02, 0.05));
    } else {
      const double size = random_.uniform(0.8, 2.2);
      const Finish brick{"brick", tint(0.8, 1.0)};
      const double height = random_.uniform(0.8, 1.4);
      const double yaw = random_.uniform(0, 2 * kPi);
      const int kind = static_cast<int>(kStones * random_.uniform());
      out_.mesh(fmt::format("stone{}.obj", kind), foot, yaw, size * Vector3d(1.1, 1, height), brick);
    }
  });
  for (double x = 6; x < 56; x += random_.uniform(4, 9)) wire(x, 12);
  stones(420, 20);
  return finish_world();
}

void OpenGenerator::wall_piece(const Vector3d& foot) {
  const double length = random_.uniform(1.5, 4);
  const double height = random_.uniform(1.0, 3.2);
  const double yaw = random_.uniform() < 0.5 ? 0 : 0.5 * kPi;
  out_.box(foot + Vector3d(0, 0, 0.5 * height), {length, 0.24, height},
           random_.uniform() < 0.6 ? Finish{"brick", tint(0.8, 1.0)} : Finish{"concrete", tint(0.7, 1.0)},
           {0, 0, yaw});
}

void OpenGenerator::scaffold(const Vector3d& foot) {
  const double yaw = random_.uniform(0, kPi);
  const Vector3d along(std::cos(yaw), std::sin(yaw), 0);
  for (const double at : {-1.0, 1.0})
    out_.rod(foot + at * along, foot + at * along + Vector3d(0, 0, 4.5), 0.035, finish::rust);
  for (const double z : {0.9, 2.4, 4.0})
    out_.rod(foot - along + Vector3d(0, 0, z), foot + along + Vector3d(0, 0, z), 0.03, finish::metal);
  if (random_.uniform() < 0.5)
    out_.box(foot + Vector3d(0, 0, 2.5), {2.2, 0.7, 0.06}, {"bark", tint(0.8, 1.0)}, {0, 0, yaw});
}

void OpenGenerator::stack(const Vector3d& foot) {
  const double yaw = random_.uniform(0, kPi);
  const double height = random_.uniform(0.6, 2.2);
  const Finish finish =
      random_.uniform() < 0.5 ? Finish{"bark", tint(0.7, 1.0)} : Finish{"brick", tint(0.8, 1.0)};
  out_.box(foot + Vector3d(0, 0, 0.5 * height),
           {random_.uniform(0.8, 1.8), random_.uniform(0.8, 1.4), height}, finish, {0, 0, yaw});
}

OpenWorld OpenGenerator::building_site() {
  out_.light({0.45, -0.3, -0.75}, 0.85, 0.7, true);
  add_stone_meshes();
  out_.model("ground");
  out_.ground({30, 0, 0}, {220, 200}, {"gravel", {0.95, 0.9, 0.82}, 1.1});
  out_.model("site");
  scatter(count(kHalfWidth), kHalfWidth, 2.1, [&](const Vector3d& foot) {
    const double what = random_.uniform();
    if (what < 0.25) {
      out_.box(foot + Vector3d(0, 0, 1.75), {0.35, 0.35, 3.5}, {"concrete", tint(0.75, 1.0)});
    } else if (what < 0.45) {
      wall_piece(foot);
    } else if (what < 0.65) {
      stack(foot);
    } else if (what < 0.8) {
      scaffold(foot);
    } else if (what < 0.95) {
      pole(foot, random_.uniform(0.025, 0.06));
    } else {
      const double yaw = random_.uniform(0, kPi);
      out_.box(foot + Vector3d(0, 0, 1.25), {3.2, 2.2, 2.5}, {"concrete", tint(0.5, 0.9), 0.6, 1.2},
               {0, 0, yaw});
    }
  });
  for (double x = 6; x < 56; x += random_.uniform(5, 11)) wire(x, 12);
  stones(120, 20);
  return finish_world();
}

OpenWorld OpenGenerator::street() {
  constexpr double kHalfStreet = 8.5;
  out_.light({0.35, 0.55, -0.7}, 0.85, 0.66, true);
  add_tree_meshes(TreeShape::garden());
  out_.model("ground");
  out_.ground({30, 0, -0.02}, {260, 260}, {"asphalt"});
  for (const double side : {-1.0, 1.0}) {
    for (double x = -24; x < 84;) {
      const double width = random_.uniform(7, 13);
      const double height = random_.uniform(5.5, 12.5);
      house(x, x + width, side * 9.5, random_.uniform(8, 12), height);
      x += width + 0.1;
    }
  }
  scatter(count(kHalfStreet), kHalfStreet, 2.4, [&](const Vector3d& foot) {
    const double what = random_.uniform();
    if (what < 0.3) {
      car(foot, random_.uniform(-0.3, 0.3));
    } else if (what < 0.55) {
      out_.model("pole");
      pole(foot, random_.uniform(0.04, 0.09));
    } else if (what < 0.75) {
      tree(foot, random_.uniform(0.5, 0.8));
    } else if (what < 0.9) {
      const double toward_y = random_.uniform() < 0.5 ? 1.2 : -1.2;
      lamp(foot, random_.uniform(2.6, 4.5), toward_y);
    } else {
      out_.model("bin");
      out_.cylinder(foot + Vector3d(0, 0, 0.7), 0.45, 1.4, {"concrete", tint(0.5, 0.9), 0.4, 1.4});
    }
  });
  out_.model("wires");
  for (double x = 4; x < 56; x += random_.uniform(3, 7)) wire(x, 5);
  return finish_world();
}

}  // namespace

OpenWorld generate_open_world(OpenWorldKind kind, std::uint64_t seed, double density, int attempt) {
  OpenGenerator generator(to_name(kind), seed, density, attempt);
  switch (kind) {
    case OpenWorldKind::forest:
      return generator.forest();
    case OpenWorldKind::rubble:
      return generator.rubble();
    case OpenWorldKind::building_site:
      return generator.building_site();
    case OpenWorldKind::street:
      break;
  }
  return generator.street();
}

}  // namespace pade::simulation

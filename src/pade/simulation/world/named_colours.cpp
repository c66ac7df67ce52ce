#include "pade/simulation/world/named_colours.hpp"

#include <array>

namespace pade::simulation {
namespace {

struct Entry {
  std::string_view name;
  std::array<double, 3> srgb;
  bool image = false;
};

constexpr std::array kColours = {
    Entry{"Grey", {0.7, 0.7, 0.7}},
    Entry{"Gray", {0.7, 0.7, 0.7}},
    Entry{"DarkGrey", {0.175, 0.175, 0.175}},
    Entry{"DarkGray", {0.175, 0.175, 0.175}},
    Entry{"White", {1, 1, 1}},
    Entry{"FlatBlack", {0.1, 0.1, 0.1}},
    Entry{"Black", {0, 0, 0}},
    Entry{"Red", {1, 0, 0}},
    Entry{"RedBright", {0.87, 0.26, 0.07}},
    Entry{"Green", {0, 1, 0}},
    Entry{"Blue", {0, 0, 1}},
    Entry{"SkyBlue", {0.13, 0.44, 0.7}},
    Entry{"Yellow", {1, 1, 0}},
    Entry{"ZincYellow", {0.9725, 0.9529, 0.2078}},
    Entry{"DarkYellow", {0.7, 0.7, 0}},
    Entry{"Purple", {1, 0, 1}},
    Entry{"Turquoise", {0, 1, 1}},
    Entry{"Orange", {1, 0.5088, 0.0468}},
    Entry{"DarkOrange", {1, 0.5088, 0.0468}},
    Entry{"Indigo", {0.33, 0, 0.5}},
    Entry{"Gold", {0.8, 0.64869, 0.120759}},
    Entry{"Bronze", {0.714, 0.4284, 0.18144}},
    Entry{"Skin", {1, 0.8, 0.6}},
    Entry{"GreyTransparent", {0.5, 0.5, 0.5}},
    Entry{"BlackTransparent", {0.1, 0.1, 0.1}},
    Entry{"RedTransparent", {1, 0, 0}},
    Entry{"GreenTransparent", {0, 1, 0}},
    Entry{"BlueTransparent", {0, 0, 1}},
    Entry{"YellowTransparent", {1, 1, 0}},
    Entry{"OrangeTransparent", {1, 0.44, 0}},
    Entry{"RedGlow", {1, 0, 0}},
    Entry{"GreenGlow", {0, 1, 0}},
    Entry{"BlueGlow", {0, 0, 1}},
    Entry{"YellowGlow", {1, 1, 0}},
    Entry{"PurpleGlow", {1, 0, 1}},
    Entry{"TurquoiseGlow", {0, 1, 1}},
    Entry{"WhiteGlow", {1, 1, 1}},
    Entry{"Wood", {0.55, 0.42, 0.28}, true},
    Entry{"WoodPallet", {0.6, 0.5, 0.38}, true},
    Entry{"WoodFloor", {0.5, 0.36, 0.24}, true},
    Entry{"Bricks", {0.55, 0.35, 0.28}, true},
    Entry{"Road", {0.3, 0.3, 0.3}, true},
    Entry{"Residential", {0.4, 0.4, 0.38}, true},
    Entry{"Tertiary", {0.4, 0.4, 0.38}, true},
    Entry{"Pedestrian", {0.6, 0.58, 0.55}, true},
    Entry{"Footway", {0.6, 0.58, 0.55}, true},
    Entry{"Motorway", {0.3, 0.3, 0.3}, true},
    Entry{"Lanes_6", {0.3, 0.3, 0.3}, true},
    Entry{"Grass", {0.3, 0.42, 0.2}, true},
    Entry{"CeilingTiled", {0.8, 0.8, 0.78}, true},
    Entry{"PaintedWall", {0.8, 0.78, 0.72}, true},
    Entry{"Stones", {0.5, 0.48, 0.45}, true},
    Entry{"Rocky", {0.48, 0.42, 0.36}, true},
    Entry{"GrassFloor", {0.3, 0.42, 0.2}, true},
    Entry{"LightWood", {0.7, 0.58, 0.42}, true},
    Entry{"CloudySky", {0.6, 0.7, 0.85}, true},
    Entry{"EpuckPlane", {0.6, 0.6, 0.6}, true},
    Entry{"PioneerBody", {0.5, 0, 0}, true},
};

}  // namespace

std::optional<NamedColour> gazebo_colour(std::string_view name) {
  constexpr std::string_view kPrefix = "Gazebo/";
  if (!name.starts_with(kPrefix)) return std::nullopt;
  name.remove_prefix(kPrefix.size());
  for (const Entry& entry : kColours) {
    if (entry.name == name) return NamedColour{{entry.srgb[0], entry.srgb[1], entry.srgb[2]}, entry.image};
  }
  return std::nullopt;
}

}  // namespace pade::simulation

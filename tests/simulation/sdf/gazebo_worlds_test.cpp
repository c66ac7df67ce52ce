// Worlds as people bring them: which surface a ray along +x from (-8, y, z) meets, how far away, in what
// colour.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/simulation/render/scene.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"
#include "pade/simulation/world/mesh_file.hpp"

namespace pade::simulation {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr double kAnyColour = -1;

/// A ray along +x from (-8, y, z).
struct Probe {
  double y, z;
  double distance;
  Vector3d srgb = Vector3d::Constant(kAnyColour);
  const char* visual = nullptr;  ///< part of the name of what is hit; null = any
};

struct Case {
  const char* name;
  std::string world;  ///< inside <world>
  std::vector<Probe> probes;
  std::map<std::string, std::string> files = {};  ///< beside the world
  const char* warning = nullptr;                  ///< part of one; null = there are none
  const char* version = "1.6";
};

/// A box of a COLLADA file, with corners in the unit of the file.
struct Part {
  std::string name;
  Vector3d least, most;
};

std::string dae(const std::vector<Part>& parts, const std::string& up = "Z_UP", double unit = 1,
                const std::string& image = "") {
  std::string diffuse = "<color>0.8 0.2 0.2 1</color>";
  std::string images;
  std::string parameters;
  if (!image.empty()) {
    images = "<library_images><image id=\"i\"><init_from>" + image + "</init_from></image></library_images>";
    parameters =
        "<newparam sid=\"f\"><surface type=\"2D\"><init_from>i</init_from></surface></newparam><newparam "
        "sid=\"s\"><sampler2D><source>f</source></sampler2D></newparam>";
    diffuse = "<texture texture=\"s\" texcoord=\"UV\"/>";
  }
  std::string geometries;
  std::string nodes;
  for (const Part& part : parts) {
    std::string corners;
    for (int i = 0; i < 8; ++i) {
      corners += fmt::format("{} {} {} ", (i & 4 ? part.most : part.least).x(),
                             (i & 2 ? part.most : part.least).y(), (i & 1 ? part.most : part.least).z());
    }
    const std::string n = part.name;
    geometries += "<geometry id=\"" + n + "-g\" name=\"" + n + "\"><mesh><source id=\"" + n +
                  "-p\"><float_array id=\"" + n + "-a\" count=\"24\">" + corners +
                  "</float_array><technique_common><accessor source=\"#" + n +
                  "-a\" count=\"8\" stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" "
                  "type=\"float\"/><param "
                  "name=\"Z\" type=\"float\"/></accessor></technique_common></source><source id=\"" +
                  n + "-u\"><float_array id=\"" + n +
                  "-ua\" count=\"6\">0 0 1 0 1 1</float_array><technique_common><accessor "
                  "source=\"#" +
                  n +
                  "-ua\" count=\"3\" stride=\"2\"><param name=\"S\" type=\"float\"/><param name=\"T\" "
                  "type=\"float\"/></accessor></technique_common></source><vertices id=\"" +
                  n + "-v\"><input semantic=\"POSITION\" source=\"#" + n +
                  "-p\"/></vertices><triangles count=\"12\" "
                  "material=\"m\"><input semantic=\"VERTEX\" source=\"#" +
                  n +
                  "-v\" offset=\"0\"/><input semantic=\"TEXCOORD\" "
                  "source=\"#" +
                  n +
                  "-u\" offset=\"1\" set=\"0\"/><p>"
                  "0 0 1 1 3 2 0 0 3 1 2 2 4 0 6 1 7 2 4 0 7 1 5 2 0 0 4 1 5 2 0 0 5 1 1 2 "
                  "2 0 3 1 7 2 2 0 7 1 6 2 0 0 2 1 6 2 0 0 6 1 4 2 1 0 5 1 7 2 1 0 7 1 3 "
                  "2</p></triangles></mesh></geometry>";
    nodes +=
        "<node id=\"" + n + "\" name=\"" + n + "\"><instance_geometry url=\"#" + n +
        "-g\"><bind_material><technique_common><instance_material symbol=\"m\" "
        "target=\"#mat\"><bind_vertex_input "
        "semantic=\"UV\" input_semantic=\"TEXCOORD\" "
        "input_set=\"0\"/></instance_material></technique_common></bind_material></instance_geometry></node>";
  }
  return fmt::format(
      "<?xml version=\"1.0\"?><COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" "
      "version=\"1.4.1\"><asset>"
      "<unit name=\"u\" meter=\"{}\"/><up_axis>{}</up_axis></asset>{}<library_effects><effect "
      "id=\"e\"><profile_COMMON>{}<technique "
      "sid=\"c\"><lambert><diffuse>{}</diffuse></lambert></technique></profile_COMMON></effect></"
      "library_effects>"
      "<library_materials><material id=\"mat\" name=\"mat\"><instance_effect "
      "url=\"#e\"/></material></library_materials><library_geometries>{}</"
      "library_geometries><library_visual_scenes>"
      "<visual_scene id=\"S\" "
      "name=\"S\">{}</visual_scene></library_visual_scenes><scene><instance_visual_scene "
      "url=\"#S\"/></scene></COLLADA>",
      unit, up, images, parameters, diffuse, geometries, nodes);
}

const Part kPillar{"pillar", {-0.25, -0.25, 0}, {0.25, 0.25, 4}};
const std::vector<Part> kPosts = {{"left", {-0.2, 0.8, 0}, {0.2, 1.2, 3}},
                                  {"right", {-0.2, -1.2, 0}, {0.2, -0.8, 3}}};

const std::string kSun =
    "<light type='directional' name='sun'><direction>0.4 0.3 -0.9</direction><diffuse>0.8 0.8 0.8 "
    "1</diffuse></light>";

std::string visual(const std::string& inside, const std::string& name = "v") {
  return "<visual name='" + name + "'>" + inside + "</visual>";
}
std::string model(const std::string& link, const std::string& before = "", const std::string& name = "m") {
  return "<model name='" + name + "'><static>true</static>" + before + "<link name='l'>" + link +
         "</link></model>";
}
std::string mesh(const std::string& uri, const std::string& more = "") {
  return visual("<geometry><mesh><uri>" + uri + "</uri>" + more + "</mesh></geometry>");
}
/// A box of 1 x 1 x 2 m on the ground, with a material.
std::string box(const std::string& material = "", const std::string& pose = "0 0 1 0 0 0",
                const std::string& name = "v") {
  return visual("<pose>" + pose + "</pose><geometry><box><size>1 1 2</size></box></geometry>" + material,
                name);
}
std::string script(const std::string& name) {
  return "<material><script><uri>file://media/materials/scripts/gazebo.material</uri><name>" + name +
         "</name></script></material>";
}
std::string diffuse(const std::string& colour) {
  return "<material><diffuse>" + colour + " 1</diffuse></material>";
}
std::string model_file(const std::string& name, const std::string& inside) {
  return "<?xml version='1.0'?><sdf version='1.6'><model name='" + name + "'><static>true</static>" + inside +
         "</model></sdf>";
}
std::string include(const std::string& name, const std::string& more = "") {
  return "<include><uri>model://" + name + "</uri>" + more + "</include>";
}

/// A square polyline around (0, y), half a side wide in both directions.
std::string square(double half, double height, double y = 0) {
  return fmt::format(
      "<polyline><point>{0} {1}</point><point>{2} {1}</point><point>{2} {3}</point><point>{0} {3}"
      "</point><height>{4}</height></polyline>",
      -half, y - half, half, y + half, height);
}

const Vector3d kBrown(0.7, 0.5, 0.3);
const std::string kBrownBox = "<link name='l'>" + box(diffuse("0.7 0.5 0.3")) + "</link>";

std::vector<Case> cases() {
  const std::string moved =
      "<state world_name='w'><model name='m'><pose>0 0 1 0 0 0</pose><link name='l'><pose>0 0 1 0 0 "
      "0</pose></link></model></state>";
  return {
      {"DaeZUpStands",
       model(mesh("p.dae")),
       {{0, 3.5, 7.75}, {1, 0.1, kNothing}},
       {{"p.dae", dae({kPillar})}}},
      {"DaeYUpStandsAsInTheFile",
       model(mesh("p.dae")),
       {{0, 3.5, 7.75}},
       {{"p.dae", dae({kPillar}, "Y_UP")}}},
      {"DaeXUpStandsAsInTheFile",
       model(mesh("p.dae")),
       {{0, 3.5, 7.75}},
       {{"p.dae", dae({kPillar}, "X_UP")}}},
      {"DaeInCentimetres",
       model(mesh("p.dae")),
       {{0, 3.5, 7.75}, {0, 4.5, kNothing}},
       {{"p.dae", dae({{"p", {-25, -25, 0}, {25, 25, 400}}}, "Z_UP", 0.01)}}},
      {"DaeHasItsColour",
       model(mesh("p.dae")),
       {{0, 3.5, 7.75, {0.8, 0.2, 0.2}}},
       {{"p.dae", dae({kPillar})}}},
      {"MeshScaled",
       model(mesh("p.dae", "<scale>1 1 0.5</scale>")),
       {{0, 1.5, 7.75}, {0, 2.5, kNothing}},
       {{"p.dae", dae({kPillar})}}},
      {"SubmeshIsTheOnePart",
       model(mesh("t.dae", "<submesh><name>left</name></submesh>")),
       {{1, 1, 7.8}, {-1, 1, kNothing}},
       {{"t.dae", dae(kPosts)}}},
      {"SubmeshTheOther",
       model(mesh("t.dae", "<submesh><name>right</name><center>false</center></submesh>")),
       {{1, 1, kNothing}, {-1, 1, 7.8}},
       {{"t.dae", dae(kPosts)}}},
      {"SubmeshCentred",
       model(mesh("t.dae", "<submesh><name>left</name><center>true</center></submesh>")),
       {{0, 1, 7.8}, {0, 1.6, kNothing}, {1, 1, kNothing}},
       {{"t.dae", dae(kPosts)}}},
      {"SubmeshInCentimetresAndScaled",
       model(mesh("t.dae", "<submesh><name>b</name></submesh><scale>1 1 2</scale>")),
       {{0, 3.5, 7.75}},
       {{"t.dae",
         dae({{"a", {300, 0, 0}, {400, 100, 100}}, {"b", {-25, -25, 0}, {25, 25, 200}}}, "Z_UP", 0.01)}}},
      {"ImageBesideTheMesh",
       model(mesh("p.dae")),
       {{0, 3.5, 7.75, {1, 1, 1}}},
       {{"p.dae", dae({kPillar}, "Z_UP", 1, "wall.png")}, {"wall.png", ""}}},
      {"ImageInMaterialsTextures",
       include("crate"),
       {{0, 3.5, 7.75, {1, 1, 1}}},
       {{"models/crate/model.sdf",
         model_file("crate", "<link name='l'>" + mesh("model://crate/meshes/c.dae") + "</link>")},
        {"models/crate/meshes/c.dae", dae({kPillar}, "Z_UP", 1, "wall.png")},
        {"models/crate/materials/textures/wall.png", ""}}},
      {"ImageByModelUri",
       include("crate"),
       {{0, 3.5, 7.75, {1, 1, 1}}},
       {{"models/crate/model.sdf", model_file("crate", "<link name='l'>" + mesh("meshes/c.dae") + "</link>")},
        {"models/crate/meshes/c.dae", dae({kPillar}, "Z_UP", 1, "model://crate/wall.png")},
        {"models/crate/wall.png", ""}}},
      {"ImageMissingWarns",
       model(mesh("p.dae")),
       {{0, 3.5, 7.75}},
       {{"p.dae", dae({kPillar}, "Z_UP", 1, "gone.png")}},
       "gone.png: no such texture image"},
      {"NamedOrange",
       model(box(script("Gazebo/Orange"))),
       {{0, 1, 7.5, {1, 0.5088, 0.0468}}},
       {},
       "Gazebo/Orange is drawn in its plain colour"},
      {"NamedRedWithoutUri",
       model(box("<material><script><name>Gazebo/Red</name></script></material>")),
       {{0, 1, 7.5, {1, 0, 0}}},
       {},
       "Gazebo/Red"},
      {"NamedWoodIsAnImage",
       model(box(script("Gazebo/Wood"))),
       {{0, 1, 7.5, {0.55, 0.42, 0.28}}},
       {},
       "mean colour"},
      {"UnknownScriptIsVisible",
       model(box(script("My/Own"))),
       {{0, 1, 7.5, {0.854, 0.854, 0.854}}},
       {},
       "My/Own is not known"},
      {"AmbientWithoutDiffuse",
       model(box("<material><ambient>0.2 0.4 0.6 1</ambient></material>")),
       {{0, 1, 7.5, {0.2, 0.4, 0.6}}},
       {},
       "<ambient> colour is taken"},
      {"DiffuseBeatsScript",
       model(box("<material><diffuse>0.1 0.9 0.1 "
                 "1</diffuse><script><uri>x</uri><name>Gazebo/Red</name></script></material>")),
       {{0, 1, 7.5, {0.1, 0.9, 0.1}}},
       {},
       "the <diffuse> colour is taken"},
      {"BlackWhereItIsAskedFor", model(box(diffuse("0 0 0"))), {{0, 1, 7.5, {0, 0, 0}}}},
      {"StateMovesAModel",
       model(box(), "<pose>0 5 0 0 0 0</pose>") + moved,
       {{0, 2.5, 7.5}, {5, 1, kNothing}}},
      {"StateInserts",
       model(box()) + "<state world_name='w'><insertions>" +
           model(box(), "<pose>0 3 0 0 0 0</pose>", "late") + "</insertions></state>",
       {{0, 1, 7.5}, {3, 1, 7.5}}},
      {"StateDeletes",
       model(box()) + model(box(), "<pose>0 3 0 0 0 0</pose>", "gone") +
           "<state world_name='w'><deletions><name>gone</name></deletions></state>",
       {{0, 1, 7.5}, {3, 1, kNothing}}},
      {"IncludeInsideIncluded",
       include("a"),
       {{0, 2.5, 7.5, kBrown}, {0, 0.5, kNothing}},
       {{"models/a/model.sdf", model_file("a", include("b", "<name>b1</name><pose>0 0 1 0 0 0</pose>"))},
        {"models/b/model.sdf", model_file("b", kBrownBox)}}},
      {"ModelsBesideTheWorldsFolder",
       include("b"),
       {{0, 1, 7.5, kBrown}},
       {{"../models/b/model.sdf", model_file("b", kBrownBox)}}},
      {"SunAndGroundPlaneAreBuiltIn",
       "<include><uri>model://sun</uri></include>" + include("ground_plane") + model(box()),
       {{0, 1, 7.5}, {3, 0.5, kNothing}}},
      {"PolylineIsRaised",
       model(visual("<geometry><polyline><point>-0.5 -0.5</point><point>-0.5 0.5</point><point>0.5 "
                    "0.5</point><point>0.5 "
                    "-0.5</point><height>2</height></polyline></geometry>")),
       {{0, 1.9, 7.5}, {0, 2.1, kNothing}, {0.6, 1, kNothing}}},
      {"PolylineWithANotch",
       model(visual("<geometry><polyline><point>-1 -1</point><point>1 -1</point><point>1 1</point><point>-1 "
                    "1</point><point>-1 0.5</point><point>0 0.5</point><point>0 -0.5</point><point>-1 "
                    "-0.5</point><height>1</height></polyline></geometry>")),
       {{0, 0.5, 8}, {0.8, 0.5, 7}, {-0.8, 0.5, 7}}},
      {"PolylineWithAHole",
       model(visual("<geometry>" + square(1, 1) + square(0.5, 1) + "</geometry>")),
       {{0, 0.5, 7}, {0.75, 0.5, 7}, {1.1, 0.5, kNothing}}},
      {"PolylineRingSeenThroughItsGap",
       model(visual("<pose>0 0 1 0 1.5707963267948966 0</pose><geometry>" + square(1, 0.5) +
                    square(0.5, 0.5) + "</geometry>")),
       {{0, 1, kNothing}, {0.75, 1, 8}, {0, 1.75, 8}, {0, 2.1, kNothing}}},
      {"PolylineInAHoleOfAnother",
       model(visual("<pose>0 0 1 0 1.5707963267948966 0</pose><geometry>" + square(1, 0.5) +
                    square(0.6, 0.5) + square(0.3, 0.5) + "</geometry>")),
       {{0, 1, 8}, {0.45, 1, kNothing}, {0.8, 1, 8}}},
      {"PolylinesBesideEachOther",
       model(visual("<geometry>" + square(0.5, 1) + square(0.5, 1, 3) + "</geometry>")),
       {{0, 0.5, 7.5}, {1.5, 0.5, kNothing}, {3, 0.5, 7.5}}},
      {"PolylinesOfTwoHeights",
       model(visual("<geometry>" + square(0.5, 1) + square(0.5, 2, 3) + "</geometry>")),
       {{3, 0.5, 7.5}, {3, 1.5, kNothing}},
       {},
       "one height, 1 m of the first"},
      {"StateMovesALink",
       "<model name='m'><static>true</static><link name='l'>" +
           box(diffuse("0 1 0"), "0 0 1 0 0 0", "green") + "</link><link name='k'>" +
           box(diffuse("1 0 0"), "0 0 1 0 0 0", "red") +
           "</link></model><state world_name='w'><model name='m'><link name='k'><pose>0 2 0 0 0 "
           "0</pose></link>"
           "</model></state>",
       {{0, 1, 7.5, {0, 1, 0}, "green"}, {2, 1, 7.5, {1, 0, 0}, "red"}}},
      {"TheNearerHidesTheFarther",
       model(box(diffuse("0 0 1"), "-2 0 1 0 0 0", "near") + box(diffuse("1 1 0"), "2 0.8 1 0 0 0", "far")),
       {{0, 1, 5.5, {0, 0, 1}, "near"}, {0.45, 1, 5.5, {0, 0, 1}, "near"}, {0.55, 1, 9.5, {1, 1, 0}, "far"}}},
      {"IncludedTwiceUnderTwoNames",
       include("b", "<name>left</name><pose>0 2 0 0 0 0</pose>") +
           include("b", "<name>right</name><pose>0 -2 0 0 0 0</pose>"),
       {{2, 1, 7.5, kBrown, "left"}, {-2, 1, 7.5, kBrown, "right"}, {0, 1, kNothing}},
       {{"models/b/model.sdf", model_file("b", kBrownBox)}}},
      {"NothingThatIsNotSeenRefuses",
       "<physics type='ode'><max_step_size>-1</max_step_size></physics><gui><camera name='g'/></gui>"
       "<model name='m'><link name='l'><self_collide>true</self_collide>" +
           box() +
           "</link><joint name='j' type='revolute'><parent>l</parent><child>ghost</child></joint></model>",
       {{0, 1, 7.5}},
       {},
       "ghost"},
      {"TwoVisualsOfOneName",
       model(box("", "0 0 1 0 0 0") + box("", "0 2 1 0 0 0")),
       {{0, 1, 7.5}, {2, 1, 7.5}},
       {},
       "visual 'v' is there twice"},
      {"JointsAndCollisionsAreNotLookedAt",
       "<model name='m'><link name='l'>" + box() +
           "<collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision><collision "
           "name='c'><geometry><box><size>1 1 "
           "1</size></box></geometry></collision><inertial><mass>-1</mass></inertial>"
           "</link></model>",
       {{0, 1, 7.5}}},
      {"NestedModelsAddUp",
       "<model name='m'><static>true</static><pose>1 0 0 0 0 0</pose><model name='n'><pose>1 0 0 0 0 "
       "0</pose><link "
       "name='l'>" +
           box() + "</link></model></model>",
       {{0, 1, 9.5}},
       {},
       nullptr,
       "1.9"},
  };
}

class GazeboWorlds : public testing::TestWithParam<Case> {
 protected:
  GazeboWorlds()
      : root_(std::filesystem::temp_directory_path() /
              ("pade_gazebo_" + std::to_string(::getpid()) + "_" + GetParam().name)) {
    std::filesystem::create_directories(root_ / "worlds");
  }
  ~GazeboWorlds() override { std::filesystem::remove_all(root_); }
  GazeboWorlds(const GazeboWorlds&) = delete;
  GazeboWorlds& operator=(const GazeboWorlds&) = delete;

  /// Content, or an image of white pixels where the name is that of one.
  void write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = root_ / "worlds" / name;
    std::filesystem::create_directories(file.parent_path());
    if (name.ends_with(".png")) {
      EXPECT_TRUE(io::save_image(file.string(), cv::Mat(4, 4, CV_8UC3, cv::Scalar::all(255))));
    } else {
      std::ofstream(file) << text;
    }
  }

  std::filesystem::path root_;
};

TEST_P(GazeboWorlds, AreDrawnAsGazeboShowsThem) {
  const Case& c = GetParam();
  for (const auto& [name, text] : c.files) write(name, text);
  write("w.world",
        fmt::format("<?xml version='1.0'?>\n<sdf version='{}'><world name='w'>{}{}</world></sdf>\n",
                    c.version, c.world.find("model://sun") == std::string::npos ? kSun : "", c.world));
  auto world = read_sdf(root_ / "worlds" / "w.world");
  ASSERT_TRUE(world.ok()) << world.error().message;
  if (c.warning == nullptr) {
    EXPECT_THAT(world->warnings, testing::IsEmpty());
  } else {
    EXPECT_THAT(world->warnings, testing::Contains(HasSubstr(c.warning)));
  }
  const auto scene = Scene::build(std::move(world).value());
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  for (const Probe& probe : c.probes) {
    const Vector3d origin(-8, probe.y, probe.z);
    const double distance = scene->distance(origin, Vector3d::UnitX());
    if (std::isnan(probe.distance)) {
      EXPECT_TRUE(std::isnan(distance)) << "at y " << probe.y << ", z " << probe.z << ": " << distance;
      continue;
    }
    EXPECT_NEAR(distance, probe.distance, 1e-5) << "at y " << probe.y << ", z " << probe.z;
    if (std::isnan(distance)) continue;
    RayPacket rays;
    rays.set(0, origin, Vector3d::UnitX(), 0, 100);
    const HitPacket hit = scene->nearest(rays);
    const auto seen =
        scene->surface(hit.primitive[0], origin + distance * Vector3d::UnitX(), Vector3d::UnitX(), false);
    const Visual& visual = scene->world().visuals[static_cast<std::size_t>(seen.visual)];
    if (probe.visual != nullptr) {
      EXPECT_THAT(visual.name, HasSubstr(probe.visual));
    }
    if (probe.srgb.x() == kAnyColour) continue;
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(visual.material.colour[i], linear_from_srgb(probe.srgb[i]), 2e-3) << i;
    }
  }
}

/// Models in a folder that only a variable of the environment, or the caller, names.
class GazeboPaths : public testing::TestWithParam<const char*> {};

TEST_P(GazeboPaths, AreLookedThroughAlsoInsideIncludedModels) {
  const std::filesystem::path root =
      std::filesystem::temp_directory_path() / fmt::format("pade_paths_{}_{}", ::getpid(), GetParam());
  for (const char* name : {"worlds", "elsewhere/a", "elsewhere/b"})
    std::filesystem::create_directories(root / name);
  std::ofstream(root / "elsewhere/a/model.sdf") << model_file("a", include("b"));
  std::ofstream(root / "elsewhere/b/model.sdf") << model_file("b", kBrownBox);
  const std::filesystem::path file = root / "worlds" / "w.world";
  std::ofstream(file) << "<?xml version='1.0'?><sdf version='1.6'><world name='w'>" << kSun << include("a")
                      << "</world></sdf>";
  EXPECT_FALSE(read_sdf(file).ok()) << "nobody says where they are";
  ResourcePaths resources;
  const std::string elsewhere = (root / "elsewhere").string();
  const bool variable = std::string(GetParam()) != "resources";
  if (variable) ::setenv(GetParam(), ("/nowhere:" + elsewhere).c_str(), 1);
  if (!variable) resources = {elsewhere};
  const auto world = read_sdf(file, resources);
  if (variable) ::unsetenv(GetParam());
  std::filesystem::remove_all(root);
  ASSERT_TRUE(world.ok()) << world.error().message;
  ASSERT_EQ(world->visuals.size(), 1U);
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(world->visuals[0].material.colour[i], linear_from_srgb(kBrown[i]), 2e-3);
}

INSTANTIATE_TEST_SUITE_P(Of, GazeboPaths,
                         testing::Values("GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH",
                                         "GAZEBO_MODEL_PATH", "resources"),
                         [](const auto& instance) { return std::string(instance.param); });

INSTANTIATE_TEST_SUITE_P(Of, GazeboWorlds, testing::ValuesIn(cases()),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace pade::simulation

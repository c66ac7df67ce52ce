#include "pade/simulation/sdf/sdf_reader.hpp"

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/image/image_codec.hpp"

namespace pade::simulation {
namespace {

using testing::Contains;
using testing::HasSubstr;

/// A folder of a test's own, removed at its end.
class SdfReader : public testing::Test {
 protected:
  SdfReader()
      : folder_(std::filesystem::temp_directory_path() /
                ("pade_sdf_" + std::to_string(::getpid()) + "_" +
                 testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::create_directories(folder_);
  }
  ~SdfReader() override { std::filesystem::remove_all(folder_); }
  SdfReader(const SdfReader&) = delete;
  SdfReader& operator=(const SdfReader&) = delete;

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  std::filesystem::path world(const std::string& body, const std::string& version = "1.9") const {
    return write("a.sdf", "<?xml version=\"1.0\"?>\n<sdf version=\"" + version +
                              "\" xmlns:pade=\"https://pade/sdf\">\n<world name=\"w\">\n" + body +
                              "\n</world>\n</sdf>\n");
  }
  static std::string model(const std::string& visual, const std::string& pose = "0 0 0 0 0 0") {
    return "<model name=\"m\"><static>true</static><pose>" + pose +
           "</pose><link name=\"l\"><visual name=\"v\">" + visual + "</visual></link></model>";
  }
  static std::string message(const Result<World>& result) {
    return result.ok() ? "accepted" : result.error().message;
  }

  std::filesystem::path folder_;
};

constexpr auto kBox = "<geometry><box><size>1 2 3</size></box></geometry>";

TEST_F(SdfReader, PosesAddUpFromModelToVisual) {
  const auto result = read_sdf(world(
      "<model name='m'><pose>1 2 3 0 0 1.5707963267948966</pose><link name='l'><pose>1 0 0 0 0 0</pose>"
      "<visual name='v'><pose>0 1 0 0 0 0</pose><geometry><sphere><radius>2</radius></sphere></geometry>"
      "</visual></link></model>"));
  ASSERT_TRUE(result.ok()) << message(result);
  ASSERT_EQ(result->visuals.size(), 1U);
  EXPECT_LT((result->visuals[0].T_world_shape.translation - Eigen::Vector3d(0, 3, 3)).norm(), 1e-9);
  EXPECT_EQ(std::get<Ellipsoid>(result->visuals[0].shape).radii.x(), 2);
}

TEST_F(SdfReader, ReadsSunSceneMaterialAndPattern) {
  const auto result = read_sdf(world(
      "<light type='directional' name='sun'><direction>1 0 -1</direction><diffuse>1 1 1 1</diffuse></light>"
      "<scene><ambient>0.5 0.5 0.5 1</ambient><background>0 0 1 1</background></scene>" +
      model(std::string(kBox) + "<material><diffuse>1 0 0 1</diffuse><pade:pattern scale='2' "
                                "contrast='0.5'>brick</pade:pattern></material>")));
  ASSERT_TRUE(result.ok()) << message(result);
  ASSERT_TRUE(result->sun.has_value());
  EXPECT_EQ(result->sun->direction, Eigen::Vector3d(1, 0, -1));
  EXPECT_LT((result->visuals[0].material.colour - Eigen::Vector3d(1, 0, 0)).norm(), 1e-9);
  EXPECT_EQ(result->visuals[0].material.pattern, (Pattern{PatternKind::brick, 2, 0.5}));
  EXPECT_THAT(result->warnings, testing::IsEmpty());
}

TEST_F(SdfReader, ReadsACameraAsItIsMounted) {
  const auto result =
      read_sdf(world(model(kBox) + "<model name='q'><link name='l'><sensor name='c' type='camera'><pose>0.1 "
                                   "0 0.05 0 0 0</pose><update_rate>20</update_rate>"
                                   "<camera><horizontal_fov>1.0471975512</horizontal_fov><image><width>640</"
                                   "width><height>480</height><format>L8</format>"
                                   "</image></camera></sensor></link></model>"));
  ASSERT_TRUE(result.ok()) << message(result);
  ASSERT_EQ(result->cameras.size(), 1U);
  const CameraSensor& camera = result->cameras[0];
  EXPECT_NEAR(camera.camera.fx, 554.256, 1e-3);
  EXPECT_EQ(camera.colour, false);
  EXPECT_EQ(camera.rate, 20);
  EXPECT_LT((camera.T_body_camera.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(),
            1e-12);
  EXPECT_LT((camera.T_body_camera.translation - Eigen::Vector3d(0.1, 0, 0.05)).norm(), 1e-12);
}

TEST_F(SdfReader, OfACameraSaysWhatThePictureDoesNotShow) {
  const auto read = [this](const std::string& image, const std::string& rest) {
    return read_sdf(world(model(kBox) +
                          "<model name='q'><link name='l'><sensor name='c' type='camera'><camera>"
                          "<horizontal_fov>1</horizontal_fov><image><width>640</width><height>480</height>" +
                          image + "</image>" + rest + "</camera></sensor></link></model>"));
  };
  const auto plain = read("", "");
  ASSERT_TRUE(plain) << plain.error().message;
  ASSERT_EQ(plain->cameras.size(), 1U);
  EXPECT_FALSE(plain->cameras[0].colour) << "nothing is stated";
  EXPECT_THAT(plain->warnings, testing::Not(testing::Contains(testing::HasSubstr("is passed over"))));
  const auto odd = read("<format>R8G8B8</format>",
                        "<lens><type>stereographic</type><intrinsics><fx>500</fx><fy>500</fy><cx>320</cx>"
                        "<cy>240</cy><s>3</s></intrinsics></lens><distortion><k1>0.1</k1>"
                        "<center>0.4 0.5</center></distortion><noise><type>gaussian</type>"
                        "<mean>0.1</mean><stddev>0.02</stddev></noise>");
  ASSERT_TRUE(odd) << odd.error().message;
  EXPECT_EQ(odd->cameras[0].colour, true);
  EXPECT_EQ(odd->cameras[0].noise_deviation, 0.02);
  for (const char* const what : {"<lens> <type> stereographic", "<center> 0.4 0.5", "<s> 3", "<mean> 0.1"})
    EXPECT_THAT(odd->warnings, testing::Contains(testing::HasSubstr(what)));
}

TEST_F(SdfReader, OfAWideAngleCameraSaysThatItIsDrawnAsAPinhole) {
  const auto result =
      read_sdf(world(model(kBox) +
                     "<model name='q'><link name='l'><sensor name='c' type='wide_angle_camera'><camera>"
                     "<horizontal_fov>2</horizontal_fov><image><width>640</width><height>480</height></image>"
                     "</camera></sensor></link></model>"));
  ASSERT_TRUE(result.ok()) << message(result);
  ASSERT_EQ(result->cameras.size(), 1U);
  EXPECT_THAT(result->warnings,
              Contains(testing::AllOf(HasSubstr("camera 'q::c'"), HasSubstr("wide-angle"))));
}

TEST_F(SdfReader, PlacesACameraByItsOwnPoseOnTheSensor) {
  const auto mount = [this](const std::string& sensor, const std::string& camera) {
    const auto result = read_sdf(
        world(model(kBox) + "<model name='q'><link name='l'><sensor name='c' type='camera'><pose>" + sensor +
              "</pose><camera><pose>" + camera +
              "</pose><horizontal_fov>1</horizontal_fov><image><width>640</width><height>480</height></image>"
              "</camera></sensor></link></model>"));
    EXPECT_TRUE(result.ok()) << message(result);
    return result->cameras.at(0).T_body_camera;
  };
  EXPECT_LT((mount("1 0 0 0 0 1.5707963267948966", "1 0 0.5 0 0 0").translation - Eigen::Vector3d(1, 1, 0.5))
                .norm(),
            1e-9);
  const Pose turned = mount("0 0 0 0 0 0", "0 0 0 0 0.5 0");
  const Pose same = mount("0 0 0 0 0.5 0", "0 0 0 0 0 0");
  EXPECT_LT(turned.rotation.angularDistance(same.rotation), 1e-9);
}

TEST_F(SdfReader, ReadsAnImageOnceHoweverManySurfacesShowIt) {
  EXPECT_TRUE(io::save_image((folder_ / "t.png").string(), cv::Mat(4, 4, CV_8UC3, cv::Scalar(10, 20, 30))));
  const std::string material =
      "<material><pbr><metal><albedo_map>t.png</albedo_map></metal></pbr></material>";
  const auto result =
      read_sdf(world("<model name='m'><link name='l'><visual name='a'>" + std::string(kBox) + material +
                     "</visual><visual name='b'>" + kBox + material + "</visual></link></model>"));
  ASSERT_TRUE(result.ok()) << message(result);
  ASSERT_EQ(result->visuals.size(), 2U);
  ASSERT_TRUE(result->visuals[0].material.image);
  EXPECT_EQ(result->visuals[0].material.image, result->visuals[1].material.image);
}

TEST_F(SdfReader, RefusesANameThatMeansTwoModels) {
  const auto of = [](const std::string& name, const std::string& inside) {
    return "<sdf version='1.9'><model name='" + name + "'>" + inside + "</model></sdf>";
  };
  const std::string link = "<link name='l'><visual name='v'>" + std::string(kBox) + "</visual></link>";
  write("part.sdf", of("worlds", link));
  write("models/a/part.sdf", of("own", link));
  write("models/a/model.sdf", of("a", "\n<include><uri>part.sdf</uri></include>"));
  // Alone, the file beside the including one is taken.
  const auto alone = read_sdf(world("<include><uri>model://a</uri></include>"));
  ASSERT_TRUE(alone.ok()) << message(alone);
  ASSERT_EQ(alone->visuals.size(), 1U);
  EXPECT_THAT(alone->visuals[0].name, HasSubstr("own"));
  EXPECT_THAT(message(read_sdf(
                  world("<include><uri>part.sdf</uri></include><include><uri>model://a</uri></include>"))),
              testing::AllOf(HasSubstr("model.sdf:2"), HasSubstr("part.sdf"), HasSubstr("means one thing")));
}

TEST_F(SdfReader, RefusesAnIncludeThatTheWorkingDirectoryWouldAnswer) {
  const std::string model_text = "<sdf version='1.9'><model name='a'><link name='l'><visual name='v'>" +
                                 std::string(kBox) + "</visual></link></model></sdf>";
  for (const std::string folder : {"models", "elsewhere"}) {
    write(folder + "/a/model.sdf", model_text);
    write(folder + "/a/model.config", "<model><sdf version='1.9'>model.sdf</sdf></model>");
  }
  const auto file = world("<include><uri>model://a</uri></include>");
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder_ / "elsewhere");
  const auto shadowed = read_sdf(file);
  std::filesystem::current_path(folder_ / "models");
  const auto same = read_sdf(file);
  std::filesystem::current_path(before);
  EXPECT_THAT(message(shadowed), testing::AllOf(HasSubstr("a.sdf:4"), HasSubstr("elsewhere")));
  EXPECT_TRUE(same.ok()) << message(same);
}

TEST_F(SdfReader, NamesWhatIsTakenOutBeforeItIsRead) {
  const std::string seen =
      "<actor name='p'><skin><filename>walk.dae</filename></skin></actor>\n<road name='r'><width>4</width>"
      "<point>0 0 0</point></road>\n<scene><ambient>1 1 1 1</ambient><fog><type>linear</type></fog></scene>" +
      model(kBox);
  for (const auto& [body, version] :
       {std::pair{seen, "1.10"}, std::pair{"<gravity>maybe</gravity>" + seen, "1.9"}}) {
    const auto result = read_sdf(world(body, version));
    ASSERT_TRUE(result.ok()) << message(result);
    for (const char* what : {"a.sdf:4: <actor> in <world> is not supported and left out",
                             "a.sdf:5: <road> in <world>", "a.sdf:6: <fog> in <scene>"})
      EXPECT_THAT(result->warnings, Contains(HasSubstr(what))) << version;
  }
}

TEST_F(SdfReader, ReadsAttributesOfAnyLength) {
  const std::string text = "<sdf comment='" + std::string(1 << 20, 'x') + "' version='1.9'><world name='w'>" +
                           "<light name='" + std::string(1 << 20, 'y') +
                           "' type='spot'><pose>a</pose></light>" + model(kBox) + "</world></sdf>";
  const auto result = read_sdf(write("long.sdf", text));
  ASSERT_TRUE(result.ok()) << message(result).substr(0, 200);
  EXPECT_EQ(result->visuals.size(), 1U);
}

TEST_F(SdfReader, WarnsOfAWorldThatIsFarFromItsOrigin) {
  EXPECT_THAT(read_sdf(world(model(kBox, "20000 0 0 0 0 0")))->warnings,
              Contains(testing::AllOf(HasSubstr("a.sdf"), HasSubstr("move the world to its origin"))));
  EXPECT_THAT(read_sdf(world(model(kBox)))->warnings,
              testing::Not(Contains(HasSubstr("move the world to its origin"))));
}

TEST_F(SdfReader, FindsIncludedModelsMeshesAndImages) {
  write("models/tower/model.config", "<model><sdf version='1.9'>tower.sdf</sdf></model>");
  write("models/tower/tower.sdf",
        "<sdf version='1.9'><model name='tower'><link name='l'><visual "
        "name='v'><geometry><mesh><uri>meshes/t.obj</uri>"
        "<scale>2 2 "
        "2</scale></mesh></geometry><material><pbr><metal><albedo_map>t.png</albedo_map></metal></pbr></"
        "material>"
        "</visual></link></model></sdf>");
  write("models/tower/meshes/t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n");
  EXPECT_TRUE(io::save_image((folder_ / "models/tower/t.png").string(),
                             cv::Mat(4, 4, CV_8UC3, cv::Scalar(10, 20, 30))));
  const auto result = read_sdf(world("<include><uri>model://tower</uri><pose>5 0 0 0 0 0</pose></include>"));
  ASSERT_TRUE(result.ok()) << message(result);
  ASSERT_EQ(result->visuals.size(), 1U);
  const auto& mesh = std::get<Mesh>(result->visuals[0].shape);
  EXPECT_EQ(mesh.triangles->triangles.size(), 1U);
  EXPECT_EQ(mesh.scale.x(), 2);
  EXPECT_TRUE(result->visuals[0].material.image);
  EXPECT_EQ(result->visuals[0].T_world_shape.translation.x(), 5);
}

TEST_F(SdfReader, NamesWhatItLeavesOut) {
  const auto result =
      read_sdf(world("<light type='point' name='lamp'/><plugin name='p' filename='f'/>" +
                     model(std::string(kBox) + "<wobble>3</wobble><material><script><uri>file://x.material</"
                                               "uri><name>Gazebo/Grey</name></script></material>")));
  ASSERT_TRUE(result.ok()) << message(result);
  EXPECT_THAT(result->warnings, Contains(HasSubstr("<wobble> in <visual>")));
  EXPECT_THAT(result->warnings, Contains(HasSubstr("<plugin>")));
  EXPECT_THAT(result->warnings, Contains(HasSubstr("<script>")));
  EXPECT_THAT(result->warnings, Contains(HasSubstr("'lamp'")));
}

TEST_F(SdfReader, RefusesAnUnknownPartOfAMeshByName) {
  write("t.obj", "o left\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_THAT(
      message(read_sdf(world(model(
          "<geometry><mesh><uri>t.obj</uri><submesh><name>middle</name></submesh></mesh></geometry>")))),
      testing::AllOf(HasSubstr("a.sdf:"), HasSubstr("found no part 'middle'"), HasSubstr("left")));
}

TEST_F(SdfReader, ChainsSensorPosesThroughNestedModels) {
  const auto result = read_sdf(world(
      "<model name='q'><pose>5 5 5 0 0 1</pose><link name='l'/><model name='gimbal'><pose>0.1 0 0 0 0 "
      "0</pose><link "
      "name='l'><pose>0 0.2 0 0 0 0</pose><sensor name='c' type='camera'><pose>0 0 0.3 0 0 0</pose><camera>"
      "<horizontal_fov>1</horizontal_fov><image><width>640</width><height>480</height></image></camera></"
      "sensor></link>"
      "</model></model>" +
      model(kBox)));
  ASSERT_TRUE(result.ok()) << message(result);
  ASSERT_EQ(result->cameras.size(), 1U);
  EXPECT_LT((result->cameras[0].T_body_camera.translation - Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 1e-12);
}

TEST_F(SdfReader, LeavesNothingOnTheErrorStream) {
  write("models/a/model.sdf",
        "<sdf version='1.9'><model name='a'><include><uri>model://ghost</uri></include></model></sdf>");
  testing::internal::CaptureStderr();
  EXPECT_FALSE(read_sdf(world("<include><uri>model://a</uri></include>")).ok());
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST_F(SdfReader, ReadsLaterVersionsAsFarAsItKnowsThem) {
  for (const char* version : {"1.10", "1.11", "1.12"}) {
    const auto result = read_sdf(world(model(kBox), version));
    ASSERT_TRUE(result.ok()) << message(result);
    EXPECT_EQ(result->visuals.size(), 1U);
    EXPECT_THAT(result->warnings, Contains(HasSubstr(std::string("version ") + version + " is read as 1.9")));
  }
}

TEST_F(SdfReader, IsNotStoppedByWhatNobodySees) {
  for (const std::string unseen :
       {"<gravity>maybe</gravity>", "<physics type='ode'><max_step_size>fast</max_step_size></physics>",
        "<gui><camera name='u'><pose>a b c</pose></camera></gui>",
        "<spherical_coordinates><latitude_deg>north</latitude_deg></spherical_coordinates>",
        "<wind><linear_velocity>strong</linear_velocity></wind>",
        "<model name='n'><static>perhaps</static><link "
        "name='l'><inertial><mass>0,5</mass></inertial></link></model>",
        "<model name='n'><link "
        "name='l'><collision><geometry><box><size>x</size></box></geometry></collision></link>"
        "</model>",
        "<model name='n'><link name='a'/><link name='b'/><joint name='j' "
        "type='hinge'><parent>a</parent><child>b"
        "</child></joint></model>",
        "<model name='n'><link name='l'><sensor name='s' type='odd'/></link></model>",
        "<light name='q' type='area'/>",
        "<light name='q' type='point'><pose>0 0 three 0 0 "
        "0</pose><attenuation><range>far</range></attenuation></light>",
        "<light name='q' type='spot'><spot><inner_angle>wide</inner_angle></spot></light>",
        "<model name='n'><link name='a'/><link name='b'/><joint name='j' "
        "type='revolute'><parent>a</parent><child>b"
        "</child><axis><xyz>0 0 up</xyz></axis></joint></model>",
        "<model name='n'><link name='l'><sensor name='s' "
        "type='ray'><ray><range><max>far</max></range></ray></sensor>"
        "</link></model>",
        "<actor "
        "name='a'><skin><filename>walk.dae</filename></skin><script><loop>true</loop></script></actor>",
        "<actor name='a'><script><trajectory id='0' type='walk'><waypoint><time>0</time><pose>0 0 0 0 0 "
        "0</pose>"
        "</waypoint></trajectory></script></actor>"}) {
    const auto result = read_sdf(world(unseen + model(kBox)));
    ASSERT_TRUE(result.ok()) << unseen << ": " << message(result);
    EXPECT_EQ(result->visuals.size(), 1U) << unseen;
  }
  const auto named = read_sdf(world("<gravity>maybe</gravity>" + model(kBox)));
  ASSERT_TRUE(named.ok());
  EXPECT_THAT(named->warnings,
              Contains(testing::AllOf(HasSubstr("a.sdf:4"), HasSubstr("<gravity>"), HasSubstr("maybe"))));
}

TEST_F(SdfReader, StillRefusesWhatIsSeen) {
  EXPECT_THAT(message(read_sdf(world("<gravity>maybe</gravity>" +
                                     model("<geometry><box><size>a</size></box></geometry>")))),
              testing::AllOf(HasSubstr("a.sdf:4"), HasSubstr("<size>")));
}

TEST_F(SdfReader, SaysWhichOfSeveralWorldsItReads) {
  const auto result = read_sdf(write(
      "two.sdf", "<sdf version='1.9'><world name='a'>" + model(kBox) + "</world><world name='b'/></sdf>"));
  ASSERT_TRUE(result.ok()) << message(result);
  EXPECT_THAT(result->warnings, Contains(HasSubstr("found 2 worlds: the first, 'a', is read")));
}

TEST_F(SdfReader, SaysHowColoursAreWritten) {
  EXPECT_THAT(message(read_sdf(
                  world(model(std::string(kBox) + "<material><diffuse>255 0 0 255</diffuse></material>")))),
              HasSubstr("opacity from 0 to 1"));
}

TEST_F(SdfReader, SaysWhatToDoAboutOtherFormatsAndServers) {
  EXPECT_THAT(message(read_sdf(write("r.sdf", "<robot name='r'><link name='l'/></robot>"))),
              HasSubstr("gz sdf -p"));
  EXPECT_THAT(
      message(read_sdf(world("<include><uri>https://fuel.gazebosim.org/1.0/a/models/Oak</uri></include>"))),
      HasSubstr("gz fuel download"));
  EXPECT_THAT(message(read_sdf(world("<include><uri>model://oak</uri></include>"))),
              HasSubstr("--resource-path"));
}

TEST_F(SdfReader, RefusesNewerVersions) {
  for (const char* version : {"1.20", "2.0", "x"}) {
    EXPECT_THAT(message(read_sdf(world(model(kBox), version))),
                testing::AllOf(HasSubstr("a.sdf:2"), HasSubstr(version), HasSubstr("expected 1.0 to 1.9")));
  }
}

TEST_F(SdfReader, RefusesWhatIsMissing) {
  EXPECT_THAT(message(read_sdf(folder_ / "nothing.sdf")), HasSubstr("no such world"));
  EXPECT_THAT(message(read_sdf(world(model("<geometry><mesh><uri>model://x/y.obj</uri></mesh></geometry>")))),
              HasSubstr("y.obj"));
  EXPECT_THAT(message(read_sdf(world(model(std::string(kBox) +
                                           "<material><pbr><metal><albedo_map>no.png</albedo_map></metal>"
                                           "</pbr></material>")))),
              HasSubstr("no.png"));
  EXPECT_THAT(message(read_sdf(world("<include><uri>model://ghost</uri></include>"))), HasSubstr("ghost"));
  write("broken.obj", "not a mesh");
  EXPECT_THAT(message(read_sdf(world(model("<geometry><mesh><uri>broken.obj</uri></mesh></geometry>")))),
              HasSubstr("broken.obj"));
  write("broken.png", "not an image");
  EXPECT_THAT(message(read_sdf(world(model(
                  std::string(kBox) +
                  "<material><pbr><metal><albedo_map>broken.png</albedo_map></metal></pbr></material>")))),
              HasSubstr("broken.png"));
}

TEST_F(SdfReader, RefusalsSayWhere) {
  for (const char* visual :
       {"<geometry><mesh><uri>no.obj</uri></mesh></geometry>",
        "<geometry><box><size>1 1 "
        "1</size></box></geometry><material><pbr><metal><albedo_map>no.png</albedo_map>"
        "</metal></pbr></material>",
        "<geometry><cilinder><radius>1</radius></cilinder></geometry>",
        "<geometry><sphere><radius>0,4</radius></sphere></geometry>",
        "<geometry><box><size>1 1 "
        "1</size></box></geometry><material><pade:pattern>marble</pade:pattern></material>"}) {
    EXPECT_THAT(message(read_sdf(world(model(visual)))), testing::ContainsRegex("a\\.sdf:[1-9][0-9]*: "))
        << visual;
  }
}

TEST_F(SdfReader, RefusesAnIncludeOfItself) {
  write("models/a/model.sdf",
        "<sdf version='1.9'><model name='a'><include><uri>model://b</uri></include></model></sdf>");
  write("models/b/model.sdf",
        "<sdf version='1.9'><model name='b'><include><uri>model://a</uri></include></model></sdf>");
  EXPECT_THAT(message(read_sdf(world("<include><uri>model://a</uri></include>"))), HasSubstr("cycle"));
}

TEST_F(SdfReader, RefusesBadNumbersAndPatterns) {
  EXPECT_THAT(message(read_sdf(world(model("<geometry><box><size>1 two 3</size></box></geometry>")))),
              HasSubstr("1 two 3"));
  EXPECT_THAT(message(read_sdf(world(model(kBox, "0 0 zero 0 0 0")))), HasSubstr("zero"));
  EXPECT_THAT(message(read_sdf(world(
                  model(std::string(kBox) + "<material><pade:pattern>marble</pade:pattern></material>")))),
              testing::AllOf(HasSubstr("marble"), HasSubstr("brick")));
  EXPECT_THAT(
      message(read_sdf(world(
          model(std::string(kBox) + "<material><pade:pattern scale='big'>brick</pade:pattern></material>")))),
      HasSubstr("scale=\"big\""));
  // libsdformat alone would read the 0 before the comma.
  EXPECT_THAT(message(read_sdf(world(model("<geometry><sphere><radius>0,4</radius></sphere></geometry>")))),
              HasSubstr("field <radius>: found '0,4'"));
  EXPECT_THAT(message(read_sdf(world(model("<geometry><box><size>1 2,5 3</size></box></geometry>")))),
              HasSubstr("2,5"));
  EXPECT_THAT(message(read_sdf(write("b.sdf", "<sdf version='1.9'><world"))), HasSubstr("b.sdf"));
}

}  // namespace
}  // namespace pade::simulation

#include "pade/simulation/flight/simulated_sequence.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>
#include <unistd.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/simulation/generator/paper_set.hpp"
#include "pade/simulation/render/truth.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"

namespace pade::simulation {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A textured room with a few things in it.
Scene textured_room() {
  World world;
  const auto add = [&](const Shape& shape, const Eigen::Vector3d& at, PatternKind kind) {
    Visual visual{"v", {Eigen::Quaterniond::Identity(), at}, shape, {}, true};
    visual.material.colour.setOnes();
    visual.material.pattern.kind = kind;
    world.visuals.push_back(std::move(visual));
  };
  add(Rectangle{{0, 0, 1}, {60, 60}}, {0, 0, 0}, PatternKind::gravel);
  add(Box{{1, 30, 12}}, {12, 0, 5}, PatternKind::brick);
  add(Box{{1, 1, 2}}, {7, 1.5, 1}, PatternKind::concrete);
  add(Cylinder{0.3, 4}, {6, -1.5, 2}, PatternKind::bark);
  add(Ellipsoid{{0.7, 0.7, 0.7}}, {5.5, 0.2, 0.7}, PatternKind::plaster);
  world.sun = Sun{};
  auto scene = Scene::build(std::move(world));
  EXPECT_TRUE(scene.ok());
  return std::move(scene).value();
}

Flight short_flight() {
  Flight flight;
  flight.name = "test";
  for (int i = 0; i < 4; ++i) flight.waypoints.push_back({{-4.0 + 2 * i, 0.1 * i, 1.5}, 0.02 * i, {}});
  flight.frames = 5;
  flight.first_frame = 1;
  Camera camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 138.6;
  camera.cx = 79.5;
  camera.cy = 59.5;
  flight.camera = camera;
  return flight;
}

std::map<std::string, std::string> contents(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ostringstream text;
    text << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    files[entry.path().lexically_relative(folder).string()] = text.str();
  }
  return files;
}

class SimulatedSequence : public testing::Test {
 protected:
  SimulatedSequence()
      : folder_(fs::temp_directory_path() / ("pade_simulated_" + std::to_string(::getpid()) + "_" +
                                             testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::create_directories(folder_);
  }
  ~SimulatedSequence() override { fs::remove_all(folder_); }
  SimulatedSequence(const SimulatedSequence&) = delete;
  SimulatedSequence& operator=(const SimulatedSequence&) = delete;

  std::string write(const std::string& name, const Flight& flight,
                    const SequenceOptions& options = {}) const {
    const Status status = write_sequence(scene_, flight, folder_ / name, options);
    return status ? "" : status.error().message;
  }

  fs::path folder_;
  Scene scene_ = textured_room();
};

TEST_F(SimulatedSequence, IsReadByTheSequenceReader) {
  ASSERT_EQ(write("s", short_flight()), "");
  const auto sequence = io::Sequence::open(folder_ / "s");
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  EXPECT_EQ(sequence->size(), 5U);
}

TEST_F(SimulatedSequence, HasTheSameBytesForAnyNumberOfThreads) {
  SequenceOptions two;
  two.threads = 2;
  ASSERT_EQ(write("one", short_flight()), "");
  ASSERT_EQ(write("two", short_flight(), two), "");
  EXPECT_EQ(contents(folder_ / "one"), contents(folder_ / "two"));
}

TEST_F(SimulatedSequence, AnotherSeedGivesAnotherNoiseAndTheSameTruth) {
  SequenceOptions other;
  other.seed = 2;
  ASSERT_EQ(write("one", short_flight()), "");
  ASSERT_EQ(write("two", short_flight(), other), "");
  const auto one = contents(folder_ / "one");
  const auto two = contents(folder_ / "two");
  EXPECT_EQ(one.at("depth/1.000000.png"), two.at("depth/1.000000.png"));
  EXPECT_EQ(one.at("groundtruth.txt"), two.at("groundtruth.txt"));
  EXPECT_NE(one.at("rgb/1.000000.png"), two.at("rgb/1.000000.png"));
  EXPECT_NE(one.at("imu.csv"), two.at("imu.csv"));
}

TEST_F(SimulatedSequence, GoesOnWhereItWasCutShort) {
  ASSERT_EQ(write("whole", short_flight()), "");
  ASSERT_EQ(write("cut", short_flight()), "");
  // What a killed run leaves behind: the hidden folder with some frames, and a file that was being written.
  const fs::path hidden = folder_ / ".cut.unfinished";
  fs::rename(folder_ / "cut", hidden);
  fs::remove(hidden / "rgb/1.300000.png");
  fs::remove(hidden / "rgb/1.400000.png");
  fs::remove(hidden / "depth/1.400000.png");
  std::ofstream(hidden / "rgb/.1.300000.png.partial") << "half a frame";
  const auto before = fs::last_write_time(hidden / "rgb/1.000000.png");
  ASSERT_EQ(write("cut", short_flight()), "");
  EXPECT_EQ(contents(folder_ / "cut"), contents(folder_ / "whole"));
  EXPECT_EQ(fs::last_write_time(folder_ / "cut/rgb/1.000000.png"), before) << "finished frames are kept";
}

TEST_F(SimulatedSequence, DoesNotMixTheFramesOfTwoFlights) {
  ASSERT_EQ(write("whole", short_flight()), "");
  Flight other = short_flight();
  other.image.vignetting = 0;
  ASSERT_EQ(write("cut", other), "");
  fs::rename(folder_ / "cut", folder_ / ".cut.unfinished");
  ASSERT_EQ(write("cut", short_flight()), "");
  EXPECT_EQ(contents(folder_ / "cut"), contents(folder_ / "whole"));
}

TEST_F(SimulatedSequence, RefusesWhatCannotBeFlownOrWritten) {
  Flight inside = short_flight();
  for (Waypoint& w : inside.waypoints) w.position.x() += 14;
  EXPECT_THAT(write("a", inside), HasSubstr("inside 'v'"));
  Flight fast = short_flight();
  fast.trajectory.limits.speed = 0.5;
  EXPECT_THAT(write("a", fast), HasSubstr("speed between waypoints"));
  Flight longer = short_flight();
  longer.frames = 500;
  EXPECT_THAT(write("a", longer), HasSubstr("expected 500 frames"));
  EXPECT_THAT(write("/proc/nowhere/s", short_flight()), HasSubstr("cannot be made"));
  ASSERT_EQ(write("b", short_flight()), "");
  EXPECT_THAT(write("b", short_flight()), HasSubstr("exists already"));
  SequenceOptions force;
  force.overwrite = io::Overwrite::replace;
  EXPECT_EQ(write("b", short_flight(), force), "");
  fs::create_directories(folder_ / "precious");
  std::ofstream(folder_ / "precious/letter.txt") << "dear";
  EXPECT_THAT(write("precious", short_flight(), force), HasSubstr("not replaced"));
  Flight unready = short_flight();
  unready.first_frame = 0;
  unready.exposure_time = 0.02;
  EXPECT_THAT(write("c", unready),
              testing::AllOf(HasSubstr("first_frame_s"), HasSubstr("at least half the exposure, 0.01 s")));
  Flight far = short_flight();
  for (Waypoint& w : far.waypoints) w.position.y() += 5e6;
  EXPECT_THAT(write("c", far), HasSubstr("from the origin of the world"));
  EXPECT_TRUE(precision_warning(far).has_value());
  EXPECT_FALSE(precision_warning(short_flight()).has_value());
}

TEST_F(SimulatedSequence, IsPutInPlaceWhereverItsNameLeads) {
  ASSERT_EQ(write("whole", short_flight()), "");
  SequenceOptions force;
  force.overwrite = io::Overwrite::replace;
  fs::create_directories(folder_ / "in/here");
  for (const char* name : {"in/here/.", "in/here/", "in/here/../here", "in/./here/."}) {
    ASSERT_EQ(write(name, short_flight(), force), "") << name;
    EXPECT_EQ(contents(folder_ / "in/here"), contents(folder_ / "whole")) << name;
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "in"), fs::directory_iterator()), 1) << name;
  }
}

/// Grey levels by which frame 2, warped onto frame 1 with the true flow, differs from frame 1 where both see
/// the surface, away from its outlines.
double warp_residual(const Scene& scene, const ImageOptions& image, double quantile) {
  Camera camera = *short_flight().camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 277.1;
  camera.cx = 159.5;
  camera.cy = 119.5;
  const RayGrid grid(camera);
  const Renderer renderer(scene);
  const Pose first{Eigen::Quaterniond(forward_camera_rotation()), {0, 0, 1.5}};
  const Pose second{Eigen::Quaterniond(forward_camera_rotation()) * rotation_exp({0.01, 0.02, 0.01}),
                    {0.1, 0.1, 1.52}};
  const Rendering a = renderer.render(grid, first, {});
  const Rendering b = renderer.render(grid, second, {});
  const cv::Mat image_a = form_image(a.radiance, grid, image, 0, 1, 1);
  const cv::Mat image_b = form_image(b.radiance, grid, image, 0, 1, 2);
  const ExactFlow flow = exact_flow(scene, grid, a.depth, first, second);
  std::vector<cv::Mat> w(2);
  cv::split(flow.flow, w);
  cv::Mat map_x = w[0].clone();
  cv::Mat map_y = w[1].clone();
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      map_x.at<float>(v, u) += static_cast<float>(u);
      map_y.at<float>(v, u) += static_cast<float>(v);
    }
  }
  cv::Mat warped;
  cv::remap(image_b, warped, map_x, map_y, cv::INTER_CUBIC);
  cv::Mat outline;
  cv::Mat nearest;
  cv::Mat farthest;
  cv::erode(a.depth, nearest, cv::Mat::ones(7, 7, CV_8U));
  cv::dilate(a.depth, farthest, cv::Mat::ones(7, 7, CV_8U));
  outline = farthest - nearest > 0.1F * a.depth;
  std::vector<double> differences;
  for (int v = 4; v < camera.height - 4; ++v) {
    for (int u = 4; u < camera.width - 4; ++u) {
      const bool sky = std::isnan(a.depth.at<float>(v, u));
      if (sky || outline.at<std::uint8_t>(v, u) != 0 || flow.visible.at<std::uint8_t>(v, u) == 0) continue;
      differences.push_back(
          std::abs(static_cast<double>(warped.at<std::uint8_t>(v, u)) - image_a.at<std::uint8_t>(v, u)));
    }
  }
  EXPECT_GT(differences.size(), 20000U);
  const auto at = static_cast<std::ptrdiff_t>(quantile * static_cast<double>(differences.size() - 1));
  std::nth_element(differences.begin(), differences.begin() + at, differences.end());
  return differences[static_cast<std::size_t>(at)];
}

TEST(Rendering, WarpingByTheTrueFlowLeavesOnlyNoiseAndOcclusion) {
  const Scene scene = textured_room();
  // Without sensor noise what remains is the interpolation of the warp itself.
  EXPECT_LE(warp_residual(scene, ImageOptions::ideal(), 0.5), 2);
  EXPECT_LE(warp_residual(scene, ImageOptions::ideal(), 0.9), 6);
  ImageOptions noisy;
  noisy.exposure_change = 0;
  EXPECT_LE(warp_residual(scene, noisy, 0.5), 3);
}

TEST(ImageFormation, NoiseHasTheStatedSize) {
  Camera camera = *short_flight().camera;
  const RayGrid grid(camera);
  const cv::Mat flat(camera.size(), CV_32FC3, cv::Scalar(0.25, 0.25, 0.25));
  ImageOptions options = ImageOptions::ideal();
  const auto deviation = [&] {
    cv::Scalar mean;
    cv::Scalar sigma;
    cv::meanStdDev(form_image(flat, grid, options, 0, 7, 3), mean, sigma);
    return sigma[0];
  };
  EXPECT_EQ(deviation(), 0);
  options.read_noise = 0.02;
  EXPECT_NEAR(deviation(), 0.02 * 255, 0.1);
  options.read_noise = 0;
  options.full_well = 2000;
  // Photon noise sqrt(L / N) times the slope of the sRGB curve, 1.055 / 2.4 L^(1/2.4 - 1).
  EXPECT_NEAR(deviation(), std::sqrt(0.25 / 2000) * 1.055 / 2.4 * std::pow(0.25, 1 / 2.4 - 1) * 255, 0.12);
}

TEST(PaperSequences, Are1038FramesOfTheStatedMotion) {
  int frames = 0;
  for (const PaperSequence& sequence : paper_sequences(1)) {
    const auto path = Trajectory::through(sequence.flight.waypoints, sequence.flight.trajectory);
    ASSERT_TRUE(path.ok()) << sequence.name << ": " << path.error().message;
    const auto stations =
        camera_stations(sequence.flight, *path, {Eigen::Quaterniond(forward_camera_rotation()), {0, 0, 0}});
    ASSERT_TRUE(stations.ok()) << stations.error().message;
    frames += static_cast<int>(stations->size());
    double moved = 0;
    double turned = 0;
    for (std::size_t i = 1; i < stations->size(); ++i) {
      const RelativeMotion step =
          relative_motion((*stations)[i - 1].T_world_camera, (*stations)[i].T_world_camera, 0.1);
      moved += step.t_reference_other.norm();
      turned += step.rotation_vector().norm();
    }
    const auto steps = static_cast<double>(stations->size() - 1);
    if (sequence.name == "rotation") {
      EXPECT_NEAR(moved / steps, 0.028, 0.0005);
      EXPECT_NEAR(turned / steps, 2 * 3.14159265 / 180, 1e-4);
    } else {
      EXPECT_NEAR(moved / steps, 0.2, sequence.name == "slalom" ? 0.01 : 1e-4) << sequence.name;
    }
  }
  EXPECT_EQ(frames, 1038);
}

TEST(WorldGenerator, GivesTheSameFilesForTheSameSeed) {
  for (const auto& [kind, name] : EnumNames<WorldKind>::names) {
    const WorldFiles one = generate_world(kind, 5);
    const WorldFiles two = generate_world(kind, 5);
    EXPECT_EQ(one.sdf, two.sdf) << name;
    EXPECT_EQ(one.meshes, two.meshes) << name;
    EXPECT_NE(one.sdf, generate_world(kind, 6).sdf) << name;
  }
}

TEST_F(SimulatedSequence, EveryShippedWorldIsWhatTheGeneratorMakes) {
  for (const auto& [kind, name] : EnumNames<WorldKind>::names) {
    const WorldFiles made = generate_world(kind, 1);
    const auto shipped = contents(fs::path(PADE_SOURCE_DIR) / "worlds" / std::string(name));
    EXPECT_EQ(shipped.at(std::string(name) + ".sdf"), made.sdf) << name;
    for (const auto& [file, text] : made.meshes) EXPECT_EQ(shipped.at("meshes/" + file), text) << name;
  }
}

TEST(FlightFile, LeavesColourAndNoiseToTheWorldWhereItStatesNone) {
  const std::string points = "waypoints: [{position: [0, 0, 2]}, {position: [5, 0, 2]}]\n";
  World world;
  CameraSensor sensor;
  sensor.colour = true;
  sensor.noise_deviation = 0.02;
  world.cameras.push_back(sensor);
  const auto image = [&](const std::string& text, const World& of) {
    const auto flight = parse_flight(points + text, "f.yaml");
    EXPECT_TRUE(flight) << flight.error().message;
    return flight_camera(*flight, of).image;
  };
  EXPECT_TRUE(image("", world).colour);
  EXPECT_EQ(image("", world).read_noise, 0.02);
  EXPECT_FALSE(image("image: {colour: false}\n", world).colour);
  EXPECT_EQ(image("image: {colour: false}\n", world).read_noise, 0.02);
  EXPECT_EQ(image("image: {read_noise: 0.004}\n", world).read_noise, 0.004);
  EXPECT_FALSE(image("", World{}).colour);
  world.cameras[0].colour.reset();
  world.cameras[0].noise_deviation.reset();
  EXPECT_FALSE(image("", world).colour) << "its format is not stated either";
  EXPECT_EQ(image("", world).read_noise, ImageOptions{}.read_noise);
}

TEST(FlightFile, LeavesToTheWorldsCameraWhatItDoesNotState) {
  const std::string points = "waypoints: [{position: [0, 0, 2]}, {position: [5, 0, 2]}]\n";
  World world;
  CameraSensor sensor;
  sensor.camera.width = 1280;
  sensor.camera.height = 800;
  sensor.camera.fx = sensor.camera.fy = 900;
  sensor.camera.cx = 650;
  sensor.camera.cy = 390;
  sensor.camera.distortion = Distortion::plumb_bob;
  sensor.camera.coefficients[0] = 0.1;
  sensor.T_body_camera = {Eigen::Quaterniond(forward_camera_rotation()), {0.2, 0.1, -0.3}};
  world.cameras.push_back(sensor);
  const auto camera_of = [&](const std::string& text, const World& of) {
    const auto flight = parse_flight(points + text, "f.yaml");
    EXPECT_TRUE(flight) << flight.error().message;
    return flight_camera(*flight, of);
  };
  const FlightCamera tilted = camera_of("camera: {pitch_down_deg: 20}\n", world);
  EXPECT_EQ(tilted.camera.width, 1280);
  EXPECT_EQ(tilted.camera.fx, 900);
  EXPECT_EQ(tilted.camera.distortion, Distortion::plumb_bob);
  EXPECT_EQ(tilted.T_body_camera.translation, sensor.T_body_camera.translation);
  EXPECT_NEAR((tilted.T_body_camera.rotation * Eigen::Vector3d::UnitZ()).z(),
              -std::sin(20 * 3.14159265 / 180), 1e-6);
  // Half the size shows the same: where the edges of the picture are seen does not change.
  const Camera half = camera_of("camera: {width: 640, height: 400}\n", world).camera;
  for (const double edge : {-0.5, 1279.5})
    EXPECT_NEAR((0.5 * (edge + 0.5) - 0.5 - half.cx) / half.fx, (edge - 650) / 900, 1e-12);
  for (const double edge : {-0.5, 799.5})
    EXPECT_NEAR((0.5 * (edge + 0.5) - 0.5 - half.cy) / half.fy, (edge - 390) / 900, 1e-12);
  EXPECT_EQ(half.coefficients[0], 0.1);
  EXPECT_EQ(camera_of("camera: {fx: 300, distortion_model: none}\n", world).camera.distortion,
            Distortion::none);
  EXPECT_EQ(camera_of("camera: {fx: 300}\n", world).camera.fy, 300);
  // Without a camera of the world the defaults count, whatever is stated.
  const FlightCamera alone = camera_of("camera: {width: 320, pitch_down_deg: 20}\n", World{});
  EXPECT_EQ(alone.camera.fx, 554.26);
  EXPECT_EQ(alone.camera.height, 480);
  EXPECT_EQ(alone.camera.cx, 159.5);
  // The pitch turns the camera where it is.
  const FlightCamera mounted = camera_of(
      "camera: {pitch_down_deg: 90, T_body_camera: [[0,0,1,0.5],[-1,0,0,0],[0,-1,0,0.25],[0,0,0,1]]}\n",
      World{});
  EXPECT_EQ(mounted.T_body_camera.translation, Eigen::Vector3d(0.5, 0, 0.25));
  EXPECT_LT((mounted.T_body_camera.rotation * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitZ()).norm(),
            1e-9);
}

TEST(FlightFile, NamesFileLineAndFieldOfWhatIsWrong) {
  const auto message = [](const std::string& text) {
    const auto flight = parse_flight(text, "f.yaml");
    return flight.ok() ? std::string("accepted") : flight.error().message;
  };
  const std::string points =
      "waypoints:\n  - {position: [0, 0, 1]}\n  - {position: [9, 0, 1], yaw_deg: 90}\n";
  ASSERT_EQ(message(points), "accepted");
  EXPECT_NEAR(parse_flight(points, "f")->waypoints[1].yaw, 1.5707963, 1e-6);
  EXPECT_THAT(message(""), HasSubstr("f.yaml"));
  EXPECT_THAT(message("speed: 3\n"), HasSubstr("waypoints"));
  EXPECT_THAT(message(points + "speed: fast\n"),
              testing::AllOf(HasSubstr("f.yaml:4"), HasSubstr("speed"), HasSubstr("fast")));
  EXPECT_THAT(message(points + "sped: 3\n"), testing::AllOf(HasSubstr("f.yaml:4"), HasSubstr("sped")));
  EXPECT_THAT(message(points + "limits: {tilt_deg: 400}\n"), HasSubstr("limits.tilt_deg"));
  EXPECT_THAT(message(points + "image: {color: true}\n"), HasSubstr("image.color"));
  EXPECT_THAT(message(points + "heading: north\n"), testing::AllOf(HasSubstr("north"), HasSubstr("path")));
  EXPECT_THAT(message(points + "frames: 2.5\n"), HasSubstr("whole number"));
  EXPECT_THAT(message("waypoints:\n  - {position: [0, 0]}\n"), HasSubstr("three numbers"));
  EXPECT_THAT(message("waypoints:\n  - {position: [0, 0, 1], pose: 3}\n"), HasSubstr("pose"));
  EXPECT_THAT(message(points + "camera: {distortion_model: funny}\n"), HasSubstr("funny"));
  EXPECT_THAT(message(points + "camera: {width: 0}\n"), HasSubstr("width"));
}

}  // namespace
}  // namespace pade::simulation

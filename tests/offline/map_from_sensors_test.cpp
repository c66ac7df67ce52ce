// From raw sensors to depth: a simulated flight is mapped with the poses that the navigation filter makes of
// its imu.csv and gnss.csv.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "pade/evaluation/navigation_score.hpp"
#include "pade/offline/camera/camera_feedback.hpp"
#include "pade/offline/checked_log.hpp"
#include "pade/offline/map_sequence.hpp"
#include "pade/offline/poses_from_sensors.hpp"
#include "pade/simulation/flight/simulated_sequence.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// Keeps the head of a table and the rows with a stamp up to `last`.
void cut_after(const fs::path& file, double last) {
  std::istringstream rows(text_of(file));
  std::ofstream out(file);
  for (std::string row; std::getline(rows, row);) {
    const bool is_number = !row.empty() && std::isdigit(static_cast<unsigned char>(row[0])) != 0;
    if (!is_number || std::stod(row) <= last + 1e-9) out << row << '\n';
  }
}

/// A table with all stamps later by `shift`, s.
void write_later(const fs::path& from, const fs::path& to, double shift) {
  std::istringstream rows(text_of(from));
  std::ofstream out(to);
  for (std::string row; std::getline(rows, row);) {
    const bool is_number = !row.empty() && std::isdigit(static_cast<unsigned char>(row[0])) != 0;
    if (is_number) {
      char stamp[32];
      std::snprintf(stamp, sizeof stamp, "%.6f", std::stod(row) + shift);
      row = stamp + row.substr(row.find(','));
    }
    out << row << '\n';
  }
}

/// One flight for all tests: along a wall with things in front of it, 12 s.
class MapFromSensors : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    root_ = fs::temp_directory_path() / ("pade_map_from_sensors_" + std::to_string(getpid()));
    fs::create_directories(root_);
    simulation::World world;
    const auto add = [&](const simulation::Shape& shape, const Eigen::Vector3d& at,
                         simulation::PatternKind kind) {
      simulation::Visual visual{"v", {Eigen::Quaterniond::Identity(), at}, shape, {}, true};
      visual.material.colour.setOnes();
      visual.material.pattern.kind = kind;
      world.visuals.push_back(std::move(visual));
    };
    add(simulation::Rectangle{{0, 0, 1}, {120, 120}}, {0, 0, 0}, simulation::PatternKind::gravel);
    add(simulation::Box{{1, 60, 14}}, {30, 0, 6}, simulation::PatternKind::brick);
    add(simulation::Box{{2, 2, 4}}, {24, 3.5, 2}, simulation::PatternKind::concrete);
    add(simulation::Cylinder{0.4, 5}, {22, -3, 2.5}, simulation::PatternKind::bark);
    world.sun = simulation::Sun{};
    auto scene = simulation::Scene::build(std::move(world));
    ASSERT_TRUE(scene);
    simulation::Flight flight;
    flight.name = "sensors";
    for (int i = 0; i < 6; ++i) {
      flight.waypoints.push_back({{-4.0 + 4 * i, 0.8 * (i % 2), 1.8 + 0.2 * (i % 3)}, 0.06 * (i % 2), {}});
    }
    flight.frames = 70;
    Camera camera;
    camera.width = 160;
    camera.height = 120;
    camera.fx = camera.fy = 138.6;
    camera.cx = 79.5;
    camera.cy = 59.5;
    flight.camera = camera;
    const Status written = simulation::write_sequence(*scene, flight, flown(), {});
    ASSERT_TRUE(written) << written.error().message;
  }
  static void TearDownTestSuite() { fs::remove_all(root_); }

  static fs::path flown() { return root_ / "flight"; }
  /// A copy of the flight, for tests that change it.
  static fs::path copy(const std::string& name) {
    fs::copy(flown(), root_ / name, fs::copy_options::recursive);
    return root_ / name;
  }
  static MapSequenceOptions options(const std::string& poses) {
    MapSequenceOptions options;
    options.sequence.poses = poses;
    options.report = false;
    return options;
  }
  static Result<io::Sequence> open(const fs::path& folder) {
    return open_sequence(folder, options(poses_from_sensors));
  }

  static inline fs::path root_;
};

TEST_F(MapFromSensors, GivesDepthNearlyAsGoodAsTheTruePosesDo) {
  double error[2];
  int index = 0;
  for (const char* poses : {"groundtruth", poses_from_sensors}) {
    const auto sequence = open_sequence(flown(), options(poses));
    ASSERT_TRUE(sequence) << sequence.error().message;
    EXPECT_GT(sequence->size(), 35U);
    io::RunWriterOptions output;
    output.image_size = sequence->camera().size();
    auto writer = io::RunWriter::create(root_ / poses, output);
    ASSERT_TRUE(writer);
    const auto result = map_sequence(*sequence, options(poses), *writer, 1);
    ASSERT_TRUE(result) << result.error().message;
    ASSERT_TRUE(result->accuracy);
    EXPECT_EQ(result->info.poses, poses == std::string("groundtruth") ? "groundtruth.txt" : poses);
    error[index++] = result->accuracy->all.relative_mean;
  }
  EXPECT_GT(error[1], error[0]) << "the baseline has an error";
  // In the first seconds after a start in motion yaw is known to some degrees: the baseline errs by a tenth.
  EXPECT_LT(error[1], error[0] + 0.15);
}

TEST_F(MapFromSensors, FramesCarryTheCovarianceOfTheirMotionAndItIsHonest) {
  const auto estimated = open(flown());
  ASSERT_TRUE(estimated) << estimated.error().message;
  const auto exact = open_sequence(flown(), options("groundtruth"));
  ASSERT_TRUE(exact);
  std::map<Time, Pose> truth;
  for (std::size_t i = 0; i < exact->size(); ++i) truth[exact->time(i)] = exact->pose(i);
  double nees = 0;
  double rotation_nees = 0;
  const std::size_t pairs = estimated->size() - 1;
  for (std::size_t i = 1; i <= pairs; ++i) {
    const auto frame = estimated->frame(i);
    ASSERT_TRUE(frame);
    const RelativeMotion motion = relative_motion(estimated->pose(i - 1), estimated->pose(i), 0.1);
    const RelativeMotion right =
        relative_motion(truth.at(estimated->time(i - 1)), truth.at(estimated->time(i)), 0.1);
    const Eigen::Vector3d dt = motion.t_reference_other - right.t_reference_other;
    const Eigen::Vector3d turn =
        rotation_log(Eigen::Matrix3d(motion.R_reference_other * right.R_reference_other.transpose()));
    EXPECT_LT(dt.norm(), 0.04);
    nees += dt.dot(frame->motion_covariance.topLeftCorner<3, 3>().ldlt().solve(dt));
    rotation_nees += turn.dot(frame->motion_covariance.bottomRightCorner<3, 3>().ldlt().solve(turn));
  }
  nees /= static_cast<double>(pairs);
  rotation_nees /= static_cast<double>(pairs);
  std::printf("frame to frame on the simulated flight: NEES of translation %.2f, of rotation %.2f (3)\n",
              nees, rotation_nees);
  EXPECT_GT(nees, 0.3);
  EXPECT_LT(nees, 8);  // errors of neighbours are one error: a single short flight scatters widely
  EXPECT_LT(rotation_nees, 6);
}

/// 95 % of the errors of the motions between frames, degrees.
struct MotionErrors {
  double rotation = 0, direction = 0, rotation_nees = 0, direction_nees = 0;
  std::size_t frames = 0;
};
MotionErrors errors_of(const io::Sequence& estimated, const io::Sequence& exact, double from) {
  constexpr double kDegree = 0.017453292519943295;
  std::map<Time, Pose> truth;
  for (std::size_t i = 0; i < exact.size(); ++i) truth[exact.time(i)] = exact.pose(i);
  std::vector<double> rotation, direction;
  MotionErrors errors;
  errors.frames = estimated.size();
  for (std::size_t i = 1; i < estimated.size(); ++i) {
    if (estimated.time(i).seconds() < from) continue;
    const RelativeMotion motion = relative_motion(estimated.pose(i - 1), estimated.pose(i), 0.1);
    const RelativeMotion right =
        relative_motion(truth.at(estimated.time(i - 1)), truth.at(estimated.time(i)), 0.1);
    const Eigen::Vector3d turn =
        rotation_log(Eigen::Matrix3d(motion.R_reference_other * right.R_reference_other.transpose()));
    const Eigen::Vector3d d = motion.t_reference_other.normalized();
    const Eigen::Vector3d d_right = right.t_reference_other.normalized();
    rotation.push_back(turn.norm() / kDegree);
    direction.push_back(std::acos(std::min(1.0, d.dot(d_right))) / kDegree);
    const Matrix6d covariance = estimated.frame(i)->motion_covariance;
    errors.rotation_nees += turn.dot(covariance.bottomRightCorner<3, 3>().ldlt().solve(turn));
    Eigen::Matrix<double, 3, 2> across;
    across.col(0) = d.unitOrthogonal();
    across.col(1) = d.cross(across.col(0));
    const Eigen::Vector2d aside = motion.t_reference_other.norm() * across.transpose() * (d - d_right);
    errors.direction_nees +=
        aside.dot((across.transpose() * covariance.topLeftCorner<3, 3>() * across).inverse() * aside);
  }
  const auto most = [](std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values.empty() ? 0 : values[values.size() * 95 / 100];
  };
  errors.rotation_nees /= static_cast<double>(rotation.size());
  errors.direction_nees /= static_cast<double>(rotation.size());
  errors.rotation = most(rotation);
  errors.direction = most(direction);
  return errors;
}

/// Largest error of the filter's own yaw from some time on, degrees.
double yaw_error(const fs::path& folder, const io::Sequence& images, double from) {
  constexpr double kDegree = 0.017453292519943295;
  const auto checked = read_checked_log(folder, {});
  EXPECT_TRUE(checked);
  NavigationRunOptions run;
  run.T_body_camera.rotation = Eigen::Quaterniond(forward_camera_rotation());
  run.navigator.filter.camera = true;
  for (std::size_t i = 0; i < images.size(); ++i) run.frames.push_back(images.time(i));
  CameraFeedback feedback(images, {}, checked->log, run.T_body_camera, 0);
  run.camera = std::ref(feedback);
  double largest = 0;
  for (const NavigationFrame& frame : run_navigation(checked->log, run).frames) {
    if (frame.time.seconds() < from) continue;
    const auto truth = evaluation::truth_at(checked->log.truth, frame.time);
    if (!truth) continue;
    const Eigen::Vector3d off = rotation_log(
        Eigen::Quaterniond(frame.pose.T_world_body.rotation * truth->T_world_body.rotation.conjugate()));
    largest = std::max(largest, std::abs(off.z()) / kDegree);
  }
  return largest;
}

TEST_F(MapFromSensors, TheCameraFedBackMakesTheMotionKnownWithoutACompass) {
  const fs::path blind = copy("no_compass");
  fs::remove(blind / "mag.csv");
  const auto exact = open_sequence(flown(), options("groundtruth"));
  ASSERT_TRUE(exact);
  MapSequenceOptions fed = options(poses_from_sensors);
  fed.navigation.filter.camera = true;
  const auto print = [](const char* what, const MotionErrors& one) {
    std::printf(
        "%s: %zu frames; 95 %% from 4 s on: rotation %.4f, direction %.2f deg; NEES of rotation %.2f (3), "
        "direction "
        "%.2f (2)\n",
        what, one.frames, one.rotation, one.direction, one.rotation_nees, one.direction_nees);
  };
  const auto alone = open(flown());
  ASSERT_TRUE(alone);
  print("sensors alone", errors_of(*alone, *exact, 4));
  EXPECT_FALSE(open(blind)) << "hardly a frame has a pose";
  for (const fs::path& folder : {flown(), blind}) {
    const auto sequence = open_sequence(folder, fed);
    ASSERT_TRUE(sequence) << sequence.error().message;
    const MotionErrors errors = errors_of(*sequence, *exact, 4);
    print(folder == blind ? "camera fed back, no compass" : "camera fed back", errors);
    for (const std::string& note : sequence->notes()) std::printf("  %s\n", note.c_str());
    EXPECT_THAT(sequence->notes(), testing::Contains(HasSubstr("the camera is fed back")));
    EXPECT_GT(errors.frames, 60U);
    EXPECT_LT(errors.rotation, 0.025);
    EXPECT_LT(errors.direction, 1);
    EXPECT_LT(errors.rotation_nees, 5);
    EXPECT_LT(errors.direction_nees, 3.3);
    const double yaw = yaw_error(folder, *exact, 5);
    std::printf("  the filter's own yaw is wrong by at most %.2f degrees from 5 s on\n", yaw);
    EXPECT_LT(yaw, 2);
  }
}

TEST_F(MapFromSensors, ACameraThatCannotBeFedBackIsRefused) {
  MapSequenceOptions fed = options("groundtruth");
  fed.navigation.filter.camera = true;
  const auto refusal = [&] {
    const auto sequence = open_sequence(flown(), fed);
    return sequence ? std::string("accepted") : sequence.error().message;
  };
  EXPECT_THAT(refusal(), HasSubstr("the poses are groundtruth, expected from-imu-gnss"));
  fed.sequence.poses = poses_from_sensors;
  EXPECT_EQ(refusal(), "accepted");
  fed.mapper.refinement.on = false;
  EXPECT_THAT(refusal(), HasSubstr("mapper.refinement.on (--refine-motion) is off, expected on"));
}

TEST_F(MapFromSensors, UsesNothingThatTheSensorsShowAfterAFrame) {
  const auto whole = open(flown());
  ASSERT_TRUE(whole) << whole.error().message;
  const fs::path shorter = copy("shorter");
  const Time last = whole->time(whole->size() - 10);
  for (const char* file : {"imu.csv", "gnss.csv", "baro.csv", "mag.csv"})
    cut_after(shorter / file, last.seconds());
  const auto part = open(shorter);
  ASSERT_TRUE(part) << part.error().message;
  ASSERT_EQ(part->size(), whole->size() - 9);
  for (std::size_t i = 0; i < part->size(); ++i) {
    ASSERT_EQ(part->pose(i).translation, whole->pose(i).translation) << i;
    ASSERT_EQ(part->pose(i).rotation.coeffs(), whole->pose(i).rotation.coeffs()) << i;
  }
}

TEST_F(MapFromSensors, NamesWhatIsMissing) {
  const auto refusal = [](const fs::path& folder) {
    const auto sequence = open(folder);
    return sequence ? std::string("accepted") : sequence.error().message;
  };
  const fs::path broken = copy("broken");
  const std::string gnss = text_of(broken / "gnss.csv");
  std::ofstream(broken / "gnss.csv") << gnss.substr(gnss.find('\n') + 1);
  EXPECT_THAT(refusal(broken), HasSubstr("no frame given"));
  fs::remove(broken / "gnss.csv");
  EXPECT_THAT(refusal(broken),
              HasSubstr("no GNSS positions and velocities found, expected them in gnss.csv"));
  const std::string imu = text_of(broken / "imu.csv");
  std::ofstream(broken / "gnss.csv") << gnss;
  std::ofstream(broken / "imu.csv") << imu.substr(imu.find('\n') + 1);
  EXPECT_THAT(refusal(broken), HasSubstr("no frame given"));
  fs::remove(broken / "imu.csv");
  EXPECT_THAT(refusal(broken), HasSubstr("no IMU log found"));
  std::ofstream(broken / "imu.csv") << imu;
  std::istringstream calibration(text_of(broken / "camera.yaml"));
  std::ostringstream without;
  for (std::string row; std::getline(calibration, row);) {
    if (row.find("T_body_camera") == std::string::npos) without << row << '\n';
  }
  std::ofstream(broken / "camera.yaml") << without.str();
  EXPECT_THAT(refusal(broken), HasSubstr("T_body_camera"));
  // Before the clocks are looked at, which takes minutes.
  MapSequenceOptions searched = options(poses_from_sensors);
  searched.time_offset = "auto";
  int looked_at = 0;
  const auto sequence = open_sequence(broken, searched, {}, [&](std::size_t, std::size_t) {
    ++looked_at;
    return true;
  });
  ASSERT_FALSE(sequence);
  EXPECT_THAT(sequence.error().message, HasSubstr("T_body_camera is missing"));
  EXPECT_EQ(looked_at, 0);
  const fs::path silent = copy("silent");
  cut_after(silent / "gnss.csv", 0.3);
  cut_after(silent / "mag.csv", -1);
  EXPECT_THAT(refusal(silent),
              testing::AnyOf(HasSubstr("never knew its yaw"), HasSubstr("no rows"), HasSubstr("no row")));
}

TEST_F(MapFromSensors, SensorsOfAnotherPlaceAndClockGiveTheSamePoses) {
  constexpr double kShift = 1000.25;
  const fs::path images = copy("images"), log = root_ / "autopilot";
  fs::create_directories(log);
  for (const char* file : {"imu.csv", "gnss.csv", "baro.csv", "mag.csv"}) {
    write_later(flown() / file, log / file, kShift);
    fs::remove(images / file);
  }
  MapSequenceOptions apart = options(poses_from_sensors);
  apart.log = log.string();
  const auto refusal = [&] {
    const auto sequence = open_sequence(images, apart);
    return sequence ? std::string("accepted") : sequence.error().message;
  };
  apart.time_offset = "1000.25";
  const auto together = open(flown());
  ASSERT_TRUE(together);
  const auto sequence = open_sequence(images, apart);
  ASSERT_TRUE(sequence) << sequence.error().message;
  ASSERT_EQ(sequence->size(), together->size());
  for (std::size_t i = 0; i < sequence->size(); ++i) {
    ASSERT_EQ(sequence->pose(i).translation, together->pose(i).translation) << i;
    ASSERT_EQ(sequence->pose(i).rotation.coeffs(), together->pose(i).rotation.coeffs()) << i;
  }
  EXPECT_THAT(sequence->notes(), testing::Contains(HasSubstr("image + 1000.250000 s, as was given")));
  EXPECT_THAT(sequence->notes(), testing::Contains(HasSubstr("the sensors are those of " + log.string())));

  apart.time_offset = "";  // camera.yaml says 0
  EXPECT_THAT(refusal(), HasSubstr("pade calibrate time finds the offset"));
  apart.time_offset = "soon";
  EXPECT_THAT(refusal(), HasSubstr("--time-offset: found \"soon\", expected seconds or auto"));
  std::string calibration = text_of(images / "camera.yaml");
  const auto at = calibration.find("time_offset_s");
  ASSERT_NE(at, std::string::npos);
  std::ofstream(images / "camera.yaml") << calibration.erase(at, calibration.find('\n', at) + 1 - at);
  apart.time_offset = "";
  EXPECT_THAT(refusal(), HasSubstr("how its clock relates to that of the images is not said"));
  apart.time_offset = "0.5";
  EXPECT_THAT(refusal(), HasSubstr("expected some of the"));
  apart.sequence.poses = "groundtruth";
  EXPECT_THAT(refusal(), HasSubstr("--log: found"));
}

TEST_F(MapFromSensors, TheOffsetIsFoundOrRefused) {
  constexpr double kShift = -3.125;
  const fs::path images = copy("unknown_clock");
  write_later(flown() / "imu.csv", images / "imu.csv", 100 + kShift);
  for (const char* file : {"gnss.csv", "baro.csv", "mag.csv"})
    write_later(flown() / file, images / file, 100 + kShift);
  MapSequenceOptions searched = options(poses_from_sensors);
  searched.time_offset = "auto";
  const auto sequence = open_sequence(images, searched);
  if (sequence) {
    std::string note;
    for (const std::string& one : sequence->notes())
      if (one.find("time of a pose") == 0) note = one;
    std::printf("%s\n", note.c_str());
    double offset = 0;
    ASSERT_EQ(std::sscanf(note.c_str(), "time of a pose = time of the image + %lf s", &offset), 1);
    ASSERT_NE(note.find("1 sigma "), std::string::npos);
    const double sigma = 1e-3 * std::stod(note.substr(note.find("1 sigma ") + 8));
    EXPECT_LT(std::abs(offset - 100 - kShift), 5 * sigma);
    EXPECT_LT(sigma, 0.02);
  } else {  // seven seconds of small images with few turns may be too little, and then it says so
    EXPECT_THAT(sequence.error().message, HasSubstr("fit nearly alike"));
  }

  // The IMU of a vehicle that stands.
  std::ofstream imu(images / "imu.csv");
  imu << "# frame=FLU\nt_s,gx,gy,gz,ax,ay,az\n";
  for (int i = 0; i < 4000; ++i) imu << 100 + 0.005 * i << ",0,0," << 1e-5 * (i % 3) << ",0,0,9.81\n";
  imu.close();
  const auto refused = open_sequence(images, searched);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("expected"));
  EXPECT_THAT(refused.error().message, HasSubstr("the IMU at 0.0 deg/s"));
  EXPECT_THAT(refused.error().message, testing::Not(HasSubstr("were not compared")));

  // Images that come more slowly than they are compared.
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(images / "rgb")) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (std::size_t i = 0; i < files.size(); ++i)
    if (i % 8 != 0) fs::remove(files[i]);
  const auto slow = open_sequence(images, searched);
  ASSERT_FALSE(slow);
  EXPECT_THAT(slow.error().message, HasSubstr("8 pairs lie more than 0.5 s apart and were not compared"));
}

}  // namespace
}  // namespace pade

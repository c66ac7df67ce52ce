// `pade calibrate`: how the clock of a camera and its mounting relate to an IMU's.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>

#include "pade/io/atomic_output.hpp"
#include "pade/offline/calibration/clock_calibration.hpp"

#include "commands.hpp"
#include "options/json_text.hpp"
#include "options/sensor_log.hpp"
#include "progress.hpp"

namespace pade::cli {
namespace {

constexpr double kToDegrees = 180 / std::numbers::pi;

struct CalibrateArguments {
  std::string images, imu, calibration, topics, imu_topics;
  int camera = 0;
  bool json = false;
  bool mounting = false;  // asked for, rather than the time
};

struct Calibrated {
  ClockCalibration found;
  std::optional<Pose> T_body_camera;  ///< of the calibration
  std::size_t images = 0, samples = 0;
  double image_span = 0, imu_span = 0;  ///< s
  std::vector<std::string> notes;
};

Result<Calibrated> calibrate(const CalibrateArguments& arguments) {
  io::SequenceOptions options;
  options.calibration = arguments.calibration;
  options.camera = arguments.camera;
  options.topics = arguments.topics;
  const bool apart = !arguments.imu.empty();
  if (!arguments.imu_topics.empty() && !apart)
    return Error{
        "--imu-topics: found it without --imu, expected --topics: the images and the IMU are in one place"};
  const std::string log = apart ? arguments.imu : arguments.images;
  const auto imu = read_imu_log(log, apart ? arguments.imu_topics : arguments.topics);
  if (!imu) return imu.error();
  const auto images = open_images(arguments.images, options);
  if (!images) return images.error();
  Progress progress("Comparing turns", 2 * images->size());
  const auto found = calibrate_clock(*images, imu->imu, [&](std::size_t done, std::size_t) {
    progress.show(done, "");
    return !io::interrupted();
  });
  if (!found) return found.error();
  Calibrated out{*found,
                 images->calibration().T_body_camera,
                 images->size(),
                 imu->imu.size(),
                 seconds_between(images->time(0), images->time(images->size() - 1)),
                 seconds_between(imu->imu.front().time, imu->imu.back().time),
                 notes_on(*found, images->calibration().T_body_camera)};
  for (const io::Skipped& one : images->skipped())
    out.notes.push_back(fmt::format("skipped {}: {}", one.file, one.reason));
  out.notes.insert(out.notes.end(), images->notes().begin(), images->notes().end());
  out.notes.insert(out.notes.end(), imu->remarks.begin(), imu->remarks.end());
  if (arguments.mounting &&
      found->alignment.mounting_sigma().maxCoeff() * kToDegrees > largest_mounting_sigma) {
    return Error{fmt::format("{}: {}, expected each to within {:g} deg", arguments.images,
                             fmt::join(untold_axes(found->alignment), "; "), largest_mounting_sigma)};
  }
  return out;
}

/// T_body_camera as camera.yaml has it.
std::string rows_of(const Calibrated& calibrated) {
  const Eigen::Matrix3d R = calibrated.found.alignment.R_body_camera.toRotationMatrix();
  const Eigen::Vector3d t =
      calibrated.T_body_camera ? calibrated.T_body_camera->translation : Eigen::Vector3d::Zero();
  std::string text = "[";
  for (int row = 0; row < 3; ++row)
    text += fmt::format("[{:.6f}, {:.6f}, {:.6f}, {:g}], ", R(row, 0), R(row, 1), R(row, 2), t[row]);
  return text + "[0, 0, 0, 1]]";
}

struct View {
  double up = 0, left = 0, clockwise = 0;  ///< degrees
};
/// Where the camera looks from the body, and how it is turned about its optical axis.
View view_of(const Eigen::Quaterniond& R_body_camera) {
  const Eigen::Matrix3d R = R_body_camera.toRotationMatrix();
  const Eigen::Vector3d f = R.col(2);
  View view;
  view.up = std::asin(std::clamp(f.z(), -1.0, 1.0)) * kToDegrees;
  view.left = std::hypot(f.x(), f.y()) > 0.02 ? std::atan2(f.y(), f.x()) * kToDegrees : 0;
  const double yaw = view.left / kToDegrees;
  const Eigen::Vector3d right(std::sin(yaw), -std::cos(yaw), 0);  // of a camera that is level
  view.clockwise = std::atan2(R.col(0).dot(f.cross(right)), R.col(0).dot(right)) * kToDegrees;
  return view;
}

void print_json(const Calibrated& calibrated) {
  const TurnAlignment& a = calibrated.found.alignment;
  const auto array = [](const auto& vector, double factor) {
    return nlohmann::ordered_json{factor * vector[0], factor * vector[1], factor * vector[2]};
  };
  const Eigen::Quaterniond& q = a.R_body_camera;
  nlohmann::ordered_json json = {
      {"time_offset_s", a.offset},
      {"time_offset_sigma_s", a.offset_sigma},
      {"drift", a.drift},
      {"drift_sigma", a.drift_sigma},
      {"R_body_camera_xyzw", {q.x(), q.y(), q.z(), q.w()}},
      {"mounting_sigma_deg", array(a.mounting_sigma(), kToDegrees)},
      {"gyro_bias_rad_s", array(a.gyro_bias, 1)},
      {"turn_rates_deg_s", array(a.turn_rates, kToDegrees)},
      {"residual_deg", a.residual * kToDegrees},
      {"correlation", a.correlation},
      {"runner_up", a.runner_up > 0 ? nlohmann::ordered_json{{"time_offset_s", a.runner_up_offset},
                                                             {"correlation", a.runner_up}}
                                    : nlohmann::ordered_json()},
      {"searched_s", {a.searched_from, a.searched_to}},
      {"images", calibrated.images},
      {"imu_samples", calibrated.samples},
      {"pairs",
       {{"compared", a.pairs},
        {"outliers", a.outliers},
        {"moving", calibrated.found.images.moving},
        {"still", calibrated.found.images.still},
        {"blank", calibrated.found.images.blank},
        {"contradicted", calibrated.found.images.contradicted}}},
      {"first_image", to_string(a.first)},
      {"last_image", to_string(a.last)},
      {"notes", calibrated.notes}};
  fmt::print("{}\n", json_text(json));
}

void print_found(const CalibrateArguments& arguments, const Calibrated& calibrated) {
  const TurnAlignment& a = calibrated.found.alignment;
  const TurnTally& t = calibrated.found.images;
  const Eigen::Vector3d sigma = a.mounting_sigma() * kToDegrees;
  const View view = view_of(a.R_body_camera);
  fmt::print(
      "{:14} {} in {:.1f} s; of {} pairs {} told a turn beside a motion, {} without parallax, {} none\n",
      "Images", calibrated.images, calibrated.image_span, t.pairs, t.moving, t.still,
      t.blank + t.contradicted);
  fmt::print("{:14} {} samples in {:.1f} s\n", "IMU", calibrated.samples, calibrated.imu_span);
  fmt::print(
      "{:14} roll {:.1f}, pitch {:.1f}, yaw {:.1f} deg/s (root of mean square); {} pairs compared, {} of "
      "them "
      "hardly counted\n",
      "Turns", a.turn_rates.x() * kToDegrees, a.turn_rates.y() * kToDegrees, a.turn_rates.z() * kToDegrees,
      a.pairs, a.outliers);
  fmt::print(
      "{:14} t_imu = t_image + {:.5f} s, 1 sigma {:.2f} ms (searched {:.1f} to {:.1f} s; correlation "
      "{:.3f}{})\n",
      "Time offset", a.offset, 1e3 * a.offset_sigma, a.searched_from, a.searched_to, a.correlation,
      a.runner_up > 0 ? fmt::format(", {:.3f} at the next best, {:.3f} s", a.runner_up, a.runner_up_offset)
                      : std::string());
  fmt::print(
      "{:14} looks {:.2f} deg {}, {:.2f} deg {}, turned {:.2f} deg {}clockwise; 1 sigma about forward, left, "
      "up "
      "{:.2f}, {:.2f}, {:.2f} deg\n",
      "Mounting", std::abs(view.up), view.up < 0 ? "down" : "up", std::abs(view.left),
      view.left < 0 ? "right" : "left", std::abs(view.clockwise), view.clockwise < 0 ? "counter" : "",
      sigma.x(), sigma.y(), sigma.z());
  for (const std::string& note : calibrated.notes) fmt::print("{:14} {}\n", "  note", note);
  fmt::print("\nWrite into camera.yaml:\n  time_offset_s: {:.5f}\n", a.offset);
  if (sigma.maxCoeff() < largest_mounting_sigma)
    fmt::print("  T_body_camera: {}{}\n", rows_of(calibrated),
               calibrated.T_body_camera
                   ? ""
                   : "  # place in metres (last column): measure it, turns do not tell it");
  constexpr double kLargestLive = 1;  // s, SessionOptions::time_offset
  if (std::abs(a.offset) < kLargestLive) {
    fmt::print("For pade live, if these were its own camera and clock: session: {{time_offset: {:.5f}}}\n",
               a.offset);
  }
  if (!arguments.imu.empty()) {
    fmt::print("Or map with it: pade map {} --poses from-imu-gnss --log {} --time-offset {:.5f} --out RUN\n",
               arguments.images, arguments.imu, a.offset);
  }
}

void add_one(CLI::App& calibrate_command, Context& context, bool mounting) {
  auto a = std::make_shared<CalibrateArguments>();
  a->mounting = mounting;
  CLI::App* command =
      mounting ? calibrate_command.add_subcommand(
                     "mounting",
                     "How a camera is turned on the body, and its clock: refused where an "
                     "axis is not told.")
               : calibrate_command.add_subcommand(
                     "time", "Offset between the clocks of a camera and an IMU, and the camera's mounting.");
  command->footer(
      "Turns that the images show are compared with the gyroscope's, at every offset at which the two "
      "overlap.\n"
      "No poses, no GNSS and no guess are needed; turns about two axes are. docs/calibration.md has the "
      "how-to.\n"
      "Examples:\n" +
      fmt::format("  pade calibrate {0} images --imu flight.ulg\n  pade calibrate {0} flight.bag",
                  mounting ? "mounting" : "time"));
  command->add_option("images", a->images, "folder or recording with the images (docs/sequences.md)")
      ->required();
  command->add_option(
      "--imu", a->imu,
      "log with the IMU, as pade navigate reads it: .ulg, .tlog, a recording of ROS, a folder "
      "(default: where the images are)");
  command->add_option("--calibration", a->calibration, "calibration file instead of the sequence's own");
  command->add_option("--camera", a->camera, "which camera of a calibration file that holds several, from 0")
      ->check(CLI::Range(0, 99));
  command->add_option(
      "--topics", a->topics,
      "topics of the images' recording that are meant where several fit, separated by blanks");
  command->add_option("--imu-topics", a->imu_topics, "the same of the recording of --imu");
  command->add_flag("--json", a->json, "print the result as JSON");
  command->callback([a, &context] {
    io::watch_for_interrupts();
    cv::setNumThreads(1);
    const auto result = calibrate(*a);
    if (!result) {
      fmt::print(stderr, "pade calibrate {}: {}\n", a->mounting ? "mounting" : "time",
                 result.error().message);
      context.exit_code = io::interrupted() ? 130 : 1;
    } else if (a->json) {
      print_json(*result);
    } else {
      print_found(*a, *result);
    }
  });
}

}  // namespace

void add_calibrate(CLI::App& app, Context& context) {
  CLI::App* command =
      app.add_subcommand("calibrate", "Clock and mounting of a camera on a body with an IMU.");
  command->require_subcommand(1);
  add_one(*command, context, false);
  add_one(*command, context, true);
}

}  // namespace pade::cli

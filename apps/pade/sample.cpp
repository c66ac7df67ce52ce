// `pade sample`: writes a flight through an analytic scene as a TUM RGB-D sequence with exact poses and
// depth, so that everything can be tried without a download.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/io/atomic_output.hpp"
#include "pade/io/image/image_codec.hpp"
#include "pade/io/sequence/trajectory.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

#include "commands.hpp"
#include "options/json_text.hpp"
#include "options/own_folder.hpp"
#include "progress.hpp"

namespace pade::cli {
namespace {

constexpr double kDepthScale = 1000;  // counts per metre
constexpr double kSensorNoise = 1.0;  // grey levels
constexpr std::string_view kReadMe = "README.md";
constexpr std::string_view kFirstWords = "A made-up flight (`pade sample";
constexpr std::array<std::string_view, 7> kWritten = {
    "rgb", "depth", "rgb.txt", "depth.txt", "groundtruth.txt", "camera.yaml", kReadMe};

struct SampleArguments {
  std::string out;
  std::string flight = "courtyard";
  int frames = 40;
  std::uint64_t seed = 1;
  int threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  bool force = false;
  bool json = false;
};

Status write_png(const io::OutputFolder& folder, const std::string& name, const cv::Mat& image) {
  const std::vector<std::uint8_t> png = io::encode_png(image);
  if (png.empty()) return Error{fmt::format("{}: cannot be encoded as PNG", name)};
  return folder.write(name, png);
}

cv::Mat depth_counts(const cv::Mat& depth) {
  cv::Mat counts(depth.size(), CV_16UC1);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const double value = std::round(depth.at<float>(v, u) * kDepthScale);
      counts.at<std::uint16_t>(v, u) = value > 0 && value <= 65535 ? static_cast<std::uint16_t>(value) : 0;
    }
  }
  return counts;
}

std::string camera_yaml(const Camera& camera) {
  return fmt::format(
      "# Ideal pinhole: images need no undistortion.\n"
      "width: {}\nheight: {}\nfx: {}\nfy: {}\ncx: {}\ncy: {}\n"
      "distortion_model: plumb_bob\ndistortion: [0, 0, 0, 0, 0]\n"
      "depth_scale: {}   # depth_png / depth_scale = metres along the optical axis (z), 0 = no depth (sky)\n"
      "pose_convention: camera_to_world_optical\n"
      "world_up: \"+z\"\n",
      camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, kDepthScale);
}

std::string read_me(const SampleArguments& arguments) {
  return fmt::format(
      "{} --flight {} --frames {} --seed {}`) in the TUM RGB-D layout.\n\n"
      "rgb/ 8-bit grey images at 10 Hz with {} grey level of sensor noise; depth/ exact depth Z of each "
      "pixel centre;\n"
      "groundtruth.txt exact camera poses (world ENU, metres; camera x right, y down, z forward).\n"
      "The scene is made of planes, boxes and balls, most of them textured; one wing of the building is "
      "blank.\n",
      kFirstWords, arguments.flight, arguments.frames, arguments.seed, kSensorNoise);
}

Status write_frames(const simulation::AnalyticFlight& flight, const SampleArguments& arguments,
                    const io::OutputFolder& folder) {
  std::string images = "# timestamp filename\n";
  std::string depths = images;
  std::vector<io::StampedPose> poses;
  Progress progress("Rendering", flight.times.size());
  for (std::size_t k = 0; k < flight.times.size(); ++k) {
    if (io::interrupted()) return io::interrupted_error();
    const Pose& pose = flight.T_world_camera[k];
    simulation::AnalyticRenderOptions options;
    options.noise_sigma = kSensorNoise;
    options.noise_seed = arguments.seed * 1000003 + k;
    options.threads = arguments.threads;
    const cv::Mat image = simulation::render_image(flight.scene, flight.camera, pose, options);
    const cv::Mat depth = simulation::exact_depth(flight.scene, flight.camera, pose, arguments.threads);

    const std::string stamp = to_string(flight.times[k]);
    if (Status s = write_png(folder, fmt::format("rgb/{}.png", stamp), image); !s) return s;
    if (Status s = write_png(folder, fmt::format("depth/{}.png", stamp), depth_counts(depth)); !s) return s;
    images += fmt::format("{0} rgb/{0}.png\n", stamp);
    depths += fmt::format("{0} depth/{0}.png\n", stamp);
    poses.push_back({flight.times[k], pose});
    progress.step();
  }
  if (Status s = folder.write("rgb.txt", images); !s) return s;
  if (Status s = folder.write("depth.txt", depths); !s) return s;
  if (Status s = folder.write("groundtruth.txt", io::format_trajectory(poses)); !s) return s;
  if (Status s = folder.write("camera.yaml", camera_yaml(flight.camera)); !s) return s;
  return folder.write(kReadMe, read_me(arguments));
}

Status write_sample(const SampleArguments& arguments) {
  const auto flight = simulation::make_analytic_flight(arguments.flight, arguments.frames);
  if (!flight) return flight.error();
  if (arguments.force) {
    if (Status own = check_own(arguments.out, {kReadMe, kFirstWords, kWritten}); !own) return own;
  }
  auto folder = io::OutputFolder::create(
      arguments.out, arguments.force ? io::Overwrite::replace : io::Overwrite::refuse, kReadMe);
  if (!folder) return folder.error();
  if (Status s = write_frames(*flight, arguments, *folder); !s) return s;
  return folder->commit();
}

void run(const SampleArguments& arguments, Context& context) {
  io::watch_for_interrupts();
  if (const Status status = write_sample(arguments); !status) {
    fmt::print(stderr, "pade sample: {}\n", status.error().message);
    context.exit_code = io::interrupted() ? 130 : 1;
    return;
  }
  if (arguments.json) {
    const nlohmann::ordered_json json = {
        {"out", arguments.out}, {"flight", arguments.flight}, {"frames", arguments.frames}};
    fmt::print("{}\n", json_text(json, -1));
  } else {
    fmt::print("{}: {} frames of the flight \"{}\" with exact poses and depth\n", arguments.out,
               arguments.frames, arguments.flight);
  }
}

}  // namespace

void add_sample(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<SampleArguments>();
  CLI::App* sample =
      app.add_subcommand("sample", "Write a made-up flight with exact poses and depth, to try things on.");
  sample->footer(
      "The flight is a folder in the TUM RGB-D layout (rgb/, depth/, groundtruth.txt, camera.yaml).\n"
      "Try it:  pade sample --out flight && pade map flight --out run");
  sample->add_option("-o,--out", arguments->out, "folder to write")->required();
  sample->add_option("--frames", arguments->frames, "number of frames, 10 per second")
      ->check(CLI::Range(2, 10000))
      ->capture_default_str();
  sample->add_option("--flight", arguments->flight, "which flight")
      ->check(CLI::IsMember(simulation::analytic_flight_names()))
      ->capture_default_str();
  sample->add_option("--seed", arguments->seed, "of the sensor noise")->capture_default_str();
  sample->add_option("--threads", arguments->threads, "the result does not depend on it")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  sample->add_flag("--force", arguments->force, "replace a flight that this command wrote");
  sample->add_flag("--json", arguments->json, "print the result as JSON");
  sample->callback([arguments, &context] { run(*arguments, context); });
}

}  // namespace pade::cli

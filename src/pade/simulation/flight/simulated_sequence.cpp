#include "pade/simulation/flight/simulated_sequence.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <future>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/core/version.hpp"
#include "pade/io/formats/flow_file.hpp"
#include "pade/io/image/image_codec.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/text.hpp"
#include "pade/simulation/flight/frame_maker.hpp"
#include "pade/simulation/flight/sensor_files.hpp"
#include "pade/simulation/render/truth.hpp"
#include "pade/simulation/world/geometry.hpp"
#include "pade/simulation/world/world_fingerprint.hpp"

namespace pade::simulation {
namespace {

namespace fs = std::filesystem;

std::string image_name(Time time) { return fmt::format("{}.png", to_string(time)); }

std::string row(const Eigen::Vector3d& v) {
  return fmt::format("{:.17g} {:.17g} {:.17g}", v.x(), v.y(), v.z());
}

/// Raised when the renderer gives other bytes for the same world, so that old frames are not mixed with new.
constexpr int kRendererRevision = 3;

/// Everything that decides the bytes of the sequence, as text.
std::string record(const Scene& scene, const Flight& flight, const FlightCamera& camera,
                   const SequenceOptions& options) {
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  for (const Waypoint& w : flight.waypoints)
    points.push_back(row(w.position) + fmt::format(" {:.17g} {:.17g}", w.yaw, w.time.value_or(-1)));
  const TrajectoryOptions& t = flight.trajectory;
  nlohmann::ordered_json swings = nlohmann::ordered_json::array();
  for (const Oscillation* o : {&t.roll, &t.pitch, &t.yaw})
    swings.push_back(fmt::format("{:.17g} {:.17g} {:.17g}", o->amplitude, o->period, o->phase));
  const Camera& c = camera.camera;
  const nlohmann::ordered_json all = {
      {"made_by", fmt::format("pade {} simulate", version)},
      {"renderer_revision", kRendererRevision},
      {"world", {{"name", scene.world().name}, {"fingerprint", world_fingerprint(scene.world())}}},
      {"flight",
       {{"name", flight.name},
        {"waypoints", points},
        {"speed", t.speed},
        {"heading", to_name(t.heading)},
        {"start", to_name(t.start)},
        {"end", to_name(t.end)},
        {"drag", t.drag},
        {"roll_pitch_yaw", swings},
        {"frame_rate", flight.frame_rate},
        {"first_frame_s", flight.first_frame},
        {"frames", flight.frames},
        {"exposure_time_s", flight.exposure_time},
        {"blur_samples", flight.blur_samples}}},
      {"camera",
       {{"size", {c.width, c.height}},
        {"intrinsics", {c.fx, c.fy, c.cx, c.cy}},
        {"model", static_cast<int>(c.distortion)},
        {"distortion", c.coefficients},
        {"translation", row(camera.T_body_camera.translation)},
        {"rotation", row(rotation_log(camera.T_body_camera.rotation))}}},
      {"image", io::json_of(camera.image)},
      {"sensors", io::json_of(flight.sensors)},
      {"render", io::json_of(options.render)},
      {"seed", options.seed},
      {"every", options.every},
      {"save_flow", options.save_flow}};
  return all.dump(2) + "\n";
}

std::string camera_yaml(const FlightCamera& camera) {
  const Camera& c = camera.camera;
  constexpr std::array names = {"none", "plumb_bob", "rational_polynomial", "equidistant"};
  constexpr std::array<std::size_t, 4> counts = {0, 5, 8, 4};
  const auto model = static_cast<std::size_t>(c.distortion);
  std::string coefficients;
  for (std::size_t i = 0; i < counts[model]; ++i)
    coefficients += fmt::format("{}{:.17g}", i > 0 ? ", " : "", c.coefficients[i]);
  const Eigen::Matrix3d R = camera.T_body_camera.matrix3();
  const Eigen::Vector3d& t = camera.T_body_camera.translation;
  std::string mount;
  for (int i = 0; i < 3; ++i)
    mount += fmt::format("[{:.17g}, {:.17g}, {:.17g}, {:.17g}], ", R(i, 0), R(i, 1), R(i, 2), t[i]);
  return fmt::format(
      "# a simulated camera; depth_png / depth_scale = metres along the optical axis, exact, 0 = nothing "
      "there\n"
      "width: {}\nheight: {}\nfx: {:.17g}\nfy: {:.17g}\ncx: {:.17g}\ncy: {:.17g}\n"
      "distortion_model: {}\ndistortion: [{}]\ndepth_scale: {}\n"
      "pose_convention: camera_to_world_optical\nworld_up: \"+z\"\nT_body_camera: [{}[0, 0, 0, "
      "1]]\ntime_offset_s: 0\n"
      "geographic_origin: [{}]\n",
      c.width, c.height, c.fx, c.fy, c.cx, c.cy, names[model], coefficients, simulated_depth_scale, mount,
      geographic_origin_text);
}

std::string ground_truth(const std::vector<CameraStation>& stations) {
  std::string text = "# timestamp tx ty tz qx qy qz qw: T_world_camera, world ENU, metres\n";
  for (const CameraStation& s : stations) {
    const Eigen::Vector3d& p = s.T_world_camera.translation;
    const Eigen::Quaterniond& q = s.T_world_camera.rotation;
    text += fmt::format("{} {:.9f} {:.9f} {:.9f} {:.12f} {:.12f} {:.12f} {:.12f}\n", to_string(s.time), p.x(),
                        p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

Result<std::string> png_bytes(const fs::path& file, const cv::Mat& image) {
  // A fast setting: noise does not compress, whatever the effort.
  const auto bytes = io::encode_png(image, {.level = 1, .runs_only = true, .left_filter = false});
  if (bytes.empty()) return Error{fmt::format("{}: cannot be encoded", file.string())};
  return std::string(bytes.begin(), bytes.end());
}

Status write_png(const fs::path& file, const cv::Mat& image) {
  const Result<std::string> bytes = png_bytes(file, image);
  return bytes ? io::write_file(file, *bytes, io::Overwrite::replace) : Status(bytes.error());
}

cv::Mat depth_counts(const cv::Mat& depth) {
  cv::Mat counts(depth.size(), CV_16UC1);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const double scaled = std::round(static_cast<double>(depth.at<float>(v, u)) * simulated_depth_scale);
      counts.at<std::uint16_t>(v, u) =
          scaled >= 1 && scaled <= 65535 ? static_cast<std::uint16_t>(scaled) : std::uint16_t{0};
    }
  }
  return counts;
}

/// The folder in which an unfinished sequence waits.
fs::path partial_folder(const fs::path& out) {
  return out.parent_path() / fmt::format(".{}.unfinished", out.filename().string());
}

/// Files that a killed run was just writing.
void remove_fragments(const fs::path& folder) {
  std::error_code ignored;
  for (const auto& entry : fs::recursive_directory_iterator(folder, ignored)) {
    if (entry.path().filename().string().starts_with(".")) fs::remove(entry.path(), ignored);
  }
}

/// Makes or takes up the work folder of a sequence.
Status prepare(const fs::path& work, const std::string& text, const SequenceOptions& options) {
  std::error_code failed;
  const auto found = io::read_file(work / simulation_record);
  if (found && *found == text) {
    remove_fragments(work);
  } else {
    fs::remove_all(work, failed);
  }
  std::vector<std::string> folders = {"rgb", "depth"};
  if (options.save_flow)
    folders.insert(folders.end(), {"flow_next", "flow_previous", "visible_next", "visible_previous"});
  for (const std::string& folder : folders) {
    fs::create_directories(work / folder, failed);
    if (failed)
      return Error{fmt::format("{}: cannot be made: {}", (work / folder).string(), failed.message())};
  }
  return io::write_file(work / simulation_record, text, io::Overwrite::replace);
}

/// One flight while it is rendered.
class Recorder {
 public:
  Recorder(const Scene& scene, const Flight& flight, const Trajectory& path, const FlightCamera& camera,
           const SequenceOptions& options, std::vector<CameraStation> stations, fs::path work)
      : scene_(scene),
        flight_(flight),
        path_(path),
        camera_(camera),
        options_(options),
        stations_(std::move(stations)),
        work_(std::move(work)),
        maker_(scene, camera.camera,
               {camera.image, options.render, flight.exposure_time, flight.blur_samples, options.seed,
                options.threads}) {}

  Status record(const FrameProgress& progress) const;

 private:
  [[nodiscard]] Status frame(std::size_t index) const;
  [[nodiscard]] Status flow(std::size_t index, const cv::Mat& depth) const;
  [[nodiscard]] Rendering exposed(std::size_t index) const;

  const Scene& scene_;
  const Flight& flight_;
  const Trajectory& path_;
  const FlightCamera& camera_;
  const SequenceOptions& options_;
  std::vector<CameraStation> stations_;
  fs::path work_;
  FrameMaker maker_;
};

Status Recorder::record(const FrameProgress& progress) const {
  const int total = static_cast<int>(stations_.size());
  for (int i = 0; i < total; ++i) {
    if (io::interrupted()) return io::interrupted_and_kept_error();
    // The image is written last: where it is, the frame is finished.
    const std::string name = image_name(stations_[static_cast<std::size_t>(i)].time);
    if (!io::path_exists(work_ / "rgb" / name)) {
      if (const Status status = frame(static_cast<std::size_t>(i)); !status) return status;
    }
    if (progress) progress(i + 1, total);
  }
  return {};
}

Rendering Recorder::exposed(std::size_t index) const {
  const CameraStation& station = stations_[index];
  return maker_.expose(station.T_world_camera, [&](double offset) {
    return camera_pose_at(path_, station.time.seconds() + offset, camera_.T_body_camera);
  });
}

Status Recorder::frame(std::size_t index) const {
  const CameraStation& station = stations_[index];
  const std::string name = image_name(station.time);
  const Rendering rendering = exposed(index);
  const auto write_depth = [&] { return write_png(work_ / "depth" / name, depth_counts(rendering.depth)); };
  std::future<Status> depth_written =
      std::async(options_.threads > 1 ? std::launch::async : std::launch::deferred, write_depth);
  if (options_.save_flow) {
    if (const Status s = flow(index, rendering.depth); !s) return s;
  }
  const cv::Mat image = maker_.picture(rendering, station.time);
  const Result<std::string> encoded = png_bytes(work_ / "rgb" / name, image);
  if (const Status s = depth_written.get(); !s) return s;
  if (!encoded) return encoded.error();
  return io::write_file(work_ / "rgb" / name, *encoded, io::Overwrite::replace);
}

Status Recorder::flow(std::size_t index, const cv::Mat& depth) const {
  const auto toward = [&](std::size_t other, const std::string& which) -> Status {
    const ExactFlow exact = exact_flow(scene_, maker_.grid(), depth, stations_[index].T_world_camera,
                                       stations_[other].T_world_camera, options_.threads);
    const std::string name = to_string(stations_[index].time);
    if (const Status s = io::write_flow(work_ / fmt::format("flow_{}/{}.flo", which, name), exact.flow); !s)
      return s;
    return write_png(work_ / fmt::format("visible_{}/{}.png", which, name), exact.visible);
  };
  if (index + 1 < stations_.size()) {
    if (const Status s = toward(index + 1, "next"); !s) return s;
  }
  return index > 0 ? toward(index - 1, "previous") : Status();
}

Status check_free(const Scene& scene, const std::vector<CameraStation>& stations) {
  for (std::size_t i = 0; i < stations.size(); ++i) {
    const Eigen::Vector3d& p = stations[i].T_world_camera.translation;
    if (!(p.norm() <= farthest_place)) {
      return Error{
          fmt::format("frame {} at {} s: found the camera {:.0f} m from the origin of the world, expected at "
                      "most {:.0f} m, "
                      "since rays are of single precision: move world and flight to their origin",
                      i + 1, to_string(stations[i].time), p.norm(), farthest_place)};
    }
    if (const auto solid = scene.inside_of(p)) {
      return Error{fmt::format(
          "frame {} at {} s: found the camera at ({:.2f}, {:.2f}, {:.2f}) inside '{}', expected free space",
          i + 1, to_string(stations[i].time), p.x(), p.y(), p.z(), *solid)};
    }
  }
  return {};
}

Status check_target(const fs::path& out, io::Overwrite overwrite) {
  std::error_code failed;
  if (!io::path_exists(out)) {
    if (!out.parent_path().empty()) fs::create_directories(out.parent_path(), failed);
    if (failed)
      return Error{fmt::format("{}: cannot be made: {}", out.parent_path().string(), failed.message())};
    return {};
  }
  if (overwrite == io::Overwrite::refuse) {
    return Error{fmt::format("{}: exists already, expected a new folder (or --force)", out.string())};
  }
  const bool ours = fs::is_directory(out, failed) &&
                    (fs::is_empty(out, failed) || io::path_exists(out / simulation_record));
  if (!ours) return Error{fmt::format("{}: is no simulated sequence and is not replaced", out.string())};
  return {};
}

/// The fields that a flight states, with those of the world's camera for the rest: what is left out of the
/// projection has the world's field of view, about the same middle.
Camera completed(const Camera& own, const StatedCamera& stated, const Camera& of_world) {
  Camera out = own;
  if (!stated.width) out.width = of_world.width;
  if (!stated.height) out.height = of_world.height;
  const double scale = static_cast<double>(out.width) / of_world.width;
  const auto centre = [scale](double pixel, int before, int now) {
    return 0.5 * (now - 1) + scale * (pixel - 0.5 * (before - 1));
  };
  if (!stated.fx) out.fx = scale * of_world.fx;
  if (!stated.fy) out.fy = stated.fx ? own.fx : scale * of_world.fy;
  if (!stated.cx) out.cx = centre(of_world.cx, of_world.width, out.width);
  if (!stated.cy) out.cy = centre(of_world.cy, of_world.height, out.height);
  if (!stated.lens) {
    out.distortion = of_world.distortion;
    out.coefficients = of_world.coefficients;
  }
  return out;
}

}  // namespace

FlightCamera flight_camera(const Flight& flight, const World& world) {
  FlightCamera out;
  out.T_body_camera.rotation = Eigen::Quaterniond(forward_camera_rotation());
  out.camera.width = 640;
  out.camera.height = 480;
  out.camera.fx = out.camera.fy = 554.26;
  out.camera.cx = 319.5;
  out.camera.cy = 239.5;
  if (!world.cameras.empty()) {
    out.camera = world.cameras.front().camera;
    out.T_body_camera = world.cameras.front().T_body_camera;
  }
  out.image = flight.image;
  if (!world.cameras.empty()) {
    const CameraSensor& sensor = world.cameras.front();
    if (!flight.states_colour) out.image.colour = sensor.colour.value_or(out.image.colour);
    if (!flight.states_read_noise)
      out.image.read_noise = sensor.noise_deviation.value_or(out.image.read_noise);
  }
  if (flight.camera)
    out.camera =
        world.cameras.empty() ? *flight.camera : completed(*flight.camera, flight.stated_camera, out.camera);
  if (flight.T_body_camera) out.T_body_camera = *flight.T_body_camera;
  if (flight.pitch_down) {
    // Nose down is a positive rotation about body y (left).
    const Pose turn{rotation_exp({0, *flight.pitch_down, 0}), Eigen::Vector3d::Zero()};
    out.T_body_camera.rotation = (turn * out.T_body_camera).rotation;
  }
  return out;
}

std::optional<std::string> precision_warning(const Flight& flight) {
  for (std::size_t i = 0; i < flight.waypoints.size(); ++i) {
    const double distance = flight.waypoints[i].position.norm();
    if (!(distance > farthest_exact_place)) continue;
    return fmt::format(
        "flight '{}': waypoint {}: found {:.0f} m from the origin of the world, where single precision makes "
        "depth inexact (beyond {:.0f} m): move world and flight to their origin",
        flight.name, i + 1, distance, farthest_exact_place);
  }
  return std::nullopt;
}

Status write_sequence(const Scene& scene, const Flight& flight, const fs::path& target,
                      const SequenceOptions& options, const FrameProgress& progress) {
  std::error_code failed;
  // "." and "folder/" have a name and a parent only where they truly lie.
  fs::path out = fs::weakly_canonical(fs::absolute(target, failed), failed);
  if (!out.has_filename()) out = out.parent_path();
  if (failed || !out.has_filename())
    return Error{fmt::format("{}: found no name for the new folder", target.string())};
  const auto path = Trajectory::through(flight.waypoints, flight.trajectory);
  if (!path) return Error{fmt::format("flight '{}': {}", flight.name, path.error().message)};
  const FlightCamera camera = flight_camera(flight, scene.world());
  auto stations = camera_stations(flight, *path, camera.T_body_camera);
  if (!stations) return stations.error();
  if (const Status s = check_free(scene, *stations); !s) return s;
  std::vector<CameraStation> chosen;
  for (std::size_t i = 0; i < stations->size(); i += static_cast<std::size_t>(std::max(options.every, 1)))
    chosen.push_back((*stations)[i]);

  const std::string made_of = record(scene, flight, camera, options);
  if (options.keep_finished) {
    const auto found = io::read_file(out / simulation_record);
    if (found && *found == made_of) return {};
    if (found && options.overwrite == io::Overwrite::refuse) {
      return Error{fmt::format(
          "{}: found a sequence of another world, flight, option or version of the program, expected the one "
          "of this command or none (pade simulate --force replaces it)",
          out.string())};
    }
  }
  if (const Status s = check_target(out, options.overwrite); !s) return s;
  const fs::path work = partial_folder(out);
  if (const Status s = prepare(work, made_of, options); !s) return s;
  const auto write = [&](const char* name, const std::string& text) {
    return io::write_file(work / name, text, io::Overwrite::replace);
  };
  if (const Status s = write("camera.yaml", camera_yaml(camera)); !s) return s;
  if (const Status s = write("groundtruth.txt", ground_truth(chosen)); !s) return s;
  if (flight.sensors.enabled) {
    for (const auto& [name, text] : sensor_files(*path, flight.sensors, options.seed)) {
      if (const Status s = write(name.c_str(), text); !s) return s;
    }
  }
  const Recorder recorder(scene, flight, *path, camera, options, std::move(chosen), work);
  if (const Status s = recorder.record(progress); !s) return s;
  return io::put_in_place(work, out, options.overwrite);
}

}  // namespace pade::simulation

#include "pade/io/sequence/dialects/calibration_dialects.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include <fmt/format.h>

namespace pade::io::dialect {
namespace {

constexpr std::string_view kIntrinsics =
    "four numbers: focal lengths fx > 0, fy > 0 and principal point cx, cy, in pixels";
constexpr std::string_view kMatrix =
    "a 3x3 camera matrix fx 0 cx, 0 fy cy, 0 0 1 with positive focal lengths";
constexpr std::string_view kCoefficients = "a list of finite distortion coefficients";

using Fields = CalibrationFields;

bool has(const Yaml& root, std::initializer_list<std::string_view> keys) {
  return std::any_of(keys.begin(), keys.end(),
                     [&](std::string_view key) { return root.find(key) != nullptr; });
}

/// fx fy cx cy as one list (Kalibr, EuRoC).
void read_intrinsics(Fields& fields, Camera& camera) {
  fields.require({"intrinsics"}, kIntrinsics);
  const auto values = fields.numbers({"intrinsics"}, kIntrinsics);
  if (!values) return;
  if (values->size() != 4 || !((*values)[0] > 0) || !((*values)[1] > 0)) {
    return fields.wrong(*fields.find({"intrinsics"}), "intrinsics", kIntrinsics);
  }
  camera.fx = (*values)[0];
  camera.fy = (*values)[1];
  camera.cx = (*values)[2];
  camera.cy = (*values)[3];
}

/// [width, height] as one list (Kalibr, EuRoC).
void read_resolution(Fields& fields, Camera& camera) {
  constexpr std::string_view kExpected = "image width and height, two whole numbers of pixels";
  fields.require({"resolution"}, kExpected);
  const auto values = fields.numbers({"resolution"}, kExpected);
  if (!values) return;
  const auto pixels = [](double v) { return v >= 1 && v <= 65536 && std::floor(v) == v; };
  if (values->size() != 2 || !pixels((*values)[0]) || !pixels((*values)[1])) {
    return fields.wrong(*fields.find({"resolution"}), "resolution", kExpected);
  }
  camera.width = static_cast<int>((*values)[0]);
  camera.height = static_cast<int>((*values)[1]);
}

/// Kalibr and EuRoC know other projections than the pinhole.
void require_pinhole(Fields& fields) {
  constexpr std::string_view kPinhole =
      "pinhole: calibrate with it (and equidistant distortion where the lens is wide)";
  fields.require({"camera_model"}, kPinhole);
  const auto model = fields.text("camera_model", kPinhole);
  if (model && *model != "pinhole") fields.wrong(*fields.find({"camera_model"}), "camera_model", kPinhole);
}

std::string camera_key(int camera) { return fmt::format("cam{}", camera); }

/// T_camera_imu of camera `index`; empty where the chain does not reach the IMU.
std::optional<Pose> camera_from_imu(const Yaml& root, const std::string& file, int index,
                                    std::optional<Error>& error) {
  Pose T_camera_last;  // from the camera that is looked at now to the one asked for
  for (int i = index; i >= 0; --i) {
    const Yaml* node = root.find(camera_key(i));
    if (node == nullptr) return std::nullopt;
    Fields fields(*node, fmt::format("{}: {}", file, camera_key(i)));
    std::optional<Pose> T_camera_imu = fields.transform("T_cam_imu");
    if (const auto T_imu_camera = fields.transform("T_imu_cam")) T_camera_imu = T_imu_camera->inverse();
    const std::optional<Pose> T_this_before = fields.transform("T_cn_cnm1");
    if (fields.error()) {
      error = fields.error();
      return std::nullopt;
    }
    if (T_camera_imu) return T_camera_last * *T_camera_imu;
    if (!T_this_before) return std::nullopt;
    T_camera_last = T_camera_last * *T_this_before;
  }
  return std::nullopt;
}

std::string cameras_of(const Yaml& root) {
  std::vector<std::string> names;
  for (const auto& [name, value] : root.map) {
    if (name.starts_with("cam") && value.kind == Yaml::Kind::map) names.push_back(name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

/// OpenCV states no model: it follows from the number of coefficients, or from a mark that its calibration
/// programs write for fisheye lenses.
std::string opencv_model(Fields& fields, std::vector<double>& coefficients) {
  const auto fisheye = fields.number("fisheye_model");
  if (fisheye.value_or(0) != 0) return "equidistant";
  // Thin prism and tilt (12 and 14 coefficients) have no meaning here unless they are all zero.
  while (coefficients.size() > 8 && coefficients.back() == 0) coefficients.pop_back();
  if (coefficients.size() > 5 && coefficients.size() <= 8) {
    coefficients.resize(8);
    return "rational_polynomial";
  }
  return coefficients.empty() ? "none" : "plumb_bob";
}

/// A camera_info that was binned or cut describes another image than the one at hand.
void refuse_part_of_image(Fields& fields, const Yaml& root) {
  for (const std::string_view name : {"binning_x", "binning_y"}) {
    if (const auto binning = fields.number(name); binning && *binning > 1) {
      fields.wrong(*fields.find({name}), name, "0 or 1: calibrate the images as they are");
    }
  }
  const Yaml* roi = root.find("roi");
  if (roi == nullptr) return;
  for (const std::string_view name : {"x_offset", "y_offset", "width", "height"}) {
    const Yaml* value = roi->find(name);
    if (value == nullptr || value->scalar == "0") continue;
    if (name == "width" || name == "height") continue;  // some drivers write the whole image
    fields.wrong(*value, "roi", "no offset: calibrate the images as they are");
  }
}

}  // namespace

void read_distortion(Fields& fields, Camera& camera, const std::string& model, const std::string& name) {
  const auto coefficients = fields.numbers({name}, kCoefficients);
  if (fields.error()) return;
  if (const auto problem = set_distortion(camera, model, coefficients.value_or(std::vector<double>{}))) {
    fields.fail(*problem);
  }
}

void read_matrix(Fields& fields, Camera& camera, const std::string& name) {
  fields.require({name}, kMatrix);
  const auto k = fields.numbers({name}, kMatrix);
  if (!k) return;
  const auto& m = *k;
  // Calibration programs leave rounding errors where zeros belong.
  constexpr double kRounding = 1e-6;
  const auto zero = [&](double value) { return std::abs(value) <= kRounding * std::abs(m[0]); };
  const bool good = m.size() == 9 && m[0] > 0 && m[4] > 0 && zero(m[3]) && zero(m[6]) && zero(m[7]) &&
                    std::abs(m[8] - 1) <= kRounding;
  const bool empty = m.size() == 9 && std::all_of(m.begin(), m.end(), [](double v) { return v == 0; });
  if (empty) {
    return fields.fail(
        fmt::format("line {}: field {}: found nothing but zeros, which says that the camera was never "
                    "calibrated; expected {}",
                    fields.find({name})->line, name, kMatrix));
  }
  if (!good) return fields.wrong(*fields.find({name}), name, kMatrix);
  if (!zero(m[1])) {
    return fields.fail(fmt::format("line {}: field {}: found a skew of {:g}, expected {}",
                                   fields.find({name})->line, name, m[1], kMatrix));
  }
  camera.fx = m[0];
  camera.fy = m[4];
  camera.cx = m[2];
  camera.cy = m[5];
}

std::optional<double> read_time_offset(Fields& fields, std::string_view name) {
  constexpr double kLargest = 86400;
  const auto offset = fields.number(name);
  if (offset && !(std::abs(*offset) <= kLargest)) {
    fields.wrong(*fields.find({name}), name, "an offset between clocks of at most a day, in seconds");
  }
  return offset;
}

Result<Calibration> finish(Fields& fields, Calibration&& calibration) {
  fields.refuse_lens_like();
  if (fields.error()) return *fields.error();
  calibration.unknown_fields = fields.unused();
  return std::move(calibration);
}

Error one_camera_only(const std::string& file, int camera) {
  return Error{fmt::format("{}: found no camera number {} (--camera, from 0), expected one that it holds",
                           file, camera)};
}

bool is_kalibr(const Yaml& root) {
  return std::any_of(root.map.begin(), root.map.end(), [](const Yaml::Entry& entry) {
    const std::string& key = entry.key;
    const bool numbered =
        key.size() > 3 && key.starts_with("cam") &&
        std::all_of(key.begin() + 3, key.end(), [](char c) { return c >= '0' && c <= '9'; });
    return numbered && entry.value.kind == Yaml::Kind::map;
  });
}

Result<Calibration> read_kalibr(const Yaml& root, const std::string& file, int index) {
  const Yaml* node = root.find(camera_key(index));
  if (node == nullptr || node->kind != Yaml::Kind::map) {
    return Error{fmt::format("{}: found {}, expected {}: choose one with --camera", file, cameras_of(root),
                             camera_key(index))};
  }
  Fields fields(*node, file);
  Calibration out;
  out.format = "Kalibr";
  Camera camera;
  require_pinhole(fields);
  read_intrinsics(fields, camera);
  read_resolution(fields, camera);
  fields.require({"distortion_model"}, "none, radtan or equidistant");
  read_distortion(fields, camera, fields.text("distortion_model", kModel).value_or(""), "distortion_coeffs");
  out.time_offset_s = read_time_offset(fields, "timeshift_cam_imu");  // t_imu = t_cam + shift
  fields.ignore({"cam_overlaps", "rostopic", "T_cn_cnm1", "T_cam_imu", "T_imu_cam", "label", "id",
                 "distortion_coeffs"});
  out.camera = camera;
  std::optional<Error> error;
  if (const auto T_camera_imu = camera_from_imu(root, file, index, error)) {
    out.T_body_camera = T_camera_imu->inverse();
  }
  if (error) return *error;
  return finish(fields, std::move(out));
}

bool is_euroc(const Yaml& root) {
  return has(root, {"intrinsics"}) && has(root, {"distortion_coefficients", "camera_model", "T_BS"});
}

Result<Calibration> read_euroc(const Yaml& root, const std::string& file) {
  Fields fields(root, file);
  Calibration out;
  out.format = "EuRoC";
  Camera camera;
  require_pinhole(fields);
  read_intrinsics(fields, camera);
  read_resolution(fields, camera);
  fields.require({"distortion_model"}, "radial-tangential or equidistant");
  read_distortion(fields, camera, fields.text("distortion_model", kModel).value_or(""),
                  "distortion_coefficients");
  out.T_body_camera = fields.transform("T_BS");
  fields.ignore({"sensor_type", "comment", "rate_hz", "camera_id", "distortion_coefficients"});
  out.camera = camera;
  return finish(fields, std::move(out));
}

bool is_camera_info(const Yaml& root) {
  return has(root, {"distortion_model"}) && has(root, {"camera_matrix", "K", "k"});
}

Result<Calibration> read_camera_info(const Yaml& root, const std::string& file) {
  Fields fields(root, file);
  Calibration out;
  out.format = "ROS camera_info";
  Camera camera;
  fields.require({"image_width", "width"}, kSize);
  fields.require({"image_height", "height"}, kSize);
  camera.width = fields.pixels({"image_width", "width"}, kSize).value_or(0);
  camera.height = fields.pixels({"image_height", "height"}, kSize).value_or(0);
  read_matrix(fields, camera, fields.spelled({"camera_matrix", "k"}));
  const std::string name = fields.spelled({"distortion_coefficients", "d"});
  std::string model = fields.text("distortion_model", kModel).value_or("");
  // A driver without calibration writes an empty list, and often an empty model.
  const auto coefficients = fields.numbers({name}, kCoefficients);
  if (coefficients && coefficients->empty()) model = "none";
  read_distortion(fields, camera, model, name);
  refuse_part_of_image(fields, root);
  out.T_body_camera = fields.transform("local_transform", true);  // RTAB-Map: base to camera
  fields.ignore({"camera_name", "rectification_matrix", "projection_matrix", "R", "P", "r", "p", "header",
                 "binning_x", "binning_y", "roi", "height", "width"});
  out.camera = camera;
  return finish(fields, std::move(out));
}

bool is_opencv(const Yaml& root) {
  const Fields fields(root, "");
  return root.find(fields.spelled({"camera_matrix", "k", "mtx", "intrinsic_matrix", "M1", "K1"})) != nullptr;
}

Result<Calibration> read_opencv(const Yaml& root, const std::string& file, int index) {
  Fields fields(root, file);
  Calibration out;
  out.format = "OpenCV";
  Camera camera;
  const std::string matrix_of_pair = fmt::format("M{}", index + 1);
  const std::string other_of_pair = fmt::format("K{}", index + 1);
  const std::string coefficients_of_pair = fmt::format("D{}", index + 1);
  camera.width = fields.pixels({fields.spelled({"image_width", "width"})}, kSize).value_or(0);
  camera.height = fields.pixels({fields.spelled({"image_height", "height"})}, kSize).value_or(0);
  const bool pair = has(root, {matrix_of_pair, other_of_pair});
  if (!pair && index > 0) return one_camera_only(file, index);
  read_matrix(fields, camera,
              pair ? fields.spelled({matrix_of_pair, other_of_pair})
                   : fields.spelled({"camera_matrix", "k", "mtx", "intrinsic_matrix"}));
  const std::string name =
      pair ? coefficients_of_pair
           : fields.spelled({"distortion_coefficients", "dist_coeffs", "dist_coeff", "dist_coefs",
                             "dist_coef", "distortion_coeffs", "distortion_coeff", "distortion_coefficient",
                             "distortion", "dist", "d"});
  auto coefficients = fields.numbers({name}, kCoefficients).value_or(std::vector<double>{});
  const std::string model = opencv_model(fields, coefficients);
  if (const auto problem = set_distortion(camera, model, coefficients)) fields.fail(*problem);
  fields.ignore({"calibration_time", "nframes", "nr_of_frames", "board_width", "board_height", "square_size",
                 "aspectRatio", "fix_aspect_ratio", "flags", "avg_reprojection_error",
                 "per_view_reprojection_errors", "extrinsic_parameters", "Extrinsic_Parameters",
                 "image_points", "grid_points", "per_view_errors", "camera_name"});
  if (pair) fields.ignore({"M1", "M2", "K1", "K2", "D1", "D2"});
  out.camera = camera;
  return finish(fields, std::move(out));
}

}  // namespace pade::io::dialect

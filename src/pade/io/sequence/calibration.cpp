#include "pade/io/sequence/calibration.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "pade/io/sequence/calibration_fields.hpp"
#include "pade/io/text.hpp"
#include "pade/io/yaml.hpp"

namespace pade::io {
namespace {

constexpr std::string_view kFocal = "a positive focal length in pixels";
constexpr std::string_view kIntrinsics =
    "four numbers: focal lengths fx > 0, fy > 0 and principal point cx, cy, in pixels";
constexpr std::string_view kMatrix =
    "a 3x3 camera matrix fx 0 cx, 0 fy cy, 0 0 1 with positive focal lengths";
constexpr std::string_view kModel = "none, plumb_bob, rational_polynomial or equidistant";
constexpr std::string_view kCoefficients = "a list of finite distortion coefficients";

using Fields = CalibrationFields;

void read_distortion(Fields& fields, Camera& camera, const std::string& model,
                     std::initializer_list<std::string_view> names) {
  const auto coefficients = fields.numbers(names, kCoefficients);
  if (fields.error()) return;
  const auto problem = set_distortion(camera, model, coefficients.value_or(std::vector<double>{}));
  if (problem) fields.fail(*problem);
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

/// A 3x3 camera matrix (ROS, OpenCV).
void read_matrix(Fields& fields, Camera& camera, std::initializer_list<std::string_view> names) {
  fields.require(names, kMatrix);
  const auto k = fields.numbers(names, kMatrix);
  if (!k) return;
  const auto& m = *k;
  const bool good =
      m.size() == 9 && m[0] > 0 && m[4] > 0 && m[1] == 0 && m[3] == 0 && m[6] == 0 && m[7] == 0 && m[8] == 1;
  if (!good) return fields.wrong(*fields.find(names), *names.begin(), kMatrix);
  camera.fx = m[0];
  camera.fy = m[4];
  camera.cx = m[2];
  camera.cy = m[5];
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
  fields.require({"camera_model"}, "pinhole");
  const auto model = fields.text("camera_model", "pinhole");
  if (model && *model != "pinhole") fields.wrong(*fields.find({"camera_model"}), "camera_model", "pinhole");
}

Result<Calibration> finish(Fields& fields, Calibration&& calibration) {
  if (fields.error()) return *fields.error();
  calibration.unknown_fields = fields.unused();
  return std::move(calibration);
}

std::optional<Camera> read_camera_yaml_lens(Fields& fields) {
  constexpr std::string_view kLens[] = {"width", "height",           "fx",        "fy", "cx",
                                        "cy",    "distortion_model", "distortion"};
  const bool any = std::any_of(std::begin(kLens), std::end(kLens),
                               [&](std::string_view name) { return fields.has(name); });
  if (!any) return std::nullopt;
  Camera camera;
  constexpr std::string_view kWidth = "the image width, a whole number of pixels";
  constexpr std::string_view kHeight = "the image height, a whole number of pixels";
  constexpr std::string_view kCentre = "the principal point in pixels";
  fields.require({"width"}, kWidth);
  fields.require({"height"}, kHeight);
  for (const std::string_view name : {"fx", "fy"}) fields.require({name}, kFocal);
  for (const std::string_view name : {"cx", "cy"}) fields.require({name}, kCentre);
  fields.require({"distortion_model"}, kModel);
  camera.width = fields.pixels({"width"}, kWidth).value_or(0);
  camera.height = fields.pixels({"height"}, kHeight).value_or(0);
  camera.fx = fields.positive("fx", kFocal).value_or(0);
  camera.fy = fields.positive("fy", kFocal).value_or(0);
  camera.cx = fields.number("cx").value_or(0);
  camera.cy = fields.number("cy").value_or(0);
  read_distortion(fields, camera, fields.text("distortion_model", kModel).value_or(""), {"distortion"});
  return camera;
}

std::optional<Eigen::Vector3d> read_world_up(Fields& fields) {
  constexpr std::string_view kExpected =
      "an axis such as \"+z\" or \"-y\", or three numbers that are not all zero";
  const Yaml* node = fields.find({"world_up"});
  if (node == nullptr) return std::nullopt;
  if (node->kind == Yaml::Kind::scalar) {
    auto axis = parse_direction(node->scalar);
    if (!axis) fields.wrong(*node, "world_up", kExpected);
    return axis;
  }
  const auto values = fields.numbers({"world_up"}, kExpected);
  if (!values) return std::nullopt;
  if (values->size() == 3) {
    const Eigen::Vector3d up((*values)[0], (*values)[1], (*values)[2]);
    if (up.stableNorm() > 1e-9 && std::isfinite(up.stableNorm())) return up.stableNormalized();
  }
  fields.wrong(*node, "world_up", kExpected);
  return std::nullopt;
}

std::optional<PoseConvention> read_pose_convention(Fields& fields) {
  constexpr std::string_view kExpected = "camera_to_world_optical or body_to_world";
  const auto text = fields.text("pose_convention", kExpected);
  if (!text) return std::nullopt;
  const auto convention = from_name<PoseConvention>(*text);
  if (!convention) fields.wrong(*fields.find({"pose_convention"}), "pose_convention", kExpected);
  return convention;
}

std::optional<double> read_time_offset(Fields& fields, std::string_view name) {
  constexpr double kLargest = 86400;
  const auto offset = fields.number(name);
  if (offset && !(std::abs(*offset) <= kLargest)) {
    fields.wrong(*fields.find({name}), name, "an offset between clocks of at most a day, in seconds");
  }
  return offset;
}

/// A list of exactly N numbers.
template <std::size_t N>
std::optional<std::array<double, N>> read_list(Fields& fields, std::string_view name,
                                               std::string_view expected) {
  const auto values = fields.numbers({name}, expected);
  if (!values) return std::nullopt;
  if (values->size() != N) {
    fields.wrong(*fields.find({name}), name, expected);
    return std::nullopt;
  }
  std::array<double, N> out{};
  std::copy(values->begin(), values->end(), out.begin());
  return out;
}

Result<Calibration> read_camera_yaml(const Yaml& root, const std::string& file) {
  Fields fields(root, file);
  Calibration out;
  out.format = "camera.yaml";
  out.camera = read_camera_yaml_lens(fields);
  out.T_body_camera = fields.transform("T_body_camera");
  out.time_offset_s = read_time_offset(fields, "time_offset_s");
  out.pose_convention = read_pose_convention(fields);
  out.depth_scale = fields.positive("depth_scale", "a positive number of counts per metre");
  out.world_up = read_world_up(fields);
  constexpr std::string_view kRange = "two rising numbers: the raw values of black and white";
  out.intensity = read_list<2>(fields, "intensity_range", kRange);
  if (out.intensity && !((*out.intensity)[0] < (*out.intensity)[1])) {
    fields.wrong(*fields.find({"intensity_range"}), "intensity_range", kRange);
  }
  if (const auto arm = read_list<3>(fields, "gnss_lever_arm", "three numbers in metres, in the body frame")) {
    out.gnss_lever_arm = Eigen::Vector3d((*arm)[0], (*arm)[1], (*arm)[2]);
  }
  constexpr std::string_view kOrigin = "latitude and longitude in degrees and height in metres";
  if (const auto origin = read_list<3>(fields, "geographic_origin", kOrigin)) {
    out.origin = GeographicOrigin{(*origin)[0], (*origin)[1], (*origin)[2]};
    if (std::abs((*origin)[0]) > 90 || std::abs((*origin)[1]) > 360) {
      fields.wrong(*fields.find({"geographic_origin"}), "geographic_origin", kOrigin);
    }
  }
  fields.ignore({"stereo_baseline_m"});
  return finish(fields, std::move(out));
}

Result<Calibration> read_kalibr(const Yaml& camera_node, const std::string& file) {
  Fields fields(camera_node, file);
  Calibration out;
  out.format = "Kalibr";
  Camera camera;
  require_pinhole(fields);
  read_intrinsics(fields, camera);
  read_resolution(fields, camera);
  fields.require({"distortion_model"}, "none, radtan or equidistant");
  read_distortion(fields, camera, fields.text("distortion_model", kModel).value_or(""),
                  {"distortion_coeffs"});
  if (const auto T_camera_imu = fields.transform("T_cam_imu")) out.T_body_camera = T_camera_imu->inverse();
  out.time_offset_s = read_time_offset(fields, "timeshift_cam_imu");  // t_imu = t_cam + shift
  fields.ignore({"cam_overlaps", "rostopic", "T_cn_cnm1", "label", "id"});
  out.camera = camera;
  return finish(fields, std::move(out));
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
                  {"distortion_coefficients"});
  out.T_body_camera = fields.transform("T_BS");
  fields.ignore({"sensor_type", "comment", "rate_hz"});
  out.camera = camera;
  return finish(fields, std::move(out));
}

Result<Calibration> read_ros(const Yaml& root, const std::string& file) {
  Fields fields(root, file);
  Calibration out;
  out.format = "ROS camera_info";
  Camera camera;
  constexpr std::string_view kSize = "a whole number of pixels";
  fields.require({"image_width"}, kSize);
  fields.require({"image_height"}, kSize);
  camera.width = fields.pixels({"image_width"}, kSize).value_or(0);
  camera.height = fields.pixels({"image_height"}, kSize).value_or(0);
  read_matrix(fields, camera, {"camera_matrix", "K"});
  read_distortion(fields, camera, fields.text("distortion_model", kModel).value_or(""),
                  {"distortion_coefficients", "D"});
  fields.ignore({"camera_name", "rectification_matrix", "projection_matrix", "R", "P", "header", "binning_x",
                 "binning_y", "roi", "height", "width"});
  out.camera = camera;
  return finish(fields, std::move(out));
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

Result<Calibration> read_opencv(const Yaml& root, const std::string& file) {
  Fields fields(root, file);
  Calibration out;
  out.format = "OpenCV";
  Camera camera;
  constexpr std::string_view kSize = "a whole number of pixels";
  camera.width = fields.pixels({"image_width", "image_Width"}, kSize).value_or(0);
  camera.height = fields.pixels({"image_height", "image_Height"}, kSize).value_or(0);
  read_matrix(fields, camera, {"camera_matrix", "Camera_Matrix", "cameraMatrix", "K"});
  auto coefficients =
      fields
          .numbers({"distortion_coefficients", "Distortion_Coefficients", "dist_coeffs", "distCoeffs", "D"},
                   kCoefficients)
          .value_or(std::vector<double>{});
  const std::string model = opencv_model(fields, coefficients);
  if (const auto problem = set_distortion(camera, model, coefficients)) fields.fail(*problem);
  fields.ignore({"calibration_time", "nframes", "nr_of_frames", "board_width", "board_height", "square_size",
                 "aspectRatio", "fix_aspect_ratio", "flags", "avg_reprojection_error",
                 "per_view_reprojection_errors", "extrinsic_parameters", "image_points", "grid_points",
                 "per_view_errors"});
  out.camera = camera;
  return finish(fields, std::move(out));
}

/// OpenCV writes "%YAML:1.0", which is no YAML directive; make it a comment, so that line numbers stay.
std::string without_opencv_directive(std::string_view text) {
  std::string out(text);
  out.front() = '#';
  return out;
}

}  // namespace

Result<Calibration> parse_calibration(std::string_view text, const std::string& file) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const bool opencv_header = text.starts_with("%YAML:");
  const auto root = parse_yaml(opencv_header ? without_opencv_directive(text) : std::string(text), file);
  if (!root) return root.error();
  if (root->kind != Yaml::Kind::map) {
    return Error{
        fmt::format("{}: found {}, expected the fields of a camera calibration", file, described(*root))};
  }
  if (const Yaml* camera = root->find("cam0"); camera != nullptr && camera->kind == Yaml::Kind::map) {
    return read_kalibr(*camera, file);
  }
  if (!opencv_header && root->find("intrinsics") != nullptr) return read_euroc(*root, file);
  if (!opencv_header && root->find("distortion_model") != nullptr &&
      (root->find("camera_matrix") != nullptr || root->find("K") != nullptr)) {
    return read_ros(*root, file);
  }
  const bool matrix = root->find("camera_matrix") != nullptr || root->find("Camera_Matrix") != nullptr ||
                      root->find("cameraMatrix") != nullptr || root->find("K") != nullptr;
  if (opencv_header || matrix) return read_opencv(*root, file);
  return read_camera_yaml(*root, file);
}

Result<Calibration> read_calibration(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return text.error();
  return parse_calibration(*text, file.string());
}

}  // namespace pade::io

// The settings files of SLAM programs that many cameras are described in.
#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "pade/io/sequence/dialects/calibration_dialects.hpp"

namespace pade::io::dialect {
namespace {

using Fields = CalibrationFields;

constexpr std::string_view kCentre = "the principal point in pixels";

/// The numbers of fields `prefix` + k1, k2 ... in this order; those that are missing at the end are left out.
std::vector<double> numbers_named(Fields& fields, std::string_view prefix,
                                  std::initializer_list<std::string_view> names) {
  std::vector<double> values;
  std::vector<double> pending;
  for (const std::string_view name : names) {
    const auto value = fields.number(fmt::format("{}{}", prefix, name));
    pending.push_back(value.value_or(0));
    if (!value) continue;
    values.insert(values.end(), pending.begin(), pending.end());
    pending.clear();
  }
  return values;
}

void read_pinhole(Fields& fields, Camera& camera, std::string_view prefix,
                  const std::array<std::string_view, 4>& names) {
  const auto key = [&](std::size_t i) { return fmt::format("{}{}", prefix, names[i]); };
  for (std::size_t i = 0; i < names.size(); ++i) fields.require({key(i)}, i < 2 ? kFocal : kCentre);
  camera.fx = fields.positive(key(0), kFocal).value_or(0);
  camera.fy = fields.positive(key(1), kFocal).value_or(0);
  camera.cx = fields.number(key(2)).value_or(0);
  camera.cy = fields.number(key(3)).value_or(0);
}

void set_lens(Fields& fields, Camera& camera, const std::string& model,
              const std::vector<double>& coefficients) {
  if (const auto problem = set_distortion(camera, model, coefficients)) fields.fail(*problem);
}

/// Everything that begins so is the program's own and means no lens.
void ignore_starting_with(Fields& fields, const Yaml& root,
                          std::initializer_list<std::string_view> beginnings) {
  for (const auto& [name, value] : root.map) {
    for (const std::string_view beginning : beginnings) {
      if (name.starts_with(beginning)) fields.ignore({name});
    }
  }
}

/// ORB-SLAM's Camera.type: PinHole (default), KannalaBrandt8, Rectified.
void read_orb_lens(Fields& fields, Camera& camera, const std::string& prefix) {
  const std::string type =
      fields.text("Camera.type", "PinHole, KannalaBrandt8 or Rectified").value_or("PinHole");
  if (type == "KannalaBrandt8") {
    set_lens(fields, camera, "equidistant", numbers_named(fields, prefix, {"k1", "k2", "k3", "k4"}));
  } else if (type == "PinHole" || type == "Pinhole") {
    auto coefficients = numbers_named(fields, prefix, {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"});
    if (!coefficients.empty())
      coefficients.resize(coefficients.size() > 5 ? 8 : std::max<std::size_t>(coefficients.size(), 4));
    set_lens(fields, camera,
             coefficients.empty()      ? "none"
             : coefficients.size() > 5 ? "rational_polynomial"
                                       : "plumb_bob",
             coefficients);
  } else if (type == "Rectified") {
    set_lens(fields, camera, "none", {});
  } else {
    fields.wrong(*fields.find({"Camera.type"}), "Camera.type", "PinHole, KannalaBrandt8 or Rectified");
  }
}

Result<Calibration> read_camodocal(Fields& fields, const std::string& file, Camera& camera) {
  Calibration out;
  const std::string model = fields.text("model_type", "PINHOLE or KANNALA_BRANDT").value_or("");
  fields.require({"projection_parameters"}, "the focal lengths and the principal point");
  const Yaml* projection = fields.find({"projection_parameters"});
  if (fields.error()) return *fields.error();
  Fields lens(*projection, file);
  if (model == "PINHOLE") {
    read_pinhole(lens, camera, "", {"fx", "fy", "cx", "cy"});
    std::vector<double> coefficients;
    if (const Yaml* distortion = fields.find({"distortion_parameters"})) {
      Fields numbers(*distortion, file);
      coefficients = numbers_named(numbers, "", {"k1", "k2", "p1", "p2"});
      if (!coefficients.empty()) coefficients.resize(4);
      numbers.refuse_lens_like();
      if (numbers.error()) return *numbers.error();
    }
    set_lens(lens, camera, coefficients.empty() ? "none" : "plumb_bob", coefficients);
  } else if (model == "KANNALA_BRANDT") {
    read_pinhole(lens, camera, "", {"mu", "mv", "u0", "v0"});
    auto coefficients = numbers_named(lens, "", {"k2", "k3", "k4", "k5"});
    coefficients.resize(4);
    set_lens(lens, camera, "equidistant", coefficients);
  } else {
    fields.wrong(*fields.find({"model_type"}), "model_type", "PINHOLE or KANNALA_BRANDT");
  }
  lens.refuse_lens_like();
  if (lens.error()) return *lens.error();
  return out;
}

/// Rotation and translation as two matrices (VINS-Mono), or one (VINS-Fusion).
std::optional<Pose> vins_mounting(Fields& fields) {
  if (const auto T = fields.transform("body_T_cam0")) return T;
  constexpr std::string_view kExpected = "a rotation matrix (3x3) and a translation (3 numbers)";
  const auto rotation = fields.numbers({"extrinsicRotation"}, kExpected);
  const auto translation = fields.numbers({"extrinsicTranslation"}, kExpected);
  if (!rotation || !translation || rotation->size() != 9 || translation->size() != 3) return std::nullopt;
  const Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation->data());
  constexpr double kTolerance = 1e-3;
  if (!((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kTolerance) ||
      !(R.determinant() > 0)) {
    fields.wrong(*fields.find({"extrinsicRotation"}), "extrinsicRotation", kExpected);
    return std::nullopt;
  }
  return Pose{Eigen::Quaterniond(R).normalized(), {(*translation)[0], (*translation)[1], (*translation)[2]}};
}

}  // namespace

bool is_orb_slam(const Yaml& root) {
  return root.find("Camera.fx") != nullptr || root.find("Camera1.fx") != nullptr;
}

Result<Calibration> read_orb_slam(const Yaml& root, const std::string& file, int index) {
  Fields fields(root, file);
  Calibration out;
  out.format = "ORB-SLAM";
  Camera camera;
  const bool numbered = root.find("Camera1.fx") != nullptr;
  if (!numbered && index > 0) return one_camera_only(file, index);
  const std::string prefix = numbered ? fmt::format("Camera{}.", index + 1) : "Camera.";
  camera.width = fields.pixels({"Camera.width"}, kSize).value_or(0);
  camera.height = fields.pixels({"Camera.height"}, kSize).value_or(0);
  read_pinhole(fields, camera, prefix, {"fx", "fy", "cx", "cy"});
  read_orb_lens(fields, camera, prefix);
  if (index == 0) {
    out.T_body_camera = fields.transform("Tbc");
    if (const auto T = fields.transform("IMU.T_b_c1")) out.T_body_camera = T;
  }
  constexpr std::string_view kScale = "a positive number of counts per metre";
  out.depth_scale = fields.positive("DepthMapFactor", kScale);
  if (const auto scale = fields.positive("RGBD.DepthMapFactor", kScale)) out.depth_scale = scale;
  ignore_starting_with(
      fields, root,
      {"Camera.", "Camera1.", "Camera2.", "ORBextractor", "Viewer.", "IMU.", "Stereo.", "System.", "File.",
       "RGBD.", "LEFT.", "RIGHT.", "Tbc", "ThDepth", "loopClosing", "Tlr"});
  out.camera = camera;
  return finish(fields, std::move(out));
}

bool is_vins(const Yaml& root) {
  const bool lens = root.find("model_type") != nullptr && root.find("projection_parameters") != nullptr;
  return lens || root.find("cam0_calib") != nullptr;
}

Result<Calibration> read_vins(const Yaml& root, const std::string& file) {
  Fields fields(root, file);
  if (const Yaml* other = root.find("cam0_calib"); other != nullptr && root.find("model_type") == nullptr) {
    return Error{fmt::format("{}: line {}: field cam0_calib: the lens is in another file, {}: give that one",
                             file, other->line, described(*other))};
  }
  Camera camera;
  camera.width = fields.pixels({"image_width"}, kSize).value_or(0);
  camera.height = fields.pixels({"image_height"}, kSize).value_or(0);
  auto out = read_camodocal(fields, file, camera);
  if (!out) return out;
  out->format = "VINS";
  out->camera = camera;
  out->T_body_camera = vins_mounting(fields);
  out->time_offset_s = read_time_offset(fields, "td");  // clock of the image + td = clock of the IMU
  fields.ignore({"camera_name", "cam0_calib", "cam1_calib", "estimate_extrinsic", "ex_calib_result_path",
                 "fisheye_mask", "equalize", "body_T_cam1", "extrinsicRotation", "extrinsicTranslation",
                 "fisheye", "num_of_cam", "min_dist", "F_threshold", "fast_relocalization"});
  return finish(fields, std::move(*out));
}

}  // namespace pade::io::dialect

#include "pade/io/sequence/calibration.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "pade/io/sequence/calibration_fields.hpp"
#include "pade/io/sequence/dialects/calibration_dialects.hpp"
#include "pade/io/text.hpp"
#include "pade/io/yaml.hpp"

namespace pade::io {
namespace {

using Fields = CalibrationFields;
using dialect::finish;
using dialect::read_time_offset;

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
  dialect::read_distortion(fields, camera, fields.text("distortion_model", kModel).value_or(""),
                           "distortion");
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

/// OpenCV writes "%YAML:1.0", which is no YAML directive; make it a comment, so that line numbers stay.
std::string without_opencv_directive(std::string_view text) {
  std::string out(text);
  out.front() = '#';
  return out;
}

Result<Yaml> parse_tree(std::string_view text, const std::string& file) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != std::string_view::npos && text[first] == '<') return dialect::parse_opencv_xml(text, file);
  return parse_yaml(text.starts_with("%YAML:") ? without_opencv_directive(text) : std::string(text), file);
}

}  // namespace

std::string_view lens_name(Distortion model) {
  switch (model) {
    case Distortion::none:
      return "none";
    case Distortion::plumb_bob:
      return "plumb_bob";
    case Distortion::rational_polynomial:
      return "rational_polynomial";
    case Distortion::equidistant:
      return "equidistant";
  }
  return "none";
}

Result<Calibration> parse_calibration(std::string_view text, const std::string& file, int camera) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const bool utf16 = text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF");
  if (!utf16 && text.substr(0, 4096).find('\0') != std::string_view::npos) {
    return Error{
        fmt::format("{}: found binary data, expected text: of COLMAP's cameras.bin make cameras.txt (colmap "
                    "model_converter "
                    "--output_type TXT), of NumPy's arrays a camera.yaml (docs/formats.md)",
                    file)};
  }
  if (auto read = dialect::read_text_dialect(text, file, camera)) return std::move(*read);
  const auto root = parse_tree(text, file);
  if (!root) return root.error();
  if (root->kind != Yaml::Kind::map) {
    return Error{
        fmt::format("{}: found {}, expected the fields of a camera calibration (known dialects: "
                    "docs/formats.md)",
                    file, described(*root))};
  }
  if (dialect::is_kalibr(*root)) return dialect::read_kalibr(*root, file, camera);
  if (dialect::is_orb_slam(*root)) return dialect::read_orb_slam(*root, file, camera);
  const bool vins = dialect::is_vins(*root), euroc = dialect::is_euroc(*root);
  const bool ros = dialect::is_camera_info(*root);
  if (!vins && !euroc && !ros && dialect::is_opencv(*root)) {
    return dialect::read_opencv(*root, file, camera);
  }
  if (camera > 0) return dialect::one_camera_only(file, camera);
  if (vins) return dialect::read_vins(*root, file);
  if (euroc) return dialect::read_euroc(*root, file);
  if (ros) return dialect::read_camera_info(*root, file);
  return read_camera_yaml(*root, file);
}

Result<Calibration> read_calibration(const std::filesystem::path& file, int camera) {
  const auto text = read_file(file);
  if (!text) return text.error();
  return parse_calibration(*text, file.string(), camera);
}

}  // namespace pade::io

// Calibrations that are no YAML: KITTI's, COLMAP's, and the INI form of ROS.
#include <array>
#include <charconv>
#include <cmath>
#include <map>

#include <Eigen/Core>
#include <fmt/format.h>

#include "pade/io/sequence/dialects/calibration_dialects.hpp"
#include "pade/io/sequence/layouts/sequence_layout.hpp"
#include "pade/io/text.hpp"

namespace pade::io::dialect {
namespace {

using Fields = std::vector<std::string_view>;

/// The numbers of `fields` from `first` on; empty where one is not finite.
std::optional<std::vector<double>> numbers_from(const Fields& fields, std::size_t first) {
  std::vector<double> numbers;
  for (std::size_t i = first; i < fields.size(); ++i) {
    const auto number = parse_number(fields[i]);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

/// The line of calib_cam_to_cam.txt that starts with `key`.
std::optional<std::pair<std::size_t, std::vector<double>>> row_of(const std::vector<Line>& lines,
                                                                  const std::string& key) {
  for (const Line& line : lines) {
    const Fields fields = split_fields(line.text);
    if (fields[0] != key) continue;
    return std::pair{line.number, numbers_from(fields, 1).value_or(std::vector<double>{})};
  }
  return std::nullopt;
}

Result<Calibration> read_kitti_raw(const std::vector<Line>& lines, const std::string& file, int index) {
  const std::string key = fmt::format("P_rect_{:02}:", index);
  const auto projection = row_of(lines, key);
  if (!projection) {
    return Error{fmt::format(
        "{}: found no {}, expected the camera that was asked for: choose another with --camera", file, key)};
  }
  const auto& p = projection->second;
  const bool good = p.size() == 12 && p[0] > 0 && p[5] > 0 && p[1] == 0 && p[4] == 0 && p[10] == 1;
  if (!good) {
    return Error{
        fmt::format("{}: line {}: field {} expected a 3x4 projection matrix with positive focal lengths",
                    file, projection->first, key)};
  }
  Calibration out;
  out.format = "KITTI raw";
  Camera camera{0, 0, p[0], p[5], p[2], p[6], Distortion::none, {}};
  const std::string size_key = fmt::format("S_rect_{:02}:", index);
  if (const auto size = row_of(lines, size_key)) {
    const auto pixels = [](double v) { return v >= 1 && v <= 65536 && std::floor(v) == v; };
    if (size->second.size() != 2 || !pixels(size->second[0]) || !pixels(size->second[1])) {
      return Error{fmt::format("{}: line {}: field {} expected width and height in pixels", file, size->first,
                               size_key)};
    }
    camera.width = static_cast<int>(size->second[0]);
    camera.height = static_cast<int>(size->second[1]);
  }
  out.camera = camera;
  return out;
}

/// A camera model of COLMAP: where its parameters go.
struct ColmapModel {
  std::string_view name;
  std::size_t focal;  ///< 1 or 2 focal lengths, then cx cy
  std::size_t coefficients;
  std::string_view model;
  bool radial_only;  ///< k1 k2 without p1 p2
};

constexpr std::array kColmapModels = {ColmapModel{"SIMPLE_PINHOLE", 1, 0, "none", false},
                                      ColmapModel{"PINHOLE", 2, 0, "none", false},
                                      ColmapModel{"SIMPLE_RADIAL", 1, 1, "plumb_bob", true},
                                      ColmapModel{"RADIAL", 1, 2, "plumb_bob", true},
                                      ColmapModel{"OPENCV", 2, 4, "plumb_bob", false},
                                      ColmapModel{"OPENCV_FISHEYE", 2, 4, "equidistant", false},
                                      ColmapModel{"FULL_OPENCV", 2, 8, "rational_polynomial", false}};

const ColmapModel* colmap_model(std::string_view name) {
  for (const ColmapModel& model : kColmapModels) {
    if (model.name == name) return &model;
  }
  return nullptr;
}

/// "CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]"
bool is_colmap_row(const Fields& fields) {
  if (fields.size() < 5 || !parse_number(fields[0]) || !parse_number(fields[2]) || !parse_number(fields[3])) {
    return false;
  }
  for (const char c : fields[1]) {
    if (!(c >= 'A' && c <= 'Z') && c != '_') return false;
  }
  return true;
}

Result<Calibration> read_colmap(const Line& line, const std::string& file) {
  const Fields fields = split_fields(line.text);
  const auto refuse = [&](const std::string& why) {
    return Error{fmt::format("{}: line {}: {}", file, line.number, why)};
  };
  const ColmapModel* model = colmap_model(fields[1]);
  if (model == nullptr) {
    return refuse(
        fmt::format("found camera model {}, expected SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, "
                    "OPENCV_FISHEYE or FULL_OPENCV",
                    in_quotes(fields[1])));
  }
  const auto values = numbers_from(fields, 2);
  const std::size_t count = 2 + model->focal + 2 + model->coefficients;
  if (!values || values->size() != count) {
    return refuse(fmt::format("found {} fields, expected {} finite numbers after {}", fields.size() - 2,
                              count, model->name));
  }
  const auto& v = *values;
  const auto pixels = [](double n) { return n >= 1 && n <= 65536 && std::floor(n) == n; };
  if (!pixels(v[0]) || !pixels(v[1]) || !(v[2] > 0) || !(v[2 + model->focal - 1] > 0)) {
    return refuse("expected image width and height in pixels and positive focal lengths");
  }
  Calibration out;
  out.format = "COLMAP";
  Camera camera;
  camera.width = static_cast<int>(v[0]);
  camera.height = static_cast<int>(v[1]);
  camera.fx = v[2];
  camera.fy = v[2 + model->focal - 1];
  // COLMAP counts pixels from the corner of the image: the first pixel's centre is (0.5, 0.5).
  camera.cx = v[2 + model->focal] - 0.5;
  camera.cy = v[3 + model->focal] - 0.5;
  std::vector<double> coefficients(v.begin() + static_cast<std::ptrdiff_t>(4 + model->focal), v.end());
  if (model->radial_only) coefficients.resize(4);
  if (const auto problem = set_distortion(camera, model->model, coefficients)) return refuse(*problem);
  out.camera = camera;
  return out;
}

/// The sections of an INI file whose values stand below their names (ost.txt of camera_calibration).
struct Section {
  std::string name;
  std::size_t line = 0;
  std::map<std::string, std::vector<double>> values;
};

std::vector<Section> sections_of(const std::vector<Line>& lines) {
  std::vector<Section> sections;
  std::string key;
  for (const Line& line : lines) {
    if (line.text.front() == '[' && line.text.back() == ']') {
      sections.push_back({std::string(line.text.substr(1, line.text.size() - 2)), line.number, {}});
      continue;
    }
    if (sections.empty()) continue;
    const auto numbers = numbers_from(split_fields(line.text), 0);
    if (!numbers) {
      key = std::string(line.text);
      continue;
    }
    auto& values = sections.back().values[key];
    values.insert(values.end(), numbers->begin(), numbers->end());
  }
  return sections;
}

/// [image] with width and height, then a section for each camera with its matrix and distortion.
Result<Calibration> read_ros_ini(const std::vector<Section>& sections, const std::string& file, int index) {
  const auto at = static_cast<std::size_t>(index) + 1;
  if (at >= sections.size()) {
    return Error{fmt::format("{}: found {} cameras, expected number {}: choose with --camera", file,
                             sections.size() - 1, index)};
  }
  const auto value = [](const Section& section, const char* key) {
    const auto found = section.values.find(key);
    return found == section.values.end() ? std::vector<double>{} : found->second;
  };
  const std::vector<double> width = value(sections[0], "width"), height = value(sections[0], "height");
  const std::vector<double> k = value(sections[at], "camera matrix");
  const auto pixels = [](const std::vector<double>& n) {
    return n.size() == 1 && n[0] >= 1 && n[0] <= 65536 && std::floor(n[0]) == n[0];
  };
  const bool matrix = k.size() == 9 && k[0] > 0 && k[4] > 0 && k[1] == 0 && k[3] == 0 && k[8] == 1;
  if (!pixels(width) || !pixels(height) || !matrix) {
    return Error{
        fmt::format("{}: line {}: section [{}] expected width and height in [image], and a camera matrix fx "
                    "0 cx, 0 fy cy, 0 0 1",
                    file, sections[at].line, sections[at].name)};
  }
  Calibration out;
  out.format = "ROS camera_info (INI)";
  Camera camera{
      static_cast<int>(width[0]), static_cast<int>(height[0]), k[0], k[4], k[2], k[5], Distortion::none, {}};
  const std::vector<double> d = value(sections[at], "distortion");
  if (d.size() ==
      4) {  // camera_calibration writes 5 of plumb_bob and 4 of fisheye, and this form has no model
    return Error{
        fmt::format("{}: line {}: section [{}] has 4 coefficients and no word of their model, fisheye or "
                    "plumb_bob, expected 5 or 8: give the ost.yaml that lies beside it",
                    file, sections[at].line, sections[at].name)};
  }
  const char* model = d.empty() ? "none" : d.size() == 8 ? "rational_polynomial" : "plumb_bob";
  if (const auto problem = set_distortion(camera, model, d))
    return Error{fmt::format("{}: line {}: {}", file, sections[at].line, *problem)};
  out.camera = camera;
  return out;
}

}  // namespace

std::optional<Result<Calibration>> read_text_dialect(std::string_view text, const std::string& file,
                                                     int camera) {
  std::vector<Line> rows;
  bool raw = false;
  bool odometry = false;
  const std::vector<Line> lines = data_lines(text);
  for (const Line& line : lines) {
    const Fields fields = split_fields(line.text);
    raw = raw || fields[0].starts_with("P_rect_0");
    odometry = odometry ||
               (fields.size() == 13 && fields[0].size() == 3 && fields[0][0] == 'P' && fields[0][2] == ':');
    if (is_colmap_row(fields)) rows.push_back(line);
  }
  const auto sections = sections_of(lines);
  if (sections.size() > 1 && sections.front().name == "image") return read_ros_ini(sections, file, camera);
  if (text.find("Camera-system parameters") != std::string_view::npos) {
    return Result<Calibration>(Error{fmt::format(
        "{}: this is Kalibr's report for people, expected the camchain.yaml that it writes beside it",
        file)});
  }
  if (raw) return read_kitti_raw(lines, file, camera);
  if (odometry) return parse_kitti_calibration(text, file, camera);
  if (rows.empty() || rows.size() != lines.size()) return std::nullopt;
  if (static_cast<std::size_t>(camera) >= rows.size()) {
    return Result<Calibration>(Error{fmt::format(
        "{}: found {} cameras, expected number {}: choose with --camera", file, rows.size(), camera)});
  }
  return read_colmap(rows[static_cast<std::size_t>(camera)], file);
}

}  // namespace pade::io::dialect

#include "info/calibration_info.hpp"

#include <string>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/io/sequence/calibration.hpp"

#include "info/info_lines.hpp"
#include "options/json_text.hpp"

namespace pade::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using cli::json_of;

Json json_of(const io::Calibration& calibration) {
  Json json = {{"kind", "calibration"},    {"dialect", calibration.format},
               {"camera", nullptr},        {"T_body_camera", nullptr},
               {"time_offset_s", nullptr}, {"ignored", calibration.unknown_fields}};
  if (const auto& camera = calibration.camera) {
    json["camera"] = {{"width", camera->width},
                      {"height", camera->height},
                      {"fx", camera->fx},
                      {"fy", camera->fy},
                      {"cx", camera->cx},
                      {"cy", camera->cy},
                      {"distortion_model", io::lens_name(camera->distortion)},
                      {"distortion", camera->coefficients}};
  }
  if (const auto& mounting = calibration.T_body_camera) {
    const Eigen::Matrix3d R = mounting->matrix3();
    json["T_body_camera"] = {{"rotation_by_rows", Json::array()},
                             {"translation_m", json_of(mounting->translation)}};
    for (int i = 0; i < 9; ++i) json["T_body_camera"]["rotation_by_rows"].push_back(R(i / 3, i % 3));
  }
  if (calibration.time_offset_s) json["time_offset_s"] = *calibration.time_offset_s;
  return json;
}

}  // namespace

Status inform_of_calibration(const fs::path& file, int camera_number, bool as_json) {
  const auto calibration = io::read_calibration(file, camera_number);
  if (!calibration) return calibration.error();
  if (!calibration->camera)
    return Error{
        fmt::format("{}: found no camera in it, expected a calibration (known dialects: docs/formats.md) or "
                    "a map (.bt, .ot)",
                    file.string())};
  if (as_json) {
    fmt::print("{}\n", json_text(json_of(*calibration)));
    return {};
  }
  const Camera& camera = *calibration->camera;
  fmt::print("{}: calibration of a camera, {}\n", file.string(), calibration->format);
  const std::string size = camera.width > 0 ? fmt::format("{} x {}", camera.width, camera.height)
                                            : "size not stated (the images')";
  line("camera", "{}, f = {:.2f} {:.2f}, c = {:.2f} {:.2f}", size, camera.fx, camera.fy, camera.cx,
       camera.cy);
  line("lens", "{} {}", io::lens_name(camera.distortion), fmt::join(camera.coefficients, " "));
  if (const auto& mounting = calibration->T_body_camera) {
    const Eigen::Matrix3d R = mounting->matrix3();
    line("mounting", "camera at {} of the body, looking along {}, its right along {}",
         vector_text(mounting->translation), vector_text(R.col(2)), vector_text(R.col(0)));
  }
  if (calibration->time_offset_s)
    line("time", "clock of the poses - clock of the images = {:g} s", *calibration->time_offset_s);
  for (const std::string& field : calibration->unknown_fields) line("ignored", "{}", field);
  return {};
}

}  // namespace pade::cli

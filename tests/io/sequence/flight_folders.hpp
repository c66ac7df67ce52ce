// A short synthetic flight and its folder in each layout, written by the tests themselves (printf, and
// pictures whose codec is held to OpenCV's), so that the readers are not checked against their own writer.
#pragma once

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/time.hpp"
#include "pade/io/image/image_codec.hpp"

namespace pade::test {

namespace fs = std::filesystem;

inline void write_text(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

inline std::string read_bytes(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

inline void write_image(const fs::path& file, const cv::Mat& image) {
  fs::create_directories(file.parent_path());
  ASSERT_TRUE(io::save_image(file.string(), image)) << file;
}

struct Flight {
  Camera camera{64, 48, 60.0, 61.0, 31.2, 23.9, Distortion::plumb_bob, {-0.05, 0.01, 1e-4, -2e-4}};
  std::vector<Time> times;
  std::vector<Pose> T_world_camera;
  std::vector<cv::Mat> images;

  [[nodiscard]] std::size_t size() const { return times.size(); }
  [[nodiscard]] std::string stamp(std::size_t i) const { return to_string(times[i]); }
};

/// `count` grey frames of smooth noise without black, 10 per second, on a curved path.
inline Flight make_flight(int count = 6) {
  Flight flight;
  for (int i = 0; i < count; ++i) {
    flight.times.push_back({1'403'636'579'000'000'000 + 100'000'000LL * i});
    const double s = i;
    flight.T_world_camera.push_back(
        {rotation_exp({0.02 * s, 0.1 + 0.03 * s, -0.01 * s}), {0.2 * s, -0.05 * s, 1 + 0.3 * s}});
    cv::RNG random(static_cast<std::uint64_t>(i) + 1);
    cv::Mat image(flight.camera.size(), CV_8UC1);
    random.fill(image, cv::RNG::UNIFORM, 30, 250);
    cv::GaussianBlur(image, image, {5, 5}, 1);
    flight.images.push_back(image);
  }
  return flight;
}

inline std::string pose_row(const std::string& time, const Pose& pose) {
  const auto& t = pose.translation;
  const auto& q = pose.rotation;
  return fmt::format("{} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\n", time, t.x(), t.y(),
                     t.z(), q.x(), q.y(), q.z(), q.w());
}

inline std::string pose_file(const Flight& flight) {
  std::string text = "# timestamp tx ty tz qx qy qz qw\n";
  for (std::size_t i = 0; i < flight.size(); ++i) text += pose_row(flight.stamp(i), flight.T_world_camera[i]);
  return text;
}

inline std::string camera_yaml(const Camera& c) {
  const auto& k = c.coefficients;
  return fmt::format(
      "width: {}\nheight: {}\nfx: {}\nfy: {}\ncx: {}\ncy: {}\ndistortion_model: plumb_bob\n"
      "distortion: [{}, {}, {}, {}, {}]\ndepth_scale: 1000\n",
      c.width, c.height, c.fx, c.fy, c.cx, c.cy, k[0], k[1], k[2], k[3], k[4]);
}

inline fs::path rgb_file(const fs::path& folder, const Flight& flight, std::size_t i) {
  return folder / "rgb" / (flight.stamp(i) + ".png");
}

inline void write_tum(const fs::path& folder, const Flight& flight) {
  for (std::size_t i = 0; i < flight.size(); ++i) write_image(rgb_file(folder, flight, i), flight.images[i]);
  write_text(folder / "groundtruth.txt", pose_file(flight));
  write_text(folder / "camera.yaml", camera_yaml(flight.camera));
}

/// Rows of a 4x4 matrix as one YAML list.
inline std::string matrix_list(const Pose& pose) {
  const Eigen::Matrix3d r = pose.matrix3();
  std::string text = "[";
  for (int i = 0; i < 3; ++i) {
    text +=
        fmt::format("{:.17g}, {:.17g}, {:.17g}, {:.17g}, ", r(i, 0), r(i, 1), r(i, 2), pose.translation[i]);
  }
  return text + "0.0, 0.0, 0.0, 1.0]";
}

inline std::string euroc_sensor_yaml(const Camera& c, const Pose& T_body_camera) {
  const auto& k = c.coefficients;
  return fmt::format(
      "# General sensor definitions.\nsensor_type: camera\ncomment: VI-Sensor cam0 (MT9M034)\n"
      "T_BS:\n  cols: 4\n  rows: 4\n  data: {}\nrate_hz: 20\nresolution: [{}, {}]\ncamera_model: pinhole\n"
      "intrinsics: [{}, {}, {}, {}] #fu, fv, cu, cv\ndistortion_model: radial-tangential\n"
      "distortion_coefficients: [{}, {}, {}, {}]\n",
      matrix_list(T_body_camera), c.width, c.height, c.fx, c.fy, c.cx, c.cy, k[0], k[1], k[2], k[3]);
}

inline std::string euroc_row(Time time, const Pose& pose, const char* tail) {
  const auto& t = pose.translation;
  const auto& q = pose.rotation;
  return fmt::format("{},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}{}\n", time.nanoseconds,
                     t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z(), tail);
}

inline void write_euroc_images(const fs::path& mav, const Flight& flight, const Pose& T_body_camera) {
  std::string list = "#timestamp [ns],filename\r\n";
  for (std::size_t i = 0; i < flight.size(); ++i) {
    const std::string name = fmt::format("{}.png", flight.times[i].nanoseconds);
    write_image(mav / "cam0" / "data" / name, flight.images[i]);
    list += fmt::format("{},{}\r\n", flight.times[i].nanoseconds, name);
  }
  write_text(mav / "cam0" / "data.csv", list);
  write_text(mav / "cam0" / "sensor.yaml", euroc_sensor_yaml(flight.camera, T_body_camera));
}

inline void write_euroc(const fs::path& folder, const Flight& flight, const Pose& T_body_camera) {
  write_euroc_images(folder / "mav0", flight, T_body_camera);
  std::string poses =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], ...\n";
  for (std::size_t i = 0; i < flight.size(); ++i) {
    poses += euroc_row(flight.times[i], flight.T_world_camera[i] * T_body_camera.inverse(),
                       ",0.1,0.2,0.3,0,0,0,0,0,0");
  }
  write_text(folder / "mav0" / "state_groundtruth_estimate0" / "data.csv", poses);
}

/// Camera 2 of a KITTI sequence. `t_camera_camera0` is camera 0 seen from camera 2.
inline void write_kitti(const fs::path& folder, const fs::path& pose_file, const Flight& flight,
                        const Eigen::Vector3d& t_camera_camera0) {
  const Camera& c = flight.camera;
  const Eigen::Vector3d p4 = c.matrix() * t_camera_camera0;
  const auto row = [&](const Eigen::Vector3d& last) {
    return fmt::format("{:.17e} 0 {:.17e} {:.17e} 0 {:.17e} {:.17e} {:.17e} 0 0 1 {:.17e}\n", c.fx, c.cx,
                       last.x(), c.fy, c.cy, last.y(), last.z());
  };
  write_text(folder / "calib.txt",
             "P0: " + row({0, 0, 0}) + "P1: " + row({-3, 0, 0}) + "P2: " + row(p4) + "P3: " + row({1, 2, 3}));
  std::string times;
  std::string poses;
  for (std::size_t i = 0; i < flight.size(); ++i) {
    write_image(folder / "image_2" / fmt::format("{:06}.png", i), flight.images[i]);
    times += flight.stamp(i) + "\n";
    const Pose T_world_camera0 =
        flight.T_world_camera[i] * Pose{Eigen::Quaterniond::Identity(), t_camera_camera0};
    const Eigen::Matrix3d r = T_world_camera0.matrix3();
    for (int j = 0; j < 3; ++j) {
      poses += fmt::format("{:.17e} {:.17e} {:.17e} {:.17e}{}", r(j, 0), r(j, 1), r(j, 2),
                           T_world_camera0.translation[j], j < 2 ? " " : "\n");
    }
  }
  write_text(folder / "times.txt", times);
  write_text(pose_file, poses);
}

inline double rotation_difference(const Pose& a, const Pose& b) {
  return rotation_log(Eigen::Quaterniond(a.rotation.conjugate() * b.rotation)).norm();
}

inline bool same_pixels(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0;
}

}  // namespace pade::test

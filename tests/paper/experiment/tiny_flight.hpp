// A tiny flight as a folder, for the experiments.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/io/sequence/trajectory.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

namespace pade::test {

/// Images, exact depth and poses of an analytic flight, in the TUM layout.
inline void write_flight(const std::filesystem::path& folder, const std::string& name, int frames = 4,
                         const Camera& camera = simulation::analytic_camera(96, 72)) {
  namespace fs = std::filesystem;
  fs::create_directories(folder / "rgb");
  fs::create_directories(folder / "depth");
  const auto flight = *simulation::make_analytic_flight(name, frames, camera);
  std::vector<io::StampedPose> poses;
  for (std::size_t k = 0; k < flight.times.size(); ++k) {
    const std::string file = to_string(flight.times[k]) + ".png";
    const Pose& pose = flight.T_world_camera[k];
    EXPECT_TRUE(
        io::save_image(folder / "rgb" / file, simulation::render_image(flight.scene, flight.camera, pose)));
    cv::Mat depth = simulation::exact_depth(flight.scene, flight.camera, pose);
    cv::patchNaNs(depth);
    depth.convertTo(depth, CV_16U, 1000);
    EXPECT_TRUE(io::save_image(folder / "depth" / file, depth));
    poses.push_back({flight.times[k], pose});
  }
  std::ofstream(folder / "groundtruth.txt") << io::format_trajectory(poses);
  const Camera& c = flight.camera;
  std::ofstream(folder / "camera.yaml")
      << "width: " << c.width << "\nheight: " << c.height << "\nfx: " << c.fx << "\nfy: " << c.fy
      << "\ncx: " << c.cx << "\ncy: " << c.cy
      << "\ndistortion_model: none\ndepth_scale: 1000\nworld_up: \"+z\"\n";
}

}  // namespace pade::test

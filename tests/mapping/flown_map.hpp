// Depth images of analytic flights and the maps made of them.
#pragma once

#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include "pade/mapping/occupancy_map.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

namespace pade::mapping {

/// Exact depth with normal noise of standard deviation `relative` * Z that the variance states truly.
inline DepthImage depth_image(const simulation::AnalyticFlight& flight, std::size_t frame,
                              double relative = 0) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  DepthImage image;
  image.time = flight.times[frame];
  image.depth = simulation::exact_depth(flight.scene, flight.camera, flight.T_world_camera[frame], 2);
  image.variance = cv::Mat(image.depth.size(), CV_32FC1, cv::Scalar(0));
  image.state = cv::Mat(image.depth.size(), CV_8UC1, cv::Scalar(0));
  std::mt19937_64 random(1000 + frame);
  std::normal_distribution<double> normal;
  for (int v = 0; v < image.depth.rows; ++v) {
    for (int u = 0; u < image.depth.cols; ++u) {
      auto& depth = image.depth.at<float>(v, u);
      if (std::isnan(depth)) {
        image.variance.at<float>(v, u) = kNaN;
        image.state.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(DepthState::no_texture);
        continue;
      }
      const double sigma = relative * depth;
      image.variance.at<float>(v, u) = static_cast<float>(sigma * sigma);
      if (relative > 0) depth = static_cast<float>(depth + sigma * normal(random));
    }
  }
  return image;
}

inline OccupancyMap map_of(const simulation::AnalyticFlight& flight, double relative,
                           const MapOptions& options = {}) {
  OccupancyMap map = std::move(OccupancyMap::create(options)).value();
  for (std::size_t k = 0; k < flight.times.size(); ++k) {
    map.integrate(depth_image(flight, k, relative), flight.camera, flight.T_world_camera[k]);
  }
  return map;
}

}  // namespace pade::mapping

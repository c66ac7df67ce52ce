// The report of a run: one self-contained HTML page with pictures, the map, accuracy, timing and health.
// Readable on paper, and by people who do not see all colours.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/core/depth_image.hpp"
#include "pade/evaluation/depth_accuracy.hpp"
#include "pade/io/run/run_info.hpp"
#include "pade/mapping/occupancy_map.hpp"

namespace pade::evaluation {

/// One frame that the report shows.
struct ReportFrame {
  std::string name;  ///< of the image file, or its time
  cv::Mat image;     ///< CV_8UC1 or CV_8UC3 (BGR), undistorted
  cv::Mat flow;      ///< CV_32FC2 on its pixels, NaN = none; empty where there is nothing to show
  DepthImage depth;  ///< any window
  cv::Mat truth;     ///< CV_32FC1 metres, NaN = none; empty where there is no truth
};

/// What a report is made of.
struct Report {
  io::RunInfo info;  ///< as RunWriter::completed() gives it
  io::RunTiming timing;
  std::optional<DepthAccuracy> accuracy;           ///< empty without truth
  std::vector<ReportFrame> frames;                 ///< a few, in the order of time
  const mapping::OccupancyMap* map = nullptr;      ///< as the run left it; null if there is none
  std::vector<Eigen::Vector3d> trajectory;         ///< camera positions, world, metres, in the order of time
  Eigen::Vector3d look = Eigen::Vector3d::Zero();  ///< optical axis at the last of them, world
};

/// The page. Nothing in it but what the report says: the same input gives the same bytes.
std::string to_html(const Report& report);

/// `wanted` indices spread evenly over 0 .. count - 1, away from both ends: the frames to show. All if
/// there are fewer.
std::vector<std::size_t> evenly_spread(std::size_t count, std::size_t wanted);

}  // namespace pade::evaluation

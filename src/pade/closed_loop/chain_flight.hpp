// The whole module in a closed loop: rendered images and simulated instruments through navigation, depth, map
// and planner to the motion that makes the next image. Nothing but the watch knows the truth.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pade/closed_loop/faults.hpp"
#include "pade/closed_loop/flight_record.hpp"
#include "pade/closed_loop/navigated_vehicle.hpp"
#include "pade/core/options.hpp"
#include "pade/core/result.hpp"
#include "pade/mapping/query/map_view.hpp"
#include "pade/pipeline/obstacle_mapper.hpp"
#include "pade/planning/local_planner.hpp"
#include "pade/simulation/render/image_formation.hpp"
#include "pade/simulation/render/renderer.hpp"

namespace pade::closed_loop {

struct ChainFlightOptions {
  static constexpr double longest_stand = 60;  ///< s, for `stand` and until it gives up

  planning::LocalPlannerOptions planner;
  ObstacleMapperOptions mapper = outdoors();
  NavigatedVehicleOptions vehicle;
  simulation::ImageOptions image;
  simulation::RenderOptions render;
  FaultOptions fault;
  double frame_rate = 10;     ///< Hz; a plan takes effect one frame after its image
  double time_limit = 120;    ///< s after the climb
  double stand = 8;           ///< s at rest before take-off, for the filter to start in
  double climb = 1.2;         ///< m that it climbs to the start, camera on: the first baseline
  double known_start = 1.5;   ///< m about this climb that are known to be free
  double blind_after = 0.35;  ///< s without a new depth image after which it brakes
  double exposure_time = 0;   ///< s: motion blur
  int width = 640;            ///< of the image, with a horizontal field of view of 60 degrees

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("planner", self.planner, "local planner");
    field("mapper", self.mapper, "depth and map");
    field("vehicle", self.vehicle, "motion, instruments and navigation");
    field("image", self.image, "what the sensor makes of the light");
    field("render", self.render, "how the light is drawn");
    field("fault", self.fault, "what goes wrong on purpose");
    field("frame_rate", self.frame_rate, "Hz");
    field("time_limit", self.time_limit, "s after the climb");
    field("stand", self.stand, "s at rest before take-off");
    field("climb", self.climb, "m that it climbs to the start of its way");
    field("known_start", self.known_start, "m about this climb that are known to be free");
    field("blind_after", self.blind_after, "s without a new depth image after which it brakes");
    field("exposure_time", self.exposure_time, "s, motion blur");
    field("width", self.width, "of the image, px");
  }
  /// The sky over the ground is free.
  static ObstacleMapperOptions outdoors();
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const ChainFlightOptions& options);

/// What became of one image.
struct ChainFrame {
  double time = 0;  ///< s since take-off
  MapperUpdate::Outcome outcome = MapperUpdate::Outcome::waiting;
  int views = 0;         ///< that its depth was read from, beside the pair
  bool refined = false;  ///< its motion, by the images
  bool blind = false;    ///< nothing new was seen for too long: it brakes
  bool alone = false;    ///< without satellites: dead reckoning
  bool unheld = false;   ///< without satellites too little is known of its velocity: it brakes
  Eigen::Vector3d believed =
      Eigen::Vector3d::Zero();  ///< place, in the true world as it was found at take-off, m
  double step = 0;              ///< length of the motion from the frame before, as mapped, m
  double given_step = 0;        ///< and as navigation gave it, m
  double drift = 0;     ///< of the map's world from the true one since take-off, where the vehicle is, m
  double tracking = 0;  ///< from where it was to be by its plan, m
  double seconds = 0;   ///< of processor time, navigation to plan
};

/// What there is to see of a flight, after each frame. Its parts are valid until the observer returns.
struct ChainMoment {
  double done = 0;                       ///< share of the way, 0 to 1
  const cv::Mat& image;                  ///< as the camera has delivered it; empty if it has not
  const MapperUpdate* update = nullptr;  ///< null if the mapper did not take it
  const ChainFrame& frame;
};

struct ChainRecord {
  FlightRecord flight;
  std::vector<ChainFrame> frames;
  std::vector<std::string> events;               ///< what a person should know, with the time
  std::shared_ptr<const mapping::MapView> view;  ///< of the map at the end, in the map's world
  std::shared_ptr<const ObstacleMapper> mapper;  ///< at the end
  Pose T_world_map;                              ///< at take-off
  double climbed = 0;                            ///< s, when it was at the height of the start
  double seconds_blind = 0;                      ///< s
  double seconds_unheld = 0;                     ///< s that it braked since it did not know its velocity
  double seconds_alone = 0;                      ///< s of dead reckoning, without satellites
  std::optional<double> passer_by_clearance;     ///< least, of the centre, m; if somebody walks by
  double stamp_correction = 0;  ///< s, at the end: what the images have shown of their stamps
};

/// Flies from start to goal, from a standstill below the start with the nose toward the goal, by its own
/// navigation, depth, map and planner. The goal is known relative to the place of take-off, in east, north
/// and up. It ends where navigation says that the goal is reached, at the first contact with the true surface
/// (looked at 100 times a second), or at the time limit. The same bytes each time but for
/// ChainFrame::seconds.
/// @param observer  called after each frame; false stops the flight, which is an error. May be empty.
Result<ChainRecord> fly_chain(const FlightTask& task, const ChainFlightOptions& options,
                              const std::function<bool(const ChainMoment&)>& observer = {});

}  // namespace pade::closed_loop

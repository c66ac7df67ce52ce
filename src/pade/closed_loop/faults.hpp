// What goes wrong in a flight on purpose.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

#include <Eigen/Core>

#include "pade/core/options.hpp"
#include "pade/core/result.hpp"
#include "pade/simulation/generator/open_world_scene.hpp"

namespace pade::closed_loop {

/// One kind of fault. Those with a beginning and an end last from `FaultOptions::from` for
/// `FaultOptions::duration`; the rest last the whole flight.
enum class Fault {
  none,
  gnss_outage,     ///< no position and no velocity from the satellites, for a time
  frozen_camera,   ///< the same image again and again, with new stamps, for a time
  late_stamps,     ///< images are stamped later than they were taken
  early_stamps,    ///< ... earlier
  gust,            ///< wind from the side, for a time
  exposure_jump,   ///< the light that reaches the sensor halves and doubles, every second
  dropped_frames,  ///< one frame in ten never arrives; now and then two or three in a row
  compass_error,   ///< the magnetometer is turned about the vertical
  motion_blur,     ///< exposure of 10 ms
  crossing,        ///< somebody walks across the way, close ahead
  blank_wall,      ///< a wall without texture stands across the way
  low_sun,         ///< the sun stands ten degrees high, straight ahead
};

struct FaultOptions {
  Fault kind = Fault::none;
  double from = 3;                ///< s after take-off
  double duration = 10;           ///< s
  double stamp_error = 0.03;      ///< s
  double gust = 5;                ///< m/s
  double compass_error = 0.5236;  ///< rad
  double crossing_ahead = 9;      ///< m
  double crossing_at = 6;         ///< s after take-off

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("kind", self.kind, "what goes wrong");
    field("from", self.from, "s after take-off, of what has a beginning");
    field("duration", self.duration, "s, of what has an end");
    field("stamp_error", self.stamp_error, "s between a stamp and its image");
    field("gust", self.gust, "wind of a gust, m/s");
    field("compass_error", self.compass_error, "turn of the magnetometer about the vertical, rad");
    field("crossing_ahead", self.crossing_ahead, "how far along the way somebody crosses it, m");
    field("crossing_at", self.crossing_at, "when, s after take-off");
  }
  /// Whether it goes on at this time of a flight (s).
  [[nodiscard]] bool is_on(Fault what, double time) const {
    return kind == what && time >= from && time < from + duration;
  }
  /// How long a flight went on under it, s, and after it was over.
  /// @param flight  s from take-off to its end
  struct Seconds {
    double under;
    double after;
  };
  [[nodiscard]] Seconds seconds_of(double flight) const;
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const FaultOptions& options);

/// Whether a frame never arrives: one in ten, at random, now and then two or three in a row.
/// @param seed  of the flight. @param frame  counted from take-off
bool is_dropped(std::uint64_t seed, int frame);

/// What stands in a world, or lights it, for a fault; the world as it is for the others.
/// Refuses a world in which a blank wall leaves no way for a ball of 0.5 m.
Result<simulation::OpenWorldScene> built_for(Fault fault, simulation::OpenWorldScene world);

}  // namespace pade::closed_loop

template <>
struct pade::EnumNames<pade::closed_loop::Fault> {
  using F = pade::closed_loop::Fault;
  static constexpr std::array names = {std::pair{F::none, std::string_view("none")},
                                       std::pair{F::gnss_outage, std::string_view("gnss-outage")},
                                       std::pair{F::frozen_camera, std::string_view("frozen-camera")},
                                       std::pair{F::late_stamps, std::string_view("late-stamps")},
                                       std::pair{F::early_stamps, std::string_view("early-stamps")},
                                       std::pair{F::gust, std::string_view("gust")},
                                       std::pair{F::exposure_jump, std::string_view("exposure-jump")},
                                       std::pair{F::dropped_frames, std::string_view("dropped-frames")},
                                       std::pair{F::compass_error, std::string_view("compass-error")},
                                       std::pair{F::motion_blur, std::string_view("motion-blur")},
                                       std::pair{F::crossing, std::string_view("crossing")},
                                       std::pair{F::blank_wall, std::string_view("blank-wall")},
                                       std::pair{F::low_sun, std::string_view("low-sun")}};
};

// What is written of a flight.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "pade/closed_loop/chain_flight.hpp"
#include "pade/core/result.hpp"

namespace pade::cli {

/// The measures of a flight; docs/fly.md says what each is.
nlohmann::ordered_json measures_of(const closed_loop::FlightTask& task,
                                   const closed_loop::FlightRecord& flight, double radius);
/// The same with those of the chain.
nlohmann::ordered_json measures_of(const closed_loop::FlightTask& task,
                                   const closed_loop::ChainRecord& flight, double radius,
                                   const closed_loop::FaultOptions& fault);

/// Pictures that the camera took on the way, with what was made of them.
class FlightStrip {
 public:
  /// Takes a picture every few seconds, and keeps some, spread over the flight.
  void look(const closed_loop::ChainMoment& moment);
  /// <figure>s.
  [[nodiscard]] std::string html() const;

 private:
  struct Shot {
    double time;
    std::string image, depth;  // data: URIs
  };
  double next_ = 1;   // s
  double every_ = 2;  // s
  std::vector<Shot> shots_;
};

/// track.csv, plans.csv; of the chain also frames.csv, events.txt, map.bt, timing.json and flight.html;
/// flight.json last: where it is, the flight is finished.
Status write_flight(const std::filesystem::path& folder, const nlohmann::ordered_json& whole,
                    const closed_loop::FlightRecord& flight);
Status write_flight(const std::filesystem::path& folder, const nlohmann::ordered_json& whole,
                    const closed_loop::FlightTask& task, const closed_loop::ChainRecord& flight,
                    const FlightStrip& strip);

/// report.html of all flights.
std::string fleet_page(const nlohmann::ordered_json& all);

}  // namespace pade::cli

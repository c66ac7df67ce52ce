// A log of navigation sensors that was checked for what it claims to be, and what to say of it and its run.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "pade/core/hint.hpp"
#include "pade/core/result.hpp"
#include "pade/core/sensors/navigation_log.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/navigation/navigation_run.hpp"

namespace pade {

/// A log, and what should be known of it before its results are relied on.
struct CheckedLog {
  NavigationLog log;
  std::vector<Hint> hints;  ///< worst first
};
/// Puts jittering IMU stamps on a line (navigation::regularise_stamps) and checks the log
/// (navigation::check_log).
CheckedLog checked_log(NavigationLog log);

/// Checks it again with the sensors' latencies taken off their stamps: what was found because of them is then
/// gone.
void check_with_latencies(CheckedLog& checked, const navigation::NavigatorOptions& latencies);

/// The same of a log folder. Errors: io::read_navigation_log.
Result<CheckedLog> read_checked_log(const std::filesystem::path& folder,
                                    const io::NavigationLogOptions& options = {});

/// Reads the sensors at a place; `topics` are those of a recording that are meant where several fit. Readers
/// that know more kinds of logs than read_checked_log() can take its place.
using LogReader =
    std::function<Result<CheckedLog>(const std::filesystem::path& place, const std::string& topics)>;

/// The hints of a log and those of its run, worst first.
std::vector<Hint> all_hints(const CheckedLog& checked, const NavigationRun& run);

/// Why a run has no frame: its status, and the hints of the log.
Error never_aligned(const std::string& folder, const CheckedLog& checked, const NavigationRun& run);

}  // namespace pade

// Logs of navigation sensors, in our own layout and in those of the recordings that we test with. Everything
// is converted to the project's frames here (body FLU, world ENU), and nowhere else. Columns are found by the
// exact names of the dialects in docs/formats.md; a file of another layout, or one that does not say its
// frame, is refused.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/core/sensors/measurements.hpp"
#include "pade/core/sensors/navigation_log.hpp"

namespace pade::io {

/// Standard deviations for receivers whose log has none (an ordinary single-frequency receiver).
struct GnssDefaults {
  double position_horizontal = 1.5;   ///< m
  double position_vertical = 2.5;     ///< m
  double velocity_horizontal = 0.15;  ///< m/s
  double velocity_vertical = 0.25;    ///< m/s
};

/// IMU samples from text: our layout, the recordings' (heading with units and "FRD"), EuRoC's imu0/data.csv,
/// or a VectorNav export. `name` stands in messages. Rows with a value that is not finite are left out and
/// reported in `remarks`. Errors: as parse_table; no frame; columns missing; specific force in g or stamps
/// not in seconds.
Result<std::vector<ImuSample>> parse_imu(std::string_view text, std::string_view name,
                                         std::vector<std::string>& remarks);

/// GNSS position and velocity from text: our layout, local NED, geodetic, or a VectorNav export. Geodetic
/// positions become ENU at the first fix (WGS84). Missing sigmas are filled from `defaults`, with a remark.
Result<GnssLog> parse_gnss(std::string_view text, std::string_view name, const GnssDefaults& defaults,
                           std::vector<std::string>& remarks);

Result<std::vector<BarometricHeight>> parse_barometer(std::string_view text, std::string_view name,
                                                      std::vector<std::string>& remarks);
Result<std::vector<MagneticField>> parse_magnetometer(std::string_view text, std::string_view name,
                                                      std::vector<std::string>& remarks);

/// True states from text: local NED with an attitude quaternion (truth.csv of the recordings), or EuRoC's
/// state_groundtruth_estimate0/data.csv (its world is taken as ENU).
Result<std::vector<TrueState>> parse_truth(std::string_view text, std::string_view name,
                                           std::vector<std::string>& remarks);

/// body_truth.txt of a simulated flight: TUM rows T_world_body. Velocities are central differences.
Result<std::vector<TrueState>> parse_body_truth(std::string_view text, std::string_view name,
                                                std::vector<std::string>& remarks);

/// Camera-frame stamps, one per line (first column, seconds); a heading and '#' lines are passed over.
Result<std::vector<Time>> parse_stamps(std::string_view text, std::string_view name);

struct NavigationLogOptions {
  std::string gnss;  ///< file name of the GNSS log in the folder; empty: gnss.csv, or the only gnss*.csv
  GnssDefaults gnss_defaults;
  std::string topics;  ///< of a recording, where several fit: names, separated by blanks
};

/// Reads a log folder: our layout or a recording (imu.csv, gnss*.csv, baro.csv, mag.csv, truth.csv or
/// body_truth.txt), EuRoC (mav0/imu0/data.csv ...), or VectorNav (*-imu.csv, *-gnss.csv); or a recording of
/// ROS (read_recording_sensors). Errors: no IMU file, several GNSS files and none chosen, or a file unusable
/// as a whole.
Result<NavigationLog> read_navigation_log(const std::filesystem::path& folder,
                                          const NavigationLogOptions& options = {});

/// The sensors of a recording of ROS (recording/recording.hpp): Imu, NavSatFix, the receiver's TwistStamped
/// (east, north, up), MagneticField, FluidPressure. The IMU's frame is the body. Errors: those of
/// Recording::open; the IMU or the GNSS is missing; several topics fit and none is named in `topics`; the IMU
/// counts in g or degrees.
Result<NavigationLog> read_recording_sensors(const std::filesystem::path& file, std::string_view topics);

/// The sensors of a recording that has not all of them.
struct RecordedSensors {
  NavigationLog log;
  std::vector<std::string> topics;  ///< that were read
};
/// The same, where the IMU, the GNSS or both may be missing.
Result<RecordedSensors> read_some_sensors(const std::filesystem::path& file, std::string_view topics);

/// Whether the samples are in m/s² and rad/s: the norm of the specific force is near gravity most of the
/// time, whatever the vehicle does. Nothing is said of none.
/// @param name         of the file, for the message
/// @param has_heading  which may state another unit
Status check_imu_units(const std::vector<ImuSample>& samples, std::string_view name, bool has_heading);

/// Our own layout as text, stamps with nine digits where needed; what parse_imu and parse_gnss read back.
std::string format_imu(const std::vector<ImuSample>& samples);
/// Rows pair a fix with the velocity of the same stamp; where the other is missing it is NaN. Of covariances
/// the sigmas are kept.
std::string format_gnss(const GnssLog& log);

}  // namespace pade::io

// PX4's logs (.ulg, https://docs.px4.io/main/en/dev_log/ulog_file_format.html): topics whose fields the file
// itself describes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/core/sensors/navigation_log.hpp"
#include "pade/live/autopilot_sensors.hpp"

namespace pade::live {

/// By its name.
bool is_ulog(const std::filesystem::path& file);

/// The topics of a log.
class Ulog {
 public:
  /// One topic: a name, and which of several of that name.
  struct Topic {
    std::string name;
    int instance = 0;
    std::vector<std::string_view> rows;  ///< bytes of each message, in the order of the file
  };

  /// @{
  /// Rows point into the bytes, which stay where they are when a log is moved.
  Ulog(const Ulog&) = delete;
  Ulog& operator=(const Ulog&) = delete;
  Ulog(Ulog&&) noexcept = default;
  Ulog& operator=(Ulog&&) noexcept = default;
  ~Ulog() = default;
  /// @}

  /// Errors: no log, or one with features that have to be understood and are not. The format has no
  /// checksums: a message counts where its size, its letter, its topic and its text are what they can be.
  /// Where one does not, the next that does is looked for, and what was passed over, or is cut off, is said
  /// in remarks(). Damage within the numbers of a message is not seen.
  /// @param name  in messages
  static Result<Ulog> parse(std::string bytes, const std::string& name);

  [[nodiscard]] const std::vector<Topic>& topics() const { return topics_; }
  [[nodiscard]] const std::vector<std::string>& remarks() const { return remarks_; }
  /// Null if there is none.
  [[nodiscard]] const Topic* find(std::string_view name, int instance = 0) const;
  /// A field of all rows as numbers: "timestamp", or "gyro_rad[2]" of an array. NaN where a row is too short.
  /// Empty if the topic has no such field. Whole numbers beyond 2^53 lose their last digits.
  [[nodiscard]] std::optional<std::vector<double>> column(const Topic& topic, std::string_view field) const;

 private:
  Ulog() = default;
  struct Field {
    std::string type;
    std::string name;
    std::size_t count = 1;
    bool array = false;
  };
  struct Place {
    std::string type;
    std::size_t offset = 0;
  };
  /// A number that stands for a topic, and how many bytes its rows have: with the filling at their end,
  /// without, and without that of a last field which is a topic in itself. Empty if nobody knows.
  struct Subscription {
    std::size_t topic = 0;
    std::vector<std::size_t> sizes;
  };
  class Damage;
  Status read_definition(std::string_view text);
  void add_topic(std::string_view message);
  void take(char type, std::string_view message);
  [[nodiscard]] bool is_possible(char type, std::string_view message, std::size_t at) const;
  [[nodiscard]] std::optional<std::size_t> end_of_message(std::size_t at) const;
  [[nodiscard]] bool goes_on(std::size_t at) const;
  [[nodiscard]] std::optional<std::size_t> next_message(std::size_t at) const;
  [[nodiscard]] bool has_size_of_its_key(std::string_view keyed) const;
  [[nodiscard]] std::optional<std::size_t> size_of(const std::string& type, int depth) const;
  [[nodiscard]] std::size_t filling_of(const std::string& type, int depth, int deepest) const;
  [[nodiscard]] std::optional<Place> place_of(const std::string& format, std::string_view field) const;

  std::string bytes_;  // rows point into it
  std::map<std::string, std::vector<Field>, std::less<>> formats_;
  std::vector<Topic> topics_;
  std::map<std::uint16_t, Subscription> ids_;
  std::size_t appended_ = 0;  // where data was appended to a log that may end within a message; 0: nowhere
  std::vector<std::string> remarks_;
};

/// IMU (sensor_combined), GNSS (vehicle_gps_position, else sensor_gps), magnetometer (vehicle_magnetometer)
/// and barometer (vehicle_air_data) in the project's frames. Errors: those of Ulog::parse; the IMU or the
/// GNSS is missing.
Result<NavigationLog> read_ulog_sensors(const std::filesystem::path& file,
                                        SensorNeed need = SensorNeed::imu_and_gnss);

}  // namespace pade::live

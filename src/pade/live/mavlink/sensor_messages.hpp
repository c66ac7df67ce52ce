// What an autopilot says of its sensors.
//
// Names, units and order are those of MAVLink's common.xml (and of ardupilotmega.xml from id 11000 on);
// `visit` is the message's one table. Frames on the wire are forward-right-down and north-east-down.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "pade/live/mavlink/layout.hpp"

namespace pade::live::mavlink {

/// The clocks of the autopilot.
struct SystemTime {
  static constexpr std::uint32_t kId = 2;
  static constexpr std::string_view kName = "SYSTEM_TIME";
  std::uint64_t time_unix_usec = 0;  ///< µs; 0 if it does not know
  std::uint32_t time_boot_ms = 0;    ///< ms

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_unix_usec", self.time_unix_usec);
    field("time_boot_ms", self.time_boot_ms);
  }
};

/// What the receiver says: no filter of the autopilot is in it.
struct GpsRawInt {
  static constexpr std::uint32_t kId = 24;
  static constexpr std::string_view kName = "GPS_RAW_INT";
  std::uint64_t time_usec = 0;  ///< µs since boot or 1970
  std::uint8_t fix_type = 0;    ///< 3 and more: three dimensions
  std::int32_t lat = 0;         ///< 1e-7 degrees
  std::int32_t lon = 0;         ///< 1e-7 degrees
  std::int32_t alt = 0;         ///< above sea level, mm
  std::uint16_t eph = 0;        ///< dilution of precision, 0.01; 65535: unknown
  std::uint16_t epv = 0;        ///< the same, vertical
  std::uint16_t vel = 0;        ///< over ground, cm/s; 65535: unknown
  std::uint16_t cog = 0;        ///< course from north clockwise, 0.01 degrees; 65535: unknown
  std::uint8_t satellites_visible = 0;
  std::int32_t alt_ellipsoid = 0;  ///< mm
  std::uint32_t h_acc = 0;         ///< mm; 0: not stated
  std::uint32_t v_acc = 0;         ///< mm; 0: not stated
  std::uint32_t vel_acc = 0;       ///< mm/s; 0: not stated
  std::uint32_t hdg_acc = 0;       ///< 1e-5 degrees
  std::uint16_t yaw = 0;           ///< from north, 0.01 degrees; 0: not stated

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_usec", self.time_usec);
    field("fix_type", self.fix_type);
    field("lat", self.lat);
    field("lon", self.lon);
    field("alt", self.alt);
    field("eph", self.eph);
    field("epv", self.epv);
    field("vel", self.vel);
    field("cog", self.cog);
    field("satellites_visible", self.satellites_visible);
    field("alt_ellipsoid", self.alt_ellipsoid, kExtension);
    field("h_acc", self.h_acc, kExtension);
    field("v_acc", self.v_acc, kExtension);
    field("vel_acc", self.vel_acc, kExtension);
    field("hdg_acc", self.hdg_acc, kExtension);
    field("yaw", self.yaw, kExtension);
  }
};

/// The first IMU.
struct ScaledImu {
  static constexpr std::uint32_t kId = 26;
  static constexpr std::string_view kName = "SCALED_IMU";
  std::uint32_t time_boot_ms = 0;  ///< ms
  std::int16_t xacc = 0;           ///< milli-g
  std::int16_t yacc = 0;
  std::int16_t zacc = 0;
  std::int16_t xgyro = 0;  ///< mrad/s
  std::int16_t ygyro = 0;
  std::int16_t zgyro = 0;
  std::int16_t xmag = 0;  ///< milligauss
  std::int16_t ymag = 0;
  std::int16_t zmag = 0;
  std::int16_t temperature = 0;  ///< 0.01 °C

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_boot_ms", self.time_boot_ms);
    field("xacc", self.xacc);
    field("yacc", self.yacc);
    field("zacc", self.zacc);
    field("xgyro", self.xgyro);
    field("ygyro", self.ygyro);
    field("zgyro", self.zgyro);
    field("xmag", self.xmag);
    field("ymag", self.ymag);
    field("zmag", self.zmag);
    field("temperature", self.temperature, kExtension);
  }
};

/// The first IMU; ArduPilot has the units of SCALED_IMU in it, others have none.
struct RawImu {
  static constexpr std::uint32_t kId = 27;
  static constexpr std::string_view kName = "RAW_IMU";
  std::uint64_t time_usec = 0;  ///< µs since boot or 1970
  std::int16_t xacc = 0;
  std::int16_t yacc = 0;
  std::int16_t zacc = 0;
  std::int16_t xgyro = 0;
  std::int16_t ygyro = 0;
  std::int16_t zgyro = 0;
  std::int16_t xmag = 0;
  std::int16_t ymag = 0;
  std::int16_t zmag = 0;
  std::uint8_t id = 0;
  std::int16_t temperature = 0;  ///< 0.01 °C

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_usec", self.time_usec);
    field("xacc", self.xacc);
    field("yacc", self.yacc);
    field("zacc", self.zacc);
    field("xgyro", self.xgyro);
    field("ygyro", self.ygyro);
    field("zgyro", self.zgyro);
    field("xmag", self.xmag);
    field("ymag", self.ymag);
    field("zmag", self.zmag);
    field("id", self.id, kExtension);
    field("temperature", self.temperature, kExtension);
  }
};

/// The first barometer.
struct ScaledPressure {
  static constexpr std::uint32_t kId = 29;
  static constexpr std::string_view kName = "SCALED_PRESSURE";
  std::uint32_t time_boot_ms = 0;           ///< ms
  float press_abs = 0;                      ///< hPa
  float press_diff = 0;                     ///< hPa
  std::int16_t temperature = 0;             ///< 0.01 °C
  std::int16_t temperature_press_diff = 0;  ///< 0.01 °C

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_boot_ms", self.time_boot_ms);
    field("press_abs", self.press_abs);
    field("press_diff", self.press_diff);
    field("temperature", self.temperature);
    field("temperature_press_diff", self.temperature_press_diff, kExtension);
  }
};

/// IMU, magnetometer and barometer, as PX4 sends them.
struct HighresImu {
  static constexpr std::uint32_t kId = 105;
  static constexpr std::string_view kName = "HIGHRES_IMU";
  std::uint64_t time_usec = 0;  ///< µs since boot or 1970
  float xacc = 0;               ///< m/s²
  float yacc = 0;
  float zacc = 0;
  float xgyro = 0;  ///< rad/s
  float ygyro = 0;
  float zgyro = 0;
  float xmag = 0;  ///< gauss
  float ymag = 0;
  float zmag = 0;
  float abs_pressure = 0;            ///< hPa
  float diff_pressure = 0;           ///< hPa
  float pressure_alt = 0;            ///< m
  float temperature = 0;             ///< °C
  std::uint16_t fields_updated = 0;  ///< bits 0 to 8: acceleration, gyroscope, magnetometer; 9: pressure
  std::uint8_t id = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_usec", self.time_usec);
    field("xacc", self.xacc);
    field("yacc", self.yacc);
    field("zacc", self.zacc);
    field("xgyro", self.xgyro);
    field("ygyro", self.ygyro);
    field("zgyro", self.zgyro);
    field("xmag", self.xmag);
    field("ymag", self.ymag);
    field("zmag", self.zmag);
    field("abs_pressure", self.abs_pressure);
    field("diff_pressure", self.diff_pressure);
    field("pressure_alt", self.pressure_alt);
    field("temperature", self.temperature);
    field("fields_updated", self.fields_updated);
    field("id", self.id, kExtension);
  }
};

/// The autopilot has told the camera to expose.
struct CameraTrigger {
  static constexpr std::uint32_t kId = 112;
  static constexpr std::string_view kName = "CAMERA_TRIGGER";
  std::uint64_t time_usec = 0;  ///< µs
  std::uint32_t seq = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_usec", self.time_usec);
    field("seq", self.seq);
  }
};

/// A picture was taken.
struct CameraImageCaptured {
  static constexpr std::uint32_t kId = 263;
  static constexpr std::string_view kName = "CAMERA_IMAGE_CAPTURED";
  std::uint32_t time_boot_ms = 0;  ///< ms
  std::uint64_t time_utc = 0;      ///< µs
  std::uint8_t camera_id = 0;
  std::int32_t lat = 0;           ///< 1e-7 degrees
  std::int32_t lon = 0;           ///< 1e-7 degrees
  std::int32_t alt = 0;           ///< mm
  std::int32_t relative_alt = 0;  ///< mm
  std::array<float, 4> q{};       ///< w x y z
  std::int32_t image_index = 0;
  std::int8_t capture_result = 0;
  std::array<char, 205> file_url{};

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_boot_ms", self.time_boot_ms);
    field("time_utc", self.time_utc);
    field("camera_id", self.camera_id);
    field("lat", self.lat);
    field("lon", self.lon);
    field("alt", self.alt);
    field("relative_alt", self.relative_alt);
    field("q", self.q);
    field("image_index", self.image_index);
    field("capture_result", self.capture_result);
    field("file_url", self.file_url);
  }
};
}  // namespace pade::live::mavlink

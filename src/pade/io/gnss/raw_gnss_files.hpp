// Recordings of raw GNSS: RINEX 3 observations and navigation messages, u-blox's UBX, and libRSF's ranges
// with known places of the satellites. What is unusable is left out and named in the remarks of the log; a
// file that is unusable as a whole is refused.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "pade/core/result.hpp"
#include "pade/core/sensors/raw_gnss.hpp"

namespace pade::io {

/// What a file of raw GNSS holds, by its first line; of UBX by a message of raw measurements near its start.
enum class RawGnssKind { observations, navigation, known_ranges, ubx };

/// Bytes of a file that tell its kind.
constexpr std::size_t kRawGnssStart = 65536;

/// Empty if the text, of which no more than kRawGnssStart bytes are looked at, is nothing of the kind.
std::optional<RawGnssKind> raw_gnss_kind(std::string_view text);

/// Appends the epochs of a RINEX observation file (3.00 to 3.05). Satellites of other systems than ours are
/// passed over; BeiDou's 1I, 1Q and (before 3.04) 1X are called 2I, 2Q and 2X. Left out, with a remark:
/// epochs that are cut off, repeat a time, or go back, or lie ahead of more epochs behind them; satellites
/// whose line cannot be read; all behind a second header of another version. Errors: no header or one of
/// another version or type, no observation types, a time system that is not known, no epoch. `name` stands in
/// messages.
Status parse_rinex_observations(std::string_view text, std::string_view name, gnss::RawLog& log);

/// Appends the ephemerides of a RINEX navigation file (3.00 to 3.05) of one system or mixed. Left out, with a
/// remark: records that are cut off or have values that no orbit has. Blanks cut off at a line's end are no
/// fault, and a file without a record of our systems is a remark. Errors: no header or one of another
/// version or type, records none of which is usable.
Status parse_rinex_navigation(std::string_view text, std::string_view name, gnss::RawLog& log);

/// Appends `pseudorange3` lines as known ranges, `odom3` lines as odometry and `point3` lines as true
/// positions; other lines are passed over. Times count from the recording's zero. Errors: none of these, or
/// more than half of them bad.
Status parse_known_ranges(std::string_view text, std::string_view name, gnss::RawLog& log);

/// Appends the epochs (RXM-RAWX) of a UBX log, and what GPS satellites sent (RXM-SFRBX); the messages of
/// other systems are not decoded, which a remark says. Left out, with a remark: messages with a wrong
/// checksum, that are cut off or not as long as they say, epochs that repeat a time or go back, or lie ahead
/// of more epochs behind them. A phase has lost lock where its lock time is shorter than before, or than the
/// time since. Other messages and text before and between them are passed over. Errors: no epoch.
Status parse_ubx(std::string_view bytes, std::string_view name, gnss::RawLog& log);

/// Reads a folder, or the folder of a file: with a file its observations (or known ranges) alone, with a
/// folder all that there are; in both cases all navigation files, and files of known positions, beside them.
/// A navigation file that cannot be used is a remark, as is that no model of the ionosphere was found.
/// Errors: no observations; observations without any ephemeris.
Result<gnss::RawLog> read_raw_gnss(const std::filesystem::path& path);

/// GPS time less UTC at a time given in either, s: 0 in 1980 to 18 since 2017.
int leap_seconds(Time time);

/// Nanoseconds of GPS time from a date. Empty if it is no date between 1980 and 2099, or a time of day beyond
/// 24 h (60 s are allowed, for leap seconds).
std::optional<Time> time_of_date(int year, int month, int day, int hour, int minute, double second);

}  // namespace pade::io

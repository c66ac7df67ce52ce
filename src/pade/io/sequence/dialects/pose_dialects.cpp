#include "pade/io/sequence/dialects/pose_dialects.hpp"

#include <algorithm>
#include <optional>

#include <Eigen/LU>
#include <fmt/format.h>

#include "pade/io/sequence/dialects/pose_columns.hpp"
#include "pade/io/sequence/layouts/sequence_layout.hpp"
#include "pade/io/stamps.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

/// A stamp that only nanoseconds can be: 16 digits and more without a point.
bool is_nanoseconds(std::string_view stamp) {
  return stamp.size() >= 16 &&
         std::all_of(stamp.begin(), stamp.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// The columns of rows without a heading, from one of them.
PoseColumns counted_columns(std::string_view line) {
  const Fields fields = pose_fields(line);
  if (fields.size() == 7) return {{}, {}, {}, {}, {0, 1, 2}, {3, 4, 5, 6}, 7};
  const bool euroc = is_nanoseconds(fields[0]) && line.find(',') != std::string_view::npos;
  PoseColumns columns = PoseColumns::tum();
  if (euroc) columns.xyzw = {5, 6, 7, 4};
  return columns;
}

TimeUnit unit_of_poses(std::span<const std::string_view> stamps, const std::string& file,
                       ReadReport& report) {
  const TimeUnit unit = unit_of_frames(stamps);
  if (unit != TimeUnit::seconds) {
    report.notes.push_back(fmt::format("{}: the stamps look like {} and are read so", file, name_of(unit)));
  }
  return unit;
}

std::optional<std::vector<double>> numbers_of(const Fields& fields) {
  std::vector<double> numbers;
  for (const std::string_view field : fields) {
    const auto number = parse_number(field);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

/// The rotation of a row whose 3x4 matrix begins at `first`; empty if it is none.
std::optional<Eigen::Matrix3d> rotation_at(const std::vector<double>& v, std::size_t first) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> T(v.data() + first);
  const Eigen::Matrix3d R = T.leftCols<3>();
  constexpr double kTolerance = 1e-3;
  if (!((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kTolerance) ||
      !(R.determinant() > 0)) {
    return std::nullopt;
  }
  return R;
}

/// Whether most rows are 3x4 or 4x4 matrices, after a time if there is one more number. Others may have as
/// many columns: EuRoC's states have 17.
bool are_matrices(const std::vector<Line>& lines, std::size_t fields) {
  if (fields != 12 && fields != 13 && fields != 16 && fields != 17) return false;
  constexpr std::size_t kMost = 50;
  const std::size_t step = lines.size() / kMost + 1;
  std::size_t tried = 0, matrices = 0;
  for (std::size_t row = 0; row < lines.size(); row += step, ++tried) {
    const auto v = numbers_of(pose_fields(lines[row].text));
    matrices += v && v->size() == fields && rotation_at(*v, fields % 4) ? 1 : 0;
  }
  return 2 * matrices > tried;
}

/// Rows of 12 or 16 numbers, one per image, or with a time before them.
Result<Trajectory> parse_matrices(const std::vector<Line>& lines, const std::string& file,
                                  std::span<const Time> images, std::size_t count, ReadReport& report) {
  TrajectoryBuilder builder(file);
  const bool timed = count % 4 == 1;
  std::vector<std::string_view> stamps;
  for (const Line& line : lines) stamps.push_back(pose_fields(line.text).front());
  const TimeUnit unit = timed ? unit_of_poses(stamps, file, report) : TimeUnit::seconds;
  for (std::size_t row = 0; row < lines.size(); ++row) {
    const auto v = numbers_of(pose_fields(lines[row].text));
    if (!timed && row >= images.size()) {
      builder.skip(lines[row].number, fmt::format("row {} has no image ({} images)", row, images.size()));
      continue;
    }
    if (!v || v->size() != count) {
      builder.skip(lines[row].number,
                   fmt::format("found {}, expected {} finite numbers", in_quotes(lines[row].text), count));
      continue;
    }
    const auto time = timed ? parse_stamp(stamps[row], unit) : images[row];
    const auto R = rotation_at(*v, timed ? 1 : 0);
    if (!R || !time) {
      builder.skip(lines[row].number, R ? "its time cannot be read" : "the matrix is no rotation");
      continue;
    }
    const std::size_t first = timed ? 1 : 0;
    builder.add(lines[row].number, *time, {(*v)[first + 3], (*v)[first + 7], (*v)[first + 11]},
                Eigen::Quaterniond(*R).normalized().coeffs());
  }
  return builder.finish(report);
}

/// The time of a row by its columns.
std::optional<Time> time_of(const Fields& fields, const PoseColumns& columns, TimeUnit unit) {
  auto time = parse_stamp(fields[*columns.time], unit);
  if (!columns.nanoseconds || !time) return time;
  const auto rest = parse_stamp(fields[*columns.nanoseconds], TimeUnit::nanoseconds);
  if (!rest || rest->nanoseconds < 0 || rest->nanoseconds > 1'000'000'000) return std::nullopt;
  return Time{time->nanoseconds + rest->nanoseconds};
}

/// Takes the times of recording where the headers have no stamps, and says which are taken.
void choose_times(const std::vector<Line>& lines, const std::string& file, PoseColumns& columns,
                  ReadReport& report) {
  if (!columns.recorded) return;
  const bool stamped = std::any_of(lines.begin(), lines.end(), [&](const Line& line) {
    const Fields fields = pose_fields(line.text);
    return *columns.time < fields.size() && parse_number(fields[*columns.time]).value_or(0) != 0;
  });
  if (stamped) {
    report.notes.push_back(
        fmt::format("{}: the times are those of the headers (header.stamp), not those of recording", file));
    return;
  }
  columns.time = columns.recorded;
  columns.nanoseconds.reset();
  columns.unit.reset();
  report.notes.push_back(
      fmt::format("{}: the headers have no stamps: the times of recording are taken", file));
}

Result<Trajectory> parse_columns(const std::vector<Line>& lines, const std::string& file, PoseColumns columns,
                                 std::span<const Time> images, ReadReport& report) {
  choose_times(lines, file, columns, report);
  std::vector<std::string_view> stamps;
  for (const Line& line : lines) {
    const Fields fields = pose_fields(line.text);
    if (columns.time && *columns.time < fields.size()) stamps.push_back(fields[*columns.time]);
  }
  const TimeUnit unit = columns.nanoseconds ? TimeUnit::seconds
                        : columns.unit      ? *columns.unit
                                            : unit_of_poses(stamps, file, report);
  TrajectoryBuilder builder(file);
  std::size_t wider = 0;
  for (std::size_t row = 0; row < lines.size(); ++row) {
    const Fields fields = pose_fields(lines[row].text);
    if (fields.size() < columns.least) {
      builder.skip(lines[row].number,
                   fmt::format("found {} fields, expected {}{}", fields.size(), columns.least,
                               columns.least == 8 ? " (time tx ty tz qx qy qz qw)" : ""));
      continue;
    }
    if (fields.size() > columns.least) ++wider;
    std::optional<Time> time;
    if (columns.time) {
      time = time_of(fields, columns, unit);
      if (!time) {
        builder.skip(lines[row].number, fmt::format("found time {}, expected {}",
                                                    in_quotes(fields[*columns.time]), name_of(unit)));
        continue;
      }
    } else if (row < images.size()) {
      time = images[row];
    } else {
      builder.skip(lines[row].number, fmt::format("row {} has no image ({} images)", row, images.size()));
      continue;
    }
    Eigen::Matrix<double, 7, 1> values;
    std::string_view bad;
    for (std::size_t i = 0; i < 7; ++i) {
      const std::string_view field = fields[i < 3 ? columns.position[i] : columns.xyzw[i - 3]];
      const auto number = parse_number(field);
      if (!number && bad.empty()) bad = field.empty() ? "nothing" : field;
      values[static_cast<Eigen::Index>(i)] = number.value_or(0);
    }
    if (!bad.empty()) {
      builder.skip(lines[row].number, fmt::format("found {}, expected a number", in_quotes(bad)));
      continue;
    }
    builder.add(lines[row].number, *time, values.head<3>(), values.tail<4>());
  }
  if (wider > 0) {
    report.notes.push_back(fmt::format("{}: {} rows have more than {} columns; the others are left out", file,
                                       wider, columns.least));
  }
  return builder.finish(report);
}

/// Decimal commas, which stand between digits where semicolons or tabs separate the fields, as points.
std::string with_decimal_points(std::string_view text) {
  std::string out(text);
  for (std::size_t begin = 0; begin < out.size();) {
    const std::size_t end = std::min(out.find('\n', begin), out.size());
    const auto line = std::string_view(out).substr(begin, end - begin);
    const bool separated =
        line.find(';') != std::string_view::npos || line.find('\t') != std::string_view::npos;
    for (std::size_t i = begin + 1; separated && i + 1 < end; ++i) {
      const auto digit = [&](std::size_t k) { return out[k] >= '0' && out[k] <= '9'; };
      if (out[i] == ',' && digit(i - 1) && digit(i + 1)) out[i] = '.';
    }
    begin = end + 1;
  }
  return out;
}

}  // namespace

Result<Trajectory> parse_any_poses(std::string_view original, const std::string& file,
                                   std::span<const Time> images, ReadReport& report) {
  const std::string text = with_decimal_points(original);
  std::vector<Line> lines = data_lines(text);
  if (!lines.empty() && (lines.front().text.front() == '"' || is_word(lines.front().text))) {
    lines.erase(lines.begin());  // the heading
  }
  if (lines.empty()) return TrajectoryBuilder(file).finish(report);
  // A row in the middle tells best: the first may be broken.
  const std::string_view sample = lines[lines.size() / 2].text;
  const std::size_t count = pose_fields(sample).size();
  auto named = named_columns(text, count, file);
  if (!named) return named.error();
  const bool fits = *named && count >= (*named)->least;
  if (fits) return parse_columns(lines, file, **named, images, report);
  const bool rows_of_four = std::all_of(lines.begin(), lines.end(),
                                        [](const Line& line) { return pose_fields(line.text).size() == 4; });
  if (rows_of_four && lines.size() % 4 == 0) {
    return Error{
        fmt::format("{}: found rows of 4 numbers, as of a 4x4 matrix over four lines, expected one row of 12 "
                    "or 16 numbers for "
                    "each pose",
                    file)};
  }
  if (are_matrices(lines, count) || count == 12 || count == 16)
    return parse_matrices(lines, file, images, count, report);
  return parse_columns(lines, file, counted_columns(sample), images, report);
}

Result<Trajectory> read_any_poses(const std::filesystem::path& file, std::span<const Time> images,
                                  ReadReport& report) {
  const auto text = read_file(file);
  if (!text) return text.error();
  return parse_any_poses(*text, file.string(), images, report);
}

}  // namespace pade::io

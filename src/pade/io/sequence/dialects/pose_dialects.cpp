#include "pade/io/sequence/dialects/pose_dialects.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>

#include <Eigen/LU>
#include <fmt/format.h>

#include "pade/io/sequence/layouts/sequence_layout.hpp"
#include "pade/io/stamps.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

using Fields = std::vector<std::string_view>;

/// Where a row has its values. Without a time the row number counts.
struct Columns {
  std::optional<std::size_t> time;
  std::array<std::size_t, 3> position{};
  std::array<std::size_t, 4> xyzw{};
  std::size_t least = 0;  ///< fields of a row
};

std::string plain(std::string_view name) {
  std::string out;
  for (const char c : name.substr(0, name.find('['))) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return out;
}

Fields split_any(std::string_view line) {
  if (line.find(';') == std::string_view::npos) return split_fields(line);
  Fields fields;
  while (true) {
    const std::size_t end = line.find(';');
    const auto part = split_fields(line.substr(0, end));
    fields.push_back(part.empty() ? std::string_view() : part.front());
    if (end == std::string_view::npos) return fields;
    line.remove_prefix(end + 1);
  }
}

std::optional<std::size_t> column_of(const std::vector<std::string>& names,
                                     std::initializer_list<std::string_view> wanted) {
  for (const std::string_view one : wanted) {
    const auto found = std::find(names.begin(), names.end(), one);
    if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  }
  return std::nullopt;
}

/// The columns that a heading names; empty where it names no pose.
std::optional<Columns> columns_named(std::string_view heading) {
  while (!heading.empty() && (heading.front() == '#' || heading.front() == ' ' || heading.front() == '%')) {
    heading.remove_prefix(1);
  }
  std::vector<std::string> names;
  const bool commas = heading.find(',') != std::string_view::npos;
  while (commas && !heading.empty()) {
    const std::size_t end = std::min(heading.find(','), heading.size());
    names.push_back(plain(heading.substr(0, end)));
    heading.remove_prefix(std::min(end + 1, heading.size()));
  }
  if (!commas) {
    for (const std::string_view field : split_any(heading)) names.push_back(plain(field));
  }
  Columns columns;
  columns.time = column_of(names, {"timestamp", "time", "ts", "times", "t", "stamp", "timestampns"});
  const std::array position = {column_of(names, {"tx", "x", "px", "prsrx", "positionx", "posx"}),
                               column_of(names, {"ty", "y", "py", "prsry", "positiony", "posy"}),
                               column_of(names, {"tz", "z", "pz", "prsrz", "positionz", "posz"})};
  const std::array xyzw = {column_of(names, {"qx", "qrsx", "orientationx", "rotx"}),
                           column_of(names, {"qy", "qrsy", "orientationy", "roty"}),
                           column_of(names, {"qz", "qrsz", "orientationz", "rotz"}),
                           column_of(names, {"qw", "qrsw", "orientationw", "rotw"})};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!position[i]) return std::nullopt;
    columns.position[i] = *position[i];
  }
  for (std::size_t i = 0; i < 4; ++i) {
    if (!xyzw[i]) return std::nullopt;
    columns.xyzw[i] = *xyzw[i];
  }
  columns.least = names.size();
  return columns;
}

/// A stamp that only nanoseconds can be: 16 digits and more without a point.
bool is_nanoseconds(std::string_view stamp) {
  return stamp.size() >= 16 &&
         std::all_of(stamp.begin(), stamp.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// The columns of rows without a heading, from the first of them.
std::optional<Columns> columns_counted(std::string_view line) {
  const Fields fields = split_any(line);
  if (fields.size() == 7) return Columns{{}, {0, 1, 2}, {3, 4, 5, 6}, 7};
  if (fields.size() < 8 || fields.size() == 12 || fields.size() == 16) return std::nullopt;
  const bool euroc = is_nanoseconds(fields[0]) && line.find(',') != std::string_view::npos;
  if (euroc) return Columns{0, {1, 2, 3}, {5, 6, 7, 4}, 8};
  return Columns{0, {1, 2, 3}, {4, 5, 6, 7}, 8};
}

/// The heading of the file: the last line before the data that names columns.
std::optional<Columns> heading_of(std::string_view text) {
  std::optional<Columns> columns;
  for (int lines = 0; lines < 50 && !text.empty(); ++lines) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos) continue;
    line.remove_prefix(first);
    const bool named = line.front() == '#' || line.front() == '%' ||
                       std::isalpha(static_cast<unsigned char>(line.front())) != 0;
    if (!named) return columns;
    if (auto found = columns_named(line)) columns = found;
  }
  return columns;
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

/// Rows of 12 or 16 numbers, one per image.
Result<Trajectory> parse_matrices(const std::vector<Line>& lines, const std::string& file,
                                  std::span<const Time> images, ReadReport& report) {
  TrajectoryBuilder builder(file);
  for (std::size_t row = 0; row < lines.size(); ++row) {
    const auto v = numbers_of(split_any(lines[row].text));
    if (row >= images.size()) {
      builder.skip(lines[row].number, fmt::format("row {} has no image ({} images)", row, images.size()));
      continue;
    }
    if (!v || (v->size() != 12 && v->size() != 16)) {
      builder.skip(lines[row].number,
                   fmt::format("found {}, expected 12 or 16 finite numbers", in_quotes(lines[row].text)));
      continue;
    }
    const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> T(v->data());
    const Eigen::Matrix3d R = T.leftCols<3>();
    constexpr double kTolerance = 1e-3;
    if (!((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kTolerance) ||
        !(R.determinant() > 0)) {
      builder.skip(lines[row].number, "the matrix is no rotation");
      continue;
    }
    builder.add(lines[row].number, images[row], T.col(3), Eigen::Quaterniond(R).normalized().coeffs());
  }
  return builder.finish(report);
}

Result<Trajectory> parse_columns(const std::vector<Line>& lines, const std::string& file,
                                 const Columns& columns, std::span<const Time> images, ReadReport& report) {
  std::vector<std::string_view> stamps;
  for (const Line& line : lines) {
    const Fields fields = split_any(line.text);
    if (columns.time && *columns.time < fields.size()) stamps.push_back(fields[*columns.time]);
  }
  const TimeUnit unit = unit_of_frames(stamps);
  if (unit != TimeUnit::seconds) {
    report.notes.push_back(fmt::format("{}: the stamps look like {} and are read so", file, name_of(unit)));
  }
  TrajectoryBuilder builder(file);
  std::size_t wider = 0;
  for (std::size_t row = 0; row < lines.size(); ++row) {
    const Fields fields = split_any(lines[row].text);
    if (fields.size() < columns.least) {
      builder.skip(lines[row].number,
                   fmt::format("found {} fields, expected {}{}", fields.size(), columns.least,
                               columns.least == 8 ? " (time tx ty tz qx qy qz qw)" : ""));
      continue;
    }
    if (fields.size() > columns.least) ++wider;
    std::optional<Time> time;
    if (columns.time) {
      time = parse_stamp(fields[*columns.time], unit);
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

}  // namespace

Result<Trajectory> parse_any_poses(std::string_view text, const std::string& file,
                                   std::span<const Time> images, ReadReport& report) {
  const auto heading = heading_of(text);
  std::vector<Line> lines = data_lines(text);
  std::erase_if(lines, [](const Line& line) {
    return std::isalpha(static_cast<unsigned char>(line.text.front())) != 0 &&
           line.text.substr(0, 3) != "nan";
  });
  if (lines.empty()) return TrajectoryBuilder(file).finish(report);
  // A row in the middle tells best: the first may be broken.
  const std::string_view sample = lines[lines.size() / 2].text;
  const std::size_t count = split_any(sample).size();
  if (!heading && (count == 12 || count == 16)) return parse_matrices(lines, file, images, report);
  const bool fits = heading && count >= heading->least;
  return parse_columns(
      lines, file, fits ? *heading : columns_counted(sample).value_or(Columns{0, {1, 2, 3}, {4, 5, 6, 7}, 8}),
      images, report);
}

Result<Trajectory> read_any_poses(const std::filesystem::path& file, std::span<const Time> images,
                                  ReadReport& report) {
  const auto text = read_file(file);
  if (!text) return text.error();
  return parse_any_poses(*text, file.string(), images, report);
}

}  // namespace pade::io

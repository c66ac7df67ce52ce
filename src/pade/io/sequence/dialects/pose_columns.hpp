// Which columns of a pose file hold what, by its heading or by counting them.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/io/stamps.hpp"
#include "pade/io/text.hpp"

namespace pade::io {

using Fields = std::vector<std::string_view>;

/// Where a row has its values. Without a time the row number counts.
struct PoseColumns {
  std::optional<std::size_t> time;
  std::optional<std::size_t> nanoseconds;  ///< beside a time in whole seconds
  std::optional<TimeUnit> unit;            ///< if the heading states it
  std::optional<std::size_t> recorded;     ///< beside a header's stamp: when the message was recorded
  std::array<std::size_t, 3> position{};
  std::array<std::size_t, 4> xyzw{};
  std::size_t least = 0;  ///< fields of a row

  /// time x y z qx qy qz qw
  static PoseColumns tum() { return {0, {}, {}, {}, {1, 2, 3}, {4, 5, 6, 7}, 8}; }
};

/// The fields of a row: between semicolons if it has any, else as split_fields; one that is empty at the end
/// of the row is none.
Fields pose_fields(std::string_view line);

/// Whether the text begins like a name and not like a number (which "nan" and "inf" do).
bool is_word(std::string_view text);

/// The columns that the heading names: of the lines before the data the last that names a pose, else a plain
/// line of words. Empty if there is none. Refused if it names columns, but no pose that is understood: they
/// would be read in another order than it says.
/// @param fields  of a row of data
Result<std::optional<PoseColumns>> named_columns(std::string_view text, std::size_t fields,
                                                 const std::string& file);

}  // namespace pade::io

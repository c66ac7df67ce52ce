// Which epochs of a recording stay where their times do not rise.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/sensors/raw_gnss.hpp"
#include "pade/io/gnss/rinex_text.hpp"

namespace pade::io {

/// Takes the epochs of one file in its order. One that is not later than those before is left out, unless
/// those behind it tell that the others are wrong: a receiver that does not know the date yet may stamp its
/// first epochs years ahead, and these are left out once more epochs (five at least) rise behind them.
class EpochOrder {
 public:
  /// @param log   where the epochs go, behind those that it has
  /// @param unit  what a place is: "line" or "byte"
  EpochOrder(std::string_view name, std::string_view unit, gnss::RawLog& log)
      : name_(name), unit_(unit), log_(log), first_(log.epochs.size()) {}

  /// @param place  in the file
  void add(gnss::Epoch epoch, std::size_t place);
  /// Behind the last epoch: appends remarks on what was left out.
  void finish();

  /// Place of each epoch of this file that is in the log.
  [[nodiscard]] const std::vector<std::size_t>& places() const { return places_; }

 private:
  struct Placed {
    gnss::Epoch epoch;
    std::size_t place;
  };
  void leave_out_waiting();
  [[nodiscard]] std::string at(std::size_t place) const;

  std::string_view name_;
  std::string_view unit_;
  gnss::RawLog& log_;
  std::size_t first_;  ///< of the log's epochs, that is of this file
  std::vector<std::size_t> places_;
  std::vector<Placed> waiting_;  ///< rising, and earlier than the last of the log
  rinex::Tally repeated_, backward_, ahead_;
};

}  // namespace pade::io

// The map on disk while the session goes on, so that a power cut or a crash costs seconds of it and not the
// flight.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <Eigen/Core>

#include "pade/core/result.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/live/interfaces.hpp"
#include "pade/mapping/occupancy_map.hpp"
#include "pade/mapping/query/map_view.hpp"

namespace pade::live {

/// What was saved so far, and what could not be.
struct SaverReport {
  std::size_t saved = 0;              ///< times that a map was written
  std::size_t failed = 0;             ///< times that it could not be
  std::string error;                  ///< of the last failure
  std::vector<std::string> finished;  ///< files of maps that ended because another was begun
  std::string earlier;                ///< where the map of an earlier session went; empty: there was none
  bool any = false;                   ///< finish(): something is known of the map as it is
};

/// Writes the newest view of the map now and then, on the disk itself, in a thread of its own that leaves the
/// processor to others: whoever offers one never waits. Its options and its origin lie beside it (map.json,
/// see io::encode_side_car). A file is replaced as a whole or not at all, and only by the map that it already
/// holds: those of earlier sessions and of before a jump of the poses stay, under the first free number
/// (map-1.bt, map-2.bt, ...), with what lay beside them.
class MapSaver : public Sink {
  using View = std::shared_ptr<const mapping::MapView>;

 public:
  /// @param file     .bt or .ot
  /// @param every    s between the end of one and the start of the next, and at least ten times the processor
  ///                 time that the last one took; 0: only maps that end because the poses jump
  /// @param options  of the map
  MapSaver(std::filesystem::path file, double every, const mapping::MapOptions& options = {});
  ~MapSaver() override;
  /// Ends what is being written and maps that have ended, then the thread. The newest view is left to whoever
  /// saves the map at the end: by write_last().
  SaverReport finish();
  /// Writes the map as it is at the end, after finish(). Errors: it cannot be written, or the map of an
  /// earlier session cannot be moved out of its way.
  Status write_last(const mapping::OccupancyMap& map);

  /// Views in which nothing is known are none.
  void take(const LiveUpdate& update) override;
  void forget(const View& view, const mapping::MapChange& change) override;
  /// The map so far goes to a file of its own.
  void begin_anew() override;
  [[nodiscard]] SaverReport report() const;

 private:
  /// A map at one moment.
  struct Picture {
    View view;
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // LiveUpdate::origin
  };
  void keep(const View& view);
  void work();
  void save(const Picture& picture, bool is_finished);
  Status write(const std::filesystem::path& file, const io::ByteSource& map, const Eigen::Vector3d& origin);
  [[nodiscard]] std::filesystem::path free_name() const;
  Status keep_earlier();
  void remove_own() const;

  std::filesystem::path file_;
  double every_;
  mapping::MapOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // of the map as it is
  View newest_;                                       // since the last save
  View last_;                                         // of the map as it is
  std::vector<Picture> ended_;                        // maps that ended, to be saved
  bool kept_earlier_ = false;
  bool over_ = false;
  SaverReport report_;
  std::thread thread_;  // last: it uses all the others
};

}  // namespace pade::live

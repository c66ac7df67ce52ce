// Which way the goal is, around what is known: the length of the shortest way from each place of the window.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "pade/planning/local_window.hpp"

namespace pade::planning {

/// Whether a place counts as the goal: horizontally nearer than `arrival` (m), and in height nearer than that
/// or 0.5 m.
bool is_at(const Eigen::Vector3d& goal, const Eigen::Vector3d& place, double arrival);

/// Space that stays unseen from wherever it is looked at, such as that behind a wall without texture: all
/// heights within `radius` (m) of `centre` (world, m).
struct HiddenSpace {
  Eigen::Vector3d centre;
  double radius;
};

/// Shortest ways (Dijkstra's, over cells of 0.2 m x 0.2 m x 0.4 m) from the window about the vehicle to the
/// goal. What has not been seen may be flown through at a price; beyond the window the way is straight.
class LocalGuide {
 public:
  /// Heights that may be flown at, m.
  struct Heights {
    double lowest;
    double highest;
  };
  /// Lengths of ways to `goal` (world, m) from all cells of the window. Where something stands at the goal,
  /// of the ways to the places nearest to it; where no way leads from there to the middle of the window, of
  /// those out of the window.
  /// @param arrival  horizontally as near to the goal is there, m
  /// @param hidden   where what has not been seen has a much higher price
  void set(const LocalWindow& window, const Eigen::Vector3d& goal, const Heights& heights, double arrival = 0,
           std::span<const HiddenSpace> hidden = {});

  /// Length of the way from a point, m, unseen parts counted more; infinity where none is known, and beyond
  /// the window.
  [[nodiscard]] double to_go(const Eigen::Vector3d& point) const;

 private:
  using Index = std::uint32_t;
  void lay_out(const LocalWindow& window, const Heights& heights);
  void price(const LocalWindow& window, std::span<const HiddenSpace> hidden);
  void start_from(const Eigen::Vector3d& goal, double arrival);
  bool start_about(const Eigen::Vector3d& goal, double arrival);
  void start_from_sides(const Eigen::Vector3d& goal);
  void offer(Index cell, std::uint32_t cost);
  void walk();
  [[nodiscard]] bool reaches_the_middle() const;
  [[nodiscard]] double at(int x, int y, int z) const;
  [[nodiscard]] Eigen::Vector3d centre_of(int x, int y, int z) const;

  Eigen::Vector3d corner_ = Eigen::Vector3d::Zero();
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  double least_ = 0;                       // to the goal from the edge, m
  std::vector<std::uint8_t> price_;        // of a cell; 0 = not to be flown through
  std::vector<std::uint32_t> cost_;        // cm above least_
  std::vector<std::vector<Index>> queue_;  // cells by cost, in cm
};

}  // namespace pade::planning

#include "pade/planning/local_guide.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace pade::planning {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
constexpr double kCell = 0.2;        // horizontally, m
constexpr double kLevel = 0.4;       // vertically, m
constexpr double kPerMetre = 100;    // costs count centimetres
constexpr std::uint8_t kSeen = 10;   // prices, in tenths
constexpr std::uint8_t kTight = 13;  // something is near
constexpr std::uint8_t kUnseen = 15;
constexpr std::uint8_t kHidden = 60;
constexpr double kAbout = 3;              // from a goal that is not to be reached, m
constexpr double kHeightOfArrival = 0.5;  // m
constexpr std::uint32_t kNever = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint32_t kFarthest = 4000;  // a way that is longer by 40 m is none

struct Step {
  int x, y, z;
  std::uint32_t length;  // cm
};
constexpr std::array<Step, 10> kSteps = {{{1, 0, 0, 20},
                                          {-1, 0, 0, 20},
                                          {0, 1, 0, 20},
                                          {0, -1, 0, 20},
                                          {1, 1, 0, 28},
                                          {1, -1, 0, 28},
                                          {-1, 1, 0, 28},
                                          {-1, -1, 0, 28},
                                          {0, 0, 1, 60},
                                          {0, 0, -1, 60}}};

}  // namespace

bool is_at(const Vector3d& goal, const Vector3d& place, double arrival) {
  const Vector3d left = goal - place;
  return left.head<2>().norm() < arrival && std::abs(left.z()) < std::max(arrival, kHeightOfArrival);
}

Vector3d LocalGuide::centre_of(int x, int y, int z) const {
  return corner_ + Vector3d((x + 0.5) * kCell, (y + 0.5) * kCell, (z + 0.5) * kLevel);
}

void LocalGuide::lay_out(const LocalWindow& window, const Heights& heights) {
  corner_ = window.corner();
  const Vector3d extent = window.voxel() * window.size().cast<double>();
  const double low = std::max(corner_.z(), heights.lowest);
  const double high = std::min(corner_.z() + extent.z(), heights.highest);
  corner_.z() = low;
  size_ = {static_cast<int>(std::lround(extent.x() / kCell)),
           static_cast<int>(std::lround(extent.y() / kCell)),
           std::max(static_cast<int>((high - low) / kLevel + 1e-9), 1)};
  const auto cells = static_cast<std::size_t>(size_.prod());
  price_.assign(cells, 0);
  cost_.assign(cells, kNever);
  queue_.resize(kFarthest + 1);
  for (auto& bucket : queue_) bucket.clear();
}

void LocalGuide::price(const LocalWindow& window, std::span<const HiddenSpace> hidden) {
  const auto unseen = [&](const Vector3d& at) {
    const bool is_hidden = std::any_of(hidden.begin(), hidden.end(), [&](const HiddenSpace& space) {
      return (at - space.centre).head<2>().norm() < space.radius;
    });
    return is_hidden ? kHidden : kUnseen;
  };
  std::size_t cell = 0;
  for (int z = 0; z < size_.z(); ++z) {
    for (int y = 0; y < size_.y(); ++y) {
      for (int x = 0; x < size_.x(); ++x, ++cell) {
        const Vector3d centre = centre_of(x, y, z);
        if (!window.is_clear(centre)) continue;
        price_[cell] = window.is_free(centre) ? kSeen : unseen(centre);
      }
    }
  }
  // Beside what is not to be flown through there is little room.
  const auto row = static_cast<std::size_t>(size_.x());
  for (cell = row; cell + row < price_.size(); ++cell) {
    if (price_[cell] != kSeen) continue;
    for (const std::size_t other : {cell - 1, cell + 1, cell - row, cell + row}) {
      if (price_[other] == 0) price_[cell] = kTight;
    }
  }
}

void LocalGuide::offer(Index cell, std::uint32_t cost) {
  if (price_[cell] == 0 || cost >= cost_[cell] || cost > kFarthest) return;
  cost_[cell] = cost;
  queue_[cost].push_back(cell);
}

/// The cells that count as the goal; or, where all of them are blocked, those nearest to it. False if none is
/// passable.
bool LocalGuide::start_about(const Vector3d& goal, double arrival) {
  constexpr double kBeyond = 2;   // a metre that will be missing costs so many
  constexpr double kClimb = 1.5;  // and one of height that is still to be climbed, as by kSteps
  const double there = std::max(arrival, kCell);
  bool found = false;
  for (const double within : {there, kAbout}) {
    std::size_t cell = 0;
    for (int z = 0; z < size_.z(); ++z) {
      for (int y = 0; y < size_.y(); ++y) {
        for (int x = 0; x < size_.x(); ++x, ++cell) {
          const Vector3d left = centre_of(x, y, z) - goal;
          const double away = left.head<2>().norm();
          if (away > within || price_[cell] == 0) continue;
          const double climb = kClimb * std::max(std::abs(left.z()) - kHeightOfArrival, 0.0);
          const double cost = away + (kBeyond - 1) * std::max(away - there, 0.0) + climb;
          offer(static_cast<Index>(cell), static_cast<std::uint32_t>(std::lround(cost * kPerMetre)));
          found = true;
        }
      }
    }
    if (found) return true;
  }
  return false;
}

/// The goal, where the window holds it; else all cells of its sides, and of the side above or below that is
/// nearer to it.
void LocalGuide::start_from(const Vector3d& goal, double arrival) {
  const Vector3d at = (goal - corner_).cwiseQuotient(Vector3d(kCell, kCell, kLevel));
  const Vector3i in = at.array().floor().cast<int>();
  least_ = 0;
  const bool holds = in.x() >= 0 && in.y() >= 0 && in.x() < size_.x() && in.y() < size_.y() && in.z() >= -1 &&
                     in.z() <= size_.z();
  if (!holds || !start_about(goal, arrival)) start_from_sides(goal);
}

void LocalGuide::start_from_sides(const Vector3d& goal) {
  const auto index = [&](int x, int y, int z) {
    return static_cast<Index>((z * size_.y() + y) * size_.x() + x);
  };
  constexpr int kNone = -1;
  const double level = (goal.z() - corner_.z()) / kLevel;
  const int toward = level < -1 ? 0 : level > size_.z() + 1 ? size_.z() - 1 : kNone;
  const auto for_sides = [&](const auto& visit) {
    for (int z = 0; z < size_.z(); ++z) {
      for (int y = 0; y < size_.y(); ++y) {
        const bool whole = y == 0 || y == size_.y() - 1;
        for (int x = 0; x < size_.x(); x += whole ? 1 : std::max(size_.x() - 1, 1))
          visit(index(x, y, z), (centre_of(x, y, z) - goal).norm());
        if (z != toward || whole) continue;
        for (int x = 1; x < size_.x() - 1; ++x) visit(index(x, y, z), (centre_of(x, y, z) - goal).norm());
      }
    }
  };
  least_ = std::numeric_limits<double>::infinity();
  for_sides([&](Index, double length) { least_ = std::min(least_, length); });
  for_sides([&](Index cell, double length) {
    offer(cell, static_cast<std::uint32_t>(std::lround((length - least_) * kPerMetre)));
  });
}

void LocalGuide::walk() {
  for (std::uint32_t cost = 0; cost <= kFarthest; ++cost) {
    for (std::size_t i = 0; i < queue_[cost].size(); ++i) {  // grows on the way never: steps cost something
      const Index cell = queue_[cost][i];
      if (cost_[cell] != cost) continue;
      const int x = static_cast<int>(cell) % size_.x();
      const int y = static_cast<int>(cell) / size_.x() % size_.y();
      const int z = static_cast<int>(cell) / (size_.x() * size_.y());
      for (const Step& step : kSteps) {
        const Vector3i to(x + step.x, y + step.y, z + step.z);
        if ((to.array() < 0).any() || (to.array() >= size_.array()).any()) continue;
        const auto next = static_cast<Index>((to.z() * size_.y() + to.y()) * size_.x() + to.x());
        offer(next, cost + step.length * price_[next] / 10);
      }
    }
  }
}

void LocalGuide::set(const LocalWindow& window, const Vector3d& goal, const Heights& heights, double arrival,
                     std::span<const HiddenSpace> hidden) {
  lay_out(window, heights);
  price(window, hidden);
  start_from(goal, arrival);
  walk();
  if (reaches_the_middle()) return;
  std::fill(cost_.begin(), cost_.end(), kNever);
  for (auto& bucket : queue_) bucket.clear();
  start_from_sides(goal);
  walk();
}

/// Where the vehicle is, to a tile.
bool LocalGuide::reaches_the_middle() const {
  constexpr int kNear = 5;  // cells
  const int x0 = size_.x() / 2;
  const int y0 = size_.y() / 2;
  for (int z = 0; z < size_.z(); ++z) {
    for (int y = std::max(y0 - kNear, 0); y < std::min(y0 + kNear, size_.y()); ++y) {
      for (int x = std::max(x0 - kNear, 0); x < std::min(x0 + kNear, size_.x()); ++x) {
        if (std::isfinite(at(x, y, z))) return true;
      }
    }
  }
  return false;
}

double LocalGuide::at(int x, int y, int z) const {
  const std::uint32_t cost = cost_[static_cast<std::size_t>((z * size_.y() + y) * size_.x() + x)];
  return cost == kNever ? std::numeric_limits<double>::infinity() : least_ + cost / kPerMetre;
}

double LocalGuide::to_go(const Vector3d& point) const {
  const Vector3d at_cell =
      (point - corner_).cwiseQuotient(Vector3d(kCell, kCell, kLevel)) - Vector3d::Constant(0.5);
  const Vector3i low = at_cell.array().floor().cast<int>();
  if (low.x() < 0 || low.y() < 0 || low.x() + 1 >= size_.x() || low.y() + 1 >= size_.y())
    return std::numeric_limits<double>::infinity();
  const int z = std::clamp(static_cast<int>(std::lround(at_cell.z())), 0, size_.z() - 1);
  const double u = at_cell.x() - low.x();
  const double v = at_cell.y() - low.y();
  double sum = 0;
  double weights = 0;
  for (const int dy : {0, 1}) {
    for (const int dx : {0, 1}) {
      const double length = at(low.x() + dx, low.y() + dy, z);
      const double weight = (dx == 0 ? 1 - u : u) * (dy == 0 ? 1 - v : v);
      if (!(length < std::numeric_limits<double>::infinity())) continue;
      sum += weight * length;
      weights += weight;
    }
  }
  return weights > 1e-6 ? sum / weights + 0.4 * (1 - weights) : std::numeric_limits<double>::infinity();
}

}  // namespace pade::planning

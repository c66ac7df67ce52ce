// A buffer of fixed capacity, ordered by time, that never allocates after construction.
#pragma once

#include <cstddef>
#include <vector>

#include "pade/core/time.hpp"

namespace pade::navigation {

/// Items need a member `time`. Index 0 is the oldest.
template <class Item>
class TimeRing {
 public:
  explicit TimeRing(std::size_t capacity) : items_(capacity > 0 ? capacity : 1) {}

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] bool full() const { return size_ == items_.size(); }
  Item& operator[](std::size_t i) { return items_[(first_ + i) % items_.size()]; }
  const Item& operator[](std::size_t i) const { return items_[(first_ + i) % items_.size()]; }
  Item& front() { return (*this)[0]; }
  [[nodiscard]] const Item& front() const { return (*this)[0]; }
  [[nodiscard]] const Item& back() const { return (*this)[size_ - 1]; }

  void clear() { size_ = 0; }
  void pop_front() {
    first_ = (first_ + 1) % items_.size();
    --size_;
  }
  void pop_back() { --size_; }
  /// Drops the oldest if there is no room.
  void push_back(const Item& item) {
    if (full()) pop_front();
    items_[(first_ + size_++) % items_.size()] = item;
  }
  /// Puts the item at index `at`, behind those that are there already; drops the oldest if there is no
  /// room.
  void insert(std::size_t at, const Item& item) {
    if (full()) {
      if (at == 0) return;
      pop_front();
      --at;
    }
    ++size_;
    for (std::size_t i = size_ - 1; i > at; --i) (*this)[i] = (*this)[i - 1];
    (*this)[at] = item;
  }
  /// Number of items with a stamp at or before `time`.
  [[nodiscard]] std::size_t count_until(Time time) const {
    std::size_t low = 0;
    std::size_t high = size_;
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if ((*this)[middle].time <= time) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }

 private:
  std::vector<Item> items_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
};

}  // namespace pade::navigation

#include "pade/mapping/query/distance_kernels.hpp"

#include "pade/core/compute/vec.hpp"

namespace pade::mapping::PADE_ISA {
namespace {

#if defined(__AVX512BW__)
constexpr int kBytes = 64;
#elif defined(__AVX2__)
constexpr int kBytes = 32;
#else
constexpr int kBytes = 16;
#endif

using Bits = std::uint32_t;  // one for each lane

/// As many values as fit a register.
template <class Value>
struct Lanes;
template <>
struct Lanes<std::int16_t> {
  using Vector [[gnu::vector_size(kBytes)]] = std::int16_t;
};
template <>
struct Lanes<std::int32_t> {
  using Vector [[gnu::vector_size(kBytes)]] = std::int32_t;
};
template <class Value>
using Vector = typename Lanes<Value>::Vector;
template <class Value>
constexpr int kWidth = kBytes / static_cast<int>(sizeof(Value));

template <class Value>
PADE_INLINE Vector<Value> load(const Value* from) {
  Vector<Value> values;
  __builtin_memcpy(&values, from, sizeof values);
  return values;
}
template <class Value>
PADE_INLINE void store(Value* to, const Vector<Value>& values) {
  __builtin_memcpy(to, &values, sizeof values);
}
template <class Value>
PADE_INLINE Vector<Value> all_of(std::int32_t value) {
  return static_cast<Value>(value) - Vector<Value>{};
}
template <class V>
PADE_INLINE V least(const V& a, const V& b) {
  return a < b ? a : b;
}

/// Whether any lane of a is above that of b.
template <class Value>
PADE_INLINE bool any_above(const Vector<Value>& a, const Vector<Value>& b) {
#if defined(__AVX512BW__)
  if constexpr (sizeof(Value) == 2) return _mm512_cmpgt_epi16_mask(__m512i(a), __m512i(b)) != 0;
  if constexpr (sizeof(Value) == 4) return _mm512_cmpgt_epi32_mask(__m512i(a), __m512i(b)) != 0;
#elif defined(__AVX2__)
  return _mm256_movemask_epi8(__m256i(a > b)) != 0;
#elif defined(__SSE2__)
  return _mm_movemask_epi8(__m128i(a > b)) != 0;
#else
  const auto above = a > b;
  bool any = false;
  for (int i = 0; i < kWidth<Value>; ++i) any = any || above[i] != 0;
  return any;
#endif
}

/// `yes` in the lanes whose bit is set, else `no`.
template <class Value>
PADE_INLINE Vector<Value> select(Bits bits, const Vector<Value>& yes, const Vector<Value>& no) {
#if defined(__AVX512BW__)
  if constexpr (sizeof(Value) == 2)
    return Vector<Value>(_mm512_mask_blend_epi16(bits, __m512i(no), __m512i(yes)));
  if constexpr (sizeof(Value) == 4)
    return Vector<Value>(_mm512_mask_blend_epi32(static_cast<__mmask16>(bits), __m512i(no), __m512i(yes)));
#else
  Vector<Value> bit;
  for (int i = 0; i < kWidth<Value>; ++i) bit[i] = static_cast<Value>(1U << static_cast<unsigned>(i));
  return (all_of<Value>(static_cast<std::int32_t>(bits)) & bit) != 0 ? yes : no;
#endif
}

template <class Value>
class Distances {
 public:
  explicit Distances(const DistanceBox<Value>& box)
      : box_(box), most_(all_of<Value>(box.most)), slab_(static_cast<long>(box.stride) * box.ny) {
    while (reach_ * reach_ < box.most) ++reach_;  // from here on nothing is nearer than `most`
  }

  void run() {
    for (int y = 0; y < box_.ny; ++y)
      for (int x = 0; x < box_.nx; x += kW) along_z(x, y);
    for (int z = 0; z < box_.nz; ++z) {
      for (int x = 0; x < box_.nx; x += kW) along_y(x, z);
      for (int y = 0; y < box_.ny; ++y)
        along_x(box_.squared + z * slab_ + static_cast<long>(y) * box_.stride);
    }
  }

 private:
  using V = Vector<Value>;
  static constexpr int kW = kWidth<Value>;

  [[nodiscard]] Bits bits_at(int x, int y, int z) const {
    const std::uint8_t* at = box_.blocked + (static_cast<long>(z) * box_.ny + y) * box_.row_bytes + x / 8;
    std::uint64_t word = 0;
    __builtin_memcpy(&word, at, sizeof word);
    constexpr std::uint64_t kAll = (std::uint64_t{1} << kW) - 1;
    return static_cast<Bits>(word >> static_cast<unsigned>(box_.first_bit + (x & 7)) & kAll);
  }

  /// The distance along the column alone, by a pass there and one back.
  void along_z(int x, int y) {
    Value* column = box_.scratch;
    Value* out = box_.squared + static_cast<long>(y) * box_.stride + x;
    const V far = all_of<Value>(reach_);
    const V one = all_of<Value>(1);
    V distance = far;
    Bits any = 0;
    for (int z = 0; z < box_.nz; ++z) {
      const Bits bits = bits_at(x, y, z);
      any |= bits;
      distance = select<Value>(bits, V{}, least(V(distance + one), far));
      store(column + z * kW, distance);
    }
    if (any == 0) {
      for (int z = 0; z < box_.nz; ++z) store(out + z * slab_, most_);
      return;
    }
    distance = far;
    for (int z = box_.nz - 1; z >= 0; --z) {
      distance = least(V(distance + one), load(column + z * kW));
      store(out + z * slab_, least(V(distance * distance), most_));
    }
  }

  /// The lowest of the parabolas over a column, each asked where it can be the lowest.
  void along_y(int x, int z) {
    const int n = box_.ny;
    const int reach = reach_ < n ? reach_ : n;
    Value* padded = box_.scratch;
    Value* column = padded + static_cast<long>(reach) * kW;
    Value* out = box_.squared + z * slab_ + x;
    int last = -n;  // that holds anything
    bool any = false;
    for (int y = 0; y < n; ++y) {
      const V values = load(out + static_cast<long>(y) * box_.stride);
      store(column + static_cast<long>(y) * kW, values);
      if (any_above<Value>(most_, values)) {
        any = true;
        last = y;
      }
      behind_[y] = y - last;
    }
    if (!any) return;
    for (int k = 0; k < reach; ++k) {
      store(padded + static_cast<long>(k) * kW, most_);
      store(column + static_cast<long>(n + k) * kW, most_);
    }
    int next = 2 * n;
    for (int y = n - 1; y >= 0; --y) {
      const int first = behind_[y] < next - y ? behind_[y] : next - y;  // nearest that holds anything
      if (behind_[y] == 0) next = y;
      const Value* here = column + static_cast<long>(y) * kW;
      V values = load(here);
      int k = first > 0 ? first : 1;
      V square = all_of<Value>(k < reach ? k * k : 0);
      for (; k < reach && any_above<Value>(values, square); ++k) {
        const V nearer =
            least(load(here - static_cast<long>(k) * kW), load(here + static_cast<long>(k) * kW));
        values = least(values, V(nearer + square));
        square += all_of<Value>(2 * k + 1);
      }
      store(out + static_cast<long>(y) * box_.stride, values);
    }
  }

  /// The same within a row.
  void along_x(Value* row) {
    const int reach = reach_ < box_.nx ? reach_ : box_.nx;
    const int padding = (reach + kW - 1) / kW * kW;
    Value* copy = box_.scratch + padding;
    bool any = false;
    for (int x = 0; x < box_.nx; x += kW) {
      const V values = load(row + x);
      store(copy + x, values);
      any = any || any_above<Value>(most_, values);
    }
    if (!any) return;
    for (int x = 0; x < padding; x += kW) store(box_.scratch + x, most_);
    const int end = (box_.nx + kW - 1) / kW * kW;
    for (int x = 0; x < padding; x += kW) store(copy + end + x, most_);
    for (int x = 0; x < box_.nx; x += kW) {
      V values = load(copy + x);
      V square = all_of<Value>(1);
      for (int k = 1; k < reach && any_above<Value>(values, square); ++k) {
        const V nearer = least(load(copy + x - k), load(copy + x + k));
        values = least(values, V(nearer + square));
        square += all_of<Value>(2 * k + 1);
      }
      store(row + x, values);
    }
  }

  const DistanceBox<Value>& box_;
  V most_;
  long slab_;
  int reach_ = 0;
  int behind_[kMostDistanceRows];  // NOLINT(*-avoid-c-arrays)
};

}  // namespace

void near_distances(const DistanceBox<std::int16_t>& box) { Distances<std::int16_t>(box).run(); }
void far_distances(const DistanceBox<std::int32_t>& box) { Distances<std::int32_t>(box).run(); }

}  // namespace pade::mapping::PADE_ISA

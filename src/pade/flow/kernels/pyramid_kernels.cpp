#include "pade/flow/kernels/pyramid_kernels.hpp"

#include "pade/flow/kernels/lines.hpp"

namespace pade::flow::PADE_ISA {
namespace {

PADE_INLINE void sort(V& a, V& b) {
  const V low = min(a, b);
  b = max(a, b);
  a = low;
}

PADE_INLINE void sort3(V& a, V& b, V& c) {
  sort(a, b);
  sort(b, c);
  sort(a, b);
}

PADE_INLINE void sort5(V& a, V& b, V& c, V& d, V& e) {
  sort(a, b);
  sort(d, e);
  sort(c, e);
  sort(c, d);
  sort(a, d);
  sort(a, c);
  sort(b, e);
  sort(b, d);
  sort(b, c);
}

// The median of p[first] to p[last] by dropping the smallest and the largest until one is left. Templates, so
// that every index is a constant and the values stay in registers.
template <int kLow, int kHigh>
PADE_INLINE void sort_ends(V* p) {
  if constexpr (kLow < kHigh) {
    sort(p[kLow], p[kHigh]);
    sort_ends<kLow + 1, kHigh - 1>(p);
  }
}
template <int kTo, int kFrom, int kLast>
PADE_INLINE void smallest_to(V* p) {
  if constexpr (kFrom <= kLast) {
    sort(p[kTo], p[kFrom]);
    smallest_to<kTo, kFrom + 1, kLast>(p);
  }
}
template <int kTo, int kFrom>
PADE_INLINE void largest_to(V* p) {
  if constexpr (kFrom < kTo) {
    sort(p[kFrom], p[kTo]);
    largest_to<kTo, kFrom + 1>(p);
  }
}
template <int kFirst, int kLast>
PADE_INLINE V median_between(V* p) {
  if constexpr (kFirst == kLast) {
    return p[kFirst];
  } else {
    constexpr int kMiddle = (kFirst + kLast) / 2;
    sort_ends<kFirst, kLast>(p);
    smallest_to<kFirst, kFirst + 1, kMiddle>(p);
    largest_to<kLast, kMiddle>(p);
    return median_between<kFirst + 1, kLast - 1>(p);
  }
}

}  // namespace

void convert_row_u8(const unsigned char* from, float* to, int width) {
  for (int x = 0; x < width; ++x) to[x] = static_cast<float>(from[x]);
  for (int x = width; x < padded(width); ++x) to[x] = to[width - 1];
}

// 16-bit images count in 257ths, so that thresholds mean the same as for 8 bits.
void convert_row_u16(const unsigned short* from, float* to, int width) {
  for (int x = 0; x < width; ++x) to[x] = static_cast<float>(from[x]) * (1.0F / 257.0F);
  for (int x = width; x < padded(width); ++x) to[x] = to[width - 1];
}

void downsample(PlaneView from, PlaneView to, int first, int last, float* scratch) {
  float* line = scratch + kRowMultiple;
  for (int y = first; y < last; ++y) {
    const float* rows[5];
    for (int i = 0; i < 5; ++i) rows[i] = from.row(clamp_index(2 * y + i - 2, from.height));
    for (int x = 0; x < padded(from.width); x += kLanes) {
      store(line + x, (load(rows[0] + x) + load(rows[4] + x)) * (1.0F / 16) +
                          (load(rows[1] + x) + load(rows[3] + x)) * (4.0F / 16) +
                          load(rows[2] + x) * (6.0F / 16));
    }
    repeat_edges(line, from.width, kLargestSmoothRadius);
    float* out = to.row(y);
    for (int x = 0; x < to.width; ++x) {
      const float* at = line + 2 * x;
      out[x] = (at[-2] + at[2]) * (1.0F / 16) + (at[-1] + at[1]) * (4.0F / 16) + at[0] * (6.0F / 16);
    }
    for (int x = to.width; x < padded(to.width); ++x) out[x] = out[to.width - 1];
  }
}

void upsample(PlaneView from, PlaneView to, float factor, int first, int last) {
  for (int y = first; y < last; ++y) {
    const float* a = from.row(clamp_index(y / 2, from.height));
    const float* b = from.row(clamp_index((y + 1) / 2, from.height));
    float* out = to.row(y);
    const float half = factor * 0.25F;
    const int pairs = (to.width - 1) / 2;
    for (int x = 0; x < pairs; ++x) {
      const float here = a[x] + b[x];
      const float next = a[x + 1] + b[x + 1];
      out[2 * x] = here * (2 * half);
      out[2 * x + 1] = (here + next) * half;
    }
    for (int x = 2 * pairs; x < to.width; ++x) {
      const int i = clamp_index(x / 2, from.width);
      const int j = clamp_index((x + 1) / 2, from.width);
      out[x] = (x % 2 == 0) ? (a[i] + b[i]) * (2 * half) : ((a[i] + b[i]) + (a[j] + b[j])) * half;
    }
    for (int x = to.width; x < padded(to.width); ++x) out[x] = out[to.width - 1];
  }
}

void smooth(PlaneView from, PlaneView to, const float* taps, int any_radius, int first, int last,
            float* scratch) {
  with_radius(any_radius, [&](auto radius) {
    float* line = scratch + kRowMultiple;
    float own_taps[kLargestSmoothRadius + 1];
    for (int i = 0; i <= radius; ++i) own_taps[i] = taps[i];
    const float* pointers[2 * kLargestSmoothRadius + 1];
    for (int y = first; y < last; ++y) {
      for (int i = -radius; i <= radius; ++i)
        pointers[i + radius] = from.row(clamp_index(y + i, from.height));
      convolve_vertical(pointers + radius, own_taps, radius, line, padded(from.width));
      repeat_edges(line, from.width, kLargestSmoothRadius);
      for (int x = 0; x < padded(from.width); x += kLanes) {
        store(to.row(y) + x, convolve_horizontal(line + x, own_taps, radius));
      }
    }
  });
}

void subtract_from(PlaneView from, PlaneView to, int first, int last) {
  for (int y = first; y < last; ++y) {
    float* row = to.row(y);
    for (int x = 0; x < padded(to.width); x += kLanes) store(row + x, load(from.row(y) + x) - load(row + x));
    for (int x = to.width; x < padded(to.width); ++x) row[x] = row[to.width - 1];
  }
}

void gradient(PlaneView from, PlaneView gradient_x, PlaneView gradient_y, int first, int last,
              float* scratch) {
  Lines<5> lines(from, scratch, first - 2);
  for (int y = first; y < last; ++y) {
    lines.advance(y + 2);
    for (int x = 0; x < padded(from.width); x += kLanes) {
      store(gradient_x.row(y) + x, along_x(lines[y] + x));
      store(gradient_y.row(y) + x, five_point(load(lines[y - 2] + x), load(lines[y - 1] + x),
                                              load(lines[y + 1] + x), load(lines[y + 2] + x)));
    }
  }
}

// Sorting columns of three, then the median of (largest minimum, median of middles, smallest maximum).
void median3(PlaneView from, PlaneView to, int first, int last, float* scratch) {
  const long line = padded(from.width) + 2 * kRowMultiple;
  float* low = scratch + kRowMultiple;
  float* middle = low + line;
  float* high = middle + line;
  for (int y = first; y < last; ++y) {
    const float* above = from.row(clamp_index(y - 1, from.height));
    const float* here = from.row(y);
    const float* below = from.row(clamp_index(y + 1, from.height));
    for (int x = 0; x < padded(from.width); x += kLanes) {
      V a = load(above + x);
      V b = load(here + x);
      V c = load(below + x);
      sort3(a, b, c);
      store(low + x, a);
      store(middle + x, b);
      store(high + x, c);
    }
    repeat_edges(low, from.width, kLargestSmoothRadius);
    repeat_edges(middle, from.width, kLargestSmoothRadius);
    repeat_edges(high, from.width, kLargestSmoothRadius);
    for (int x = 0; x < padded(from.width); x += kLanes) {
      const V largest_low = max(max(load(low + x - 1), load(low + x)), load(low + x + 1));
      const V smallest_high = min(min(load(high + x - 1), load(high + x)), load(high + x + 1));
      V a = load(middle + x - 1);
      V b = load(middle + x);
      V c = load(middle + x + 1);
      sort3(a, b, c);
      a = largest_low;
      c = smallest_high;
      sort3(a, b, c);
      store(to.row(y) + x, b);
    }
  }
}

// Columns of five are sorted once and shared by the five windows that hold them. Of the 25 values in sorted
// rows and columns twelve cannot be the median; the last selection is among thirteen.
void median5(PlaneView from, PlaneView to, int first, int last, float* scratch) {
  const long line = padded(from.width) + 2 * kRowMultiple;
  float* sorted[5];
  for (int i = 0; i < 5; ++i) sorted[i] = scratch + line * i + kRowMultiple;
  for (int y = first; y < last; ++y) {
    const float* rows[5];
    for (int i = 0; i < 5; ++i) rows[i] = from.row(clamp_index(y + i - 2, from.height));
    for (int x = 0; x < padded(from.width); x += kLanes) {
      V p[5] = {load(rows[0] + x), load(rows[1] + x), load(rows[2] + x), load(rows[3] + x),
                load(rows[4] + x)};
      sort5(p[0], p[1], p[2], p[3], p[4]);
      store(sorted[0] + x, p[0]);
      store(sorted[1] + x, p[1]);
      store(sorted[2] + x, p[2]);
      store(sorted[3] + x, p[3]);
      store(sorted[4] + x, p[4]);
    }
    for (float* row : sorted) repeat_edges(row, from.width, kLargestSmoothRadius);
    for (int x = 0; x < padded(from.width); x += kLanes) {
      // Rank i of the columns, sorted across the five columns: q[i][j] then has at least (i+1)(j+1)-1 of the
      // 25 values below it and (5-i)(5-j)-1 above. The median has 12 on each side, which leaves 13
      // candidates.
      V q[5][5];
      const auto sorted_ranks = [&](int i) {
        const float* at = sorted[i] + x;
        V* r = q[i];
        r[0] = load(at - 2);
        r[1] = load(at - 1);
        r[2] = load(at);
        r[3] = load(at + 1);
        r[4] = load(at + 2);
        sort5(r[0], r[1], r[2], r[3], r[4]);
      };
      sorted_ranks(0);
      sorted_ranks(1);
      sorted_ranks(2);
      sorted_ranks(3);
      sorted_ranks(4);
      V band[13] = {q[0][3], q[0][4], q[1][2], q[1][3], q[1][4], q[2][1], q[2][2],
                    q[2][3], q[3][0], q[3][1], q[3][2], q[4][0], q[4][1]};
      store(to.row(y) + x, (median_between<0, 12>(band)));
    }
  }
}

}  // namespace pade::flow::PADE_ISA

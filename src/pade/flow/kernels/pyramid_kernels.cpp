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

// Batcher's odd-even merge of two sorted lists of two, three and five: the odd members and the even members
// are merged, and one comparison of neighbours is left.
PADE_INLINE void merge2(V a1, V a2, V b1, V b2, V* out) {
  sort(a1, b1);
  sort(a2, b2);
  sort(b1, a2);
  out[0] = a1;
  out[1] = b1;
  out[2] = a2;
  out[3] = b2;
}
PADE_INLINE void merge3(V a1, V a2, V a3, V b1, V b2, V b3, V* out) {
  V odd[4];
  merge2(a1, a3, b1, b3, odd);
  sort(a2, b2);
  sort(a2, odd[1]);
  sort(b2, odd[2]);
  out[0] = odd[0];
  out[1] = a2;
  out[2] = odd[1];
  out[3] = b2;
  out[4] = odd[2];
  out[5] = odd[3];
}
PADE_INLINE void merge5(const V* a, const V* b, V* out) {
  V odd[6];
  V even[4];
  merge3(a[0], a[2], a[4], b[0], b[2], b[4], odd);
  merge2(a[1], a[3], b[1], b[3], even);
  out[0] = odd[0];
  for (int i = 0; i < 4; ++i) {
    sort(even[i], odd[i + 1]);
    out[1 + 2 * i] = even[i];
    out[2 + 2 * i] = odd[i + 1];
  }
  out[9] = odd[5];
}

// The median of two sorted lists of ten and one of five. It has 12 of the 25 below it, up to 5 of them among
// the five, so that it is one of the five or has rank 8 to 13 in the union of the tens. Comparing one list of
// ten with the reverse of the other parts the ten smaller from the ten larger, each list rising and then
// falling; comparing the halves of such a list parts it again. (Ranks count from one here, arrays from zero.)
PADE_INLINE V median_of_10_10_5(const V* a, const V* b, const V* c) {
  V low[10];
  V high[10];
  for (int i = 0; i < 10; ++i) {
    low[i] = min(a[i], b[9 - i]);
    high[i] = max(a[i], b[9 - i]);
  }
  V top[5];     // ranks 6 to 10
  V bottom[5];  // ranks 11 to 15
  for (int i = 0; i < 5; ++i) {
    top[i] = max(low[i], low[i + 5]);
    bottom[i] = min(high[i], high[i + 5]);
  }
  sort5(top[0], top[1], top[2], top[3], top[4]);
  sort5(bottom[0], bottom[1], bottom[2], bottom[3], bottom[4]);
  // The sixth of the eleven: of some i of the first list and 6 - i of the second it is the largest.
  const V with_all_five = max(top[2], c[4]);
  const V with_four = max(top[3], c[3]);
  const V with_three = max(top[4], c[2]);
  const V with_two = max(bottom[0], c[1]);
  const V with_one = max(bottom[1], c[0]);
  return min(min(min(with_all_five, with_four), min(with_three, with_two)), min(with_one, bottom[2]));
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

// Columns of five are sorted once and merged with their right neighbours once; a window is two such pairs and
// one more column.
void median5(PlaneView from, PlaneView to, int first, int last, float* scratch) {
  const int n = padded(from.width);
  const long line = n + 2 * kRowMultiple;
  float* sorted[5];
  float* pairs[10];
  for (int i = 0; i < 5; ++i) sorted[i] = scratch + line * i + kRowMultiple;
  for (int i = 0; i < 10; ++i) pairs[i] = scratch + line * (5 + i) + kRowMultiple;
  for (int y = first; y < last; ++y) {
    const float* rows[5];
    for (int i = 0; i < 5; ++i) rows[i] = from.row(clamp_index(y + i - 2, from.height));
    for (int x = 0; x < n; x += kLanes) {
      V p[5] = {load(rows[0] + x), load(rows[1] + x), load(rows[2] + x), load(rows[3] + x),
                load(rows[4] + x)};
      sort5(p[0], p[1], p[2], p[3], p[4]);
      for (int i = 0; i < 5; ++i) store(sorted[i] + x, p[i]);
    }
    for (float* row : sorted) repeat_edges(row, from.width, kLargestSmoothRadius);
    // From two columns before the image on: what is computed before those is not used.
    for (int x = -kLanes; x < n; x += kLanes) {
      V here[5];
      V next[5];
      V both[10];
      for (int i = 0; i < 5; ++i) here[i] = load(sorted[i] + x);
      for (int i = 0; i < 5; ++i) next[i] = load(sorted[i] + x + 1);
      merge5(here, next, both);
      for (int i = 0; i < 10; ++i) store(pairs[i] + x, both[i]);
    }
    for (int x = 0; x < n; x += kLanes) {
      V left[10];
      V right[10];
      V column[5];
      for (int i = 0; i < 10; ++i) left[i] = load(pairs[i] + x - 2);
      for (int i = 0; i < 10; ++i) right[i] = load(pairs[i] + x);
      for (int i = 0; i < 5; ++i) column[i] = load(sorted[i] + x + 2);
      store(to.row(y) + x, median_of_10_10_5(left, right, column));
    }
  }
}

}  // namespace pade::flow::PADE_ISA

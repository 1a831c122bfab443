#ifndef DYNMESH_CORE_MESH_CELLS_ACROSS_H_
#define DYNMESH_CORE_MESH_CELLS_ACROSS_H_

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#include "core/mesh/ids.h"
#include "core/mesh/sort_unique.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace dynmesh {

/// The uses of the four faces of a tetrahedron: its own, and that of the cell across, if any, which are in
/// either order.
using FourUses = const std::array<CellId, 2>* const[4];

#ifdef __SSE2__

namespace internal {

/// kOrders[less][k] = place of the k-th smallest of four different values. The bits of `less` say which are
/// smaller: 0 to 3 each than the next, the last than the first; 4 and 5 the first two than the one after
/// next.
using Orders = std::array<std::array<uint8_t, 4>, 64>;

constexpr Orders MakeOrders() {
  Orders orders{};
  for (unsigned digits = 0; digits < 256; ++digits) {
    const unsigned rank[4] = {digits & 3, digits >> 2 & 3, digits >> 4 & 3, digits >> 6};
    unsigned seen = 0, less = 0;
    for (int i = 0; i < 4; ++i) {
      seen |= 1u << rank[i];
      less |= unsigned{rank[i] < rank[(i + 1) % 4]} << i;
      if (i < 2) less |= unsigned{rank[i] < rank[i + 2]} << (4 + i);
    }
    if (seen != 15) continue;  // no permutation
    for (int i = 0; i < 4; ++i) orders[less][rank[i]] = i;
  }
  return orders;
}
inline constexpr Orders kOrders = MakeOrders();

}  // namespace internal

/// Writes the cells across the faces of tetrahedron `c` to `out`, ascending, and returns how many there are;
/// four entries are written in any case. Less than 0 where this is not the way: a face has more uses
/// (`overflow` stands second), or a cell is across two faces.
inline int CellsAcross(Slot c, FourUses& uses, CellId overflow, Slot* out) {
  const auto load = [&](int i) { return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(uses[i])); };
  const __m128i low = _mm_unpacklo_epi32(load(0), load(1)), high = _mm_unpacklo_epi32(load(2), load(3));
  const __m128i first = _mm_unpacklo_epi64(low, high), second = _mm_unpackhi_epi64(low, high);
  const __m128i none = _mm_cmpeq_epi32(second, _mm_set1_epi32(-1));
  const __m128i across = _mm_xor_si128(_mm_xor_si128(first, second), _mm_set1_epi32(static_cast<int>(c)));
  // Slots are below 2^31. Less 2^31 they are negative: those that are missing are larger, and all different.
  const __m128i keys = _mm_or_si128(_mm_andnot_si128(none, _mm_xor_si128(across, _mm_set1_epi32(1 << 31))),
                                    _mm_and_si128(none, _mm_setr_epi32(0, 1, 2, 3)));
  const __m128i next = _mm_shuffle_epi32(keys, _MM_SHUFFLE(0, 3, 2, 1));
  const __m128i after_next = _mm_shuffle_epi32(keys, _MM_SHUFFLE(1, 0, 3, 2));
  const __m128i odd =
      _mm_or_si128(_mm_or_si128(_mm_cmpeq_epi32(keys, next), _mm_cmpeq_epi32(keys, after_next)),
                   _mm_cmpeq_epi32(second, _mm_set1_epi32(static_cast<int>(overflow.slot()))));
  if (_mm_movemask_epi8(odd) != 0) return -1;
  const auto mask = [](__m128i lanes) {
    return static_cast<unsigned>(_mm_movemask_ps(_mm_castsi128_ps(lanes)));
  };
  const unsigned less = mask(_mm_cmplt_epi32(keys, next)) | (mask(_mm_cmplt_epi32(keys, after_next)) & 3)
                                                                << 4;
  Slot values[4];
  _mm_storeu_si128(reinterpret_cast<__m128i*>(values), across);
  for (int k = 0; k < 4; ++k) out[k] = values[internal::kOrders[less][k]];
  return 4 - std::popcount(mask(none));
}

#else

inline int CellsAcross(Slot c, FourUses& uses, CellId overflow, Slot* out) {
  Slot row[4];
  bool odd = false;
  int size = 0;
  for (int i = 0; i < 4; ++i) {
    const auto& [first, second] = *uses[i];
    odd |= second == overflow;
    row[i] = second.valid() ? first.slot() ^ second.slot() ^ c : kNoSlot;
    size += second.valid();
  }
  internal::SortFour(row);
  for (int i = 0; i < 3; ++i) odd |= (row[i] == row[i + 1]) & (row[i] != kNoSlot);
  std::memcpy(out, row, sizeof(row));
  return odd ? -1 : size;
}

#endif

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_CELLS_ACROSS_H_

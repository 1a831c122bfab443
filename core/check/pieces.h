#ifndef DYNMESH_CORE_CHECK_PIECES_H_
#define DYNMESH_CORE_CHECK_PIECES_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/mesh/ids.h"

namespace dynmesh {

/// Items 0 to n - 1 that are joined pair by pair, and turned: which ones hang together, and whether all that
/// do can be turned so that each pair agrees.
///
/// Cost: 4 bytes an item; a call takes O(log n). Thread safety: that of std::vector.
class Pieces {
 public:
  /// REQUIRES: n <= 2^31.
  explicit Pieces(size_t n);

  enum class Turn : uint32_t { kSame = 0, kOpposite = 1 };

  /// Says that two items belong together, and how one must be turned against the other. False when what was
  /// joined before says otherwise.
  bool Join(uint32_t a, uint32_t b, Turn turn = Turn::kSame);

  /// The item that stands for the piece of `item`: its lowest.
  uint32_t Find(uint32_t item) { return Follow(item).item; }
  size_t size() const { return links_.size(); }
  /// How many pieces there are.
  size_t num_pieces() const { return num_pieces_; }

 private:
  struct Root {
    uint32_t item;
    uint32_t turn;  ///< of the item that was asked for, against this one
  };

  Root Follow(uint32_t item);

  std::vector<uint32_t> links_;  ///< an item of the same piece, and in the top bit the turn against it
  size_t num_pieces_;
};

/// Slots that groups connect: how many pieces they make.
///
///     GroupedSlots cells;
///     for (FaceId f : faces) { cells.BeginGroup(); for (CellId c : mesh.IncidentCells(f))
///     cells.Add(c.slot()); } cells.CountPieces();
///
/// Cost: n log n for n slots. Thread safety: that of std::vector.
class GroupedSlots {
 public:
  void BeginGroup() { starts_.push_back(slots_.size()); }
  /// REQUIRES: a group was begun.
  void Add(Slot slot) { slots_.push_back(slot); }
  size_t CountPieces() const;

 private:
  std::vector<Slot> slots_;
  std::vector<size_t> starts_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CHECK_PIECES_H_

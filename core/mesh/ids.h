#ifndef DYNMESH_CORE_MESH_IDS_H_
#define DYNMESH_CORE_MESH_IDS_H_

#include <compare>
#include <cstdint>
#include <utility>

#include "absl/strings/string_view.h"

namespace dynmesh {

/// Dimension of an entity; the value is the dimension.
enum class EntityKind : uint8_t { kVertex = 0, kEdge = 1, kFace = 2, kCell = 3 };

inline constexpr EntityKind kEntityKinds[] = {EntityKind::kVertex, EntityKind::kEdge,
                                              EntityKind::kFace, EntityKind::kCell};
inline constexpr int kNumEntityKinds = 4;

constexpr bool IsEntityKind(EntityKind kind) { return static_cast<int>(kind) < kNumEntityKinds; }

constexpr int Dimension(EntityKind kind) { return static_cast<int>(kind); }

/// "vertex", "edge", "face" or "cell".
constexpr absl::string_view EntityKindName(EntityKind kind) {
  constexpr absl::string_view kNames[] = {"vertex", "edge", "face", "cell"};
  return kNames[Dimension(kind)];
}

/// Dense index of an entity within its kind: the id that users see.
using Slot = uint32_t;
inline constexpr Slot kNoSlot = 0xffffffffu;

/// A slot that knows its kind, so that a face can never be passed for a cell. Costs what a Slot costs.
template <EntityKind K>
class Id {
 public:
  static constexpr EntityKind kKind = K;

  constexpr Id() = default;
  constexpr explicit Id(Slot slot) : slot_(slot) {}

  constexpr Slot slot() const { return slot_; }
  constexpr bool valid() const { return slot_ != kNoSlot; }

  friend constexpr auto operator<=>(Id, Id) = default;

  template <typename H>
  friend H AbslHashValue(H h, Id id) {
    return H::combine(std::move(h), id.slot_);
  }

 private:
  Slot slot_ = kNoSlot;
};

using VertexId = Id<EntityKind::kVertex>;
using EdgeId = Id<EntityKind::kEdge>;
using FaceId = Id<EntityKind::kFace>;
using CellId = Id<EntityKind::kCell>;

/// An entity whose kind is known at run time only.
struct EntityId {
  EntityKind kind = EntityKind::kVertex;
  Slot slot = kNoSlot;

  constexpr EntityId() = default;
  constexpr EntityId(EntityKind k, Slot s) : kind(k), slot(s) {}
  template <EntityKind K>
  constexpr EntityId(Id<K> id) : kind(K), slot(id.slot()) {}  // NOLINT: conversion is the point

  friend constexpr auto operator<=>(const EntityId&, const EntityId&) = default;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_IDS_H_

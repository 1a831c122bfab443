#include "core/edit/derived_rows.h"

#include <algorithm>

#include "core/edit/mix_rows.h"

namespace dynmesh {

DerivedRows::DerivedRows(const Mesh& mesh, const Patch& patch, absl::Span<const VertexId> new_vertices)
    : mesh_(mesh),
      edge_columns_(ColumnsOf(mesh, EntityKind::kEdge)),
      face_columns_(ColumnsOf(mesh, EntityKind::kFace)) {
  if (edge_columns_.empty() && face_columns_.empty()) return;
  for (const Patch::Cut& cut : patch.cuts) Keep(cut, new_vertices[cut.middle.slot() & ~kNewVertex]);
  for (const Patch::Merger& merger : patch.mergers) Keep(merger);
}

absl::Status DerivedRows::PassOn(RowWriter& writer) const {
  for (const Row& row : rows_) {
    const Slot heir = Find(heirs_[row.heir]);
    if (heir == kNoSlot) continue;
    const size_t size = mesh_.attributes()[row.column].spec().row_bytes();
    DYNMESH_RETURN_IF_ERROR(writer.Set(row.column, heir, pool_.At(row.begin, size)));
  }
  return absl::OkStatus();
}

void DerivedRows::Keep(const Patch::Cut& cut, VertexId middle) {
  const EdgeId e = mesh_.FindEdge(cut.a, cut.b);
  if (!e.valid()) return;
  if (!edge_columns_.empty()) {
    for (VertexId end : {cut.a, cut.b}) Keep(e, {{end, middle}, 2});
  }
  if (face_columns_.empty()) return;
  for (FaceId f : mesh_.IncidentFaces(e)) {
    ForEachOtherSide(mesh_.Vertices(f), cut.a, cut.b, [&](VertexId from, VertexId to) {
      Keep(f, {{from, to, middle}, 3});
    });
  }
}

void DerivedRows::Keep(const Patch::Merger& merger) {
  std::vector<FaceId> faces;
  for (EdgeId e : mesh_.IncidentEdges(merger.gone)) {
    if (!edge_columns_.empty()) Keep(e, Merged(mesh_.Vertices(e), merger.kept, merger.gone));
    const auto of_edge = mesh_.IncidentFaces(e);
    if (!face_columns_.empty()) faces.insert(faces.end(), of_edge.begin(), of_edge.end());
  }
  std::sort(faces.begin(), faces.end());
  faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
  for (FaceId f : faces) Keep(f, Merged(mesh_.Vertices(f), merger.kept, merger.gone));
}

/// What an edge or face passes on. Duplicates are elements, which inherit from elements.
void DerivedRows::Keep(EntityId parent, const Polygon& heir) {
  const bool is_edge = parent.kind == EntityKind::kEdge;
  if (heir.size < (is_edge ? 2 : 3) || mesh_.IsDuplicate(parent)) return;
  const Slot there = Find(heir);
  const auto index = static_cast<uint32_t>(heirs_.size());
  for (int column : is_edge ? edge_columns_ : face_columns_) {
    const AttributeColumn& values = mesh_.attributes()[column];
    const RowShare passed{values.Row(parent.slot), there == kNoSlot ? 1.0 : 0.0};
    const auto before = there == kNoSlot ? values.default_row() : values.Row(there);
    const std::vector<uint8_t> row =
        there == kNoSlot ? MixRows(values, {passed}) : MixRows(values, {RowShare{before}, passed});
    if (row != before) rows_.push_back({index, column, pool_.Add(row)});
  }
  if (!rows_.empty() && rows_.back().heir == index) heirs_.push_back(heir);
}

/// The edge or face with these vertices.
Slot DerivedRows::Find(const Polygon& heir) const {
  const auto vertices = heir.span();
  return heir.size == 2 ? mesh_.FindEdge(vertices[0], vertices[1]).slot() : mesh_.FindFace(vertices).slot();
}

}  // namespace dynmesh

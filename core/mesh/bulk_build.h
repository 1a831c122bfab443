#ifndef DYNMESH_CORE_MESH_BULK_BUILD_H_
#define DYNMESH_CORE_MESH_BULK_BUILD_H_

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/mesh/mesh.h"
#include "core/mesh/spatial_order.h"

namespace dynmesh {

/// In which order a bulk build gives out slots.
enum class SlotOrder {
  kCaller,   ///< item i of a kind gets slot i
  kHilbert,  ///< vertices along a Hilbert curve, elements by their lowest vertex
};

/// Told now and then how far a build is; a status that is not OK ends the build with it.
using BuildProgress = std::function<absl::Status(uint64_t done, uint64_t total)>;

struct BulkOptions {
  MeshOptions mesh;
  SlotOrder order = SlotOrder::kCaller;
  BuildProgress progress = {};
};

/// What a bulk build gave.
struct BulkResult {
  Mesh mesh;  ///< not committed yet: revision 0, stamped 1
  /// slots[kind][i] = slot of the i-th item of a kind that was put in; empty with SlotOrder::kCaller.
  std::array<Permutation, kNumEntityKinds> slots;
  /// Elements that name a vertex twice; elements that equal one of a lower slot. By kind, ascending.
  std::vector<EntityId> degenerate;
  std::vector<EntityId> duplicate;
};

/// Makes a whole mesh at once, by sorting instead of by a look-up for each edge and face.
///
///     BulkBuilder builder({});
///     builder.AddVertices(points);
///     builder.AddElements(ElementType::kTetrahedron, ids);   // in pieces of any size, kinds in any order
///     BulkResult result = *std::move(builder).Finish();
///     result.mesh.Commit();
///
/// Law: with SlotOrder::kCaller the mesh equals, to the last id, one to which the same vertices, then wire
/// edges, faces and cells were added one by one; with kHilbert it equals that of the items in the order that
/// `slots` tells.
///
/// How: uses of faces by cells find their first equal (FirstEqual); a scan over the cells in order then
/// numbers faces as they first occur and names the edges of each cell, by those of its known faces as far as
/// these reach; the names that remain find their first equal in turn. Scattered input is matched in spatial
/// order, which changes no number. Cost: linear, but for vertices with thousands of edges. Memory beside the
/// mesh: some 30 bytes for a tetrahedron. Thread safety: that of std::vector.
class BulkBuilder {
 public:
  explicit BulkBuilder(const BulkOptions& options) : options_(options), mesh_(options.mesh) {}

  /// Errors: INVALID_ARGUMENT NON_FINITE_VALUE; RESOURCE_EXHAUSTED.
  absl::Status AddVertices(absl::Span<const Point> positions);

  /// NumVertices(type) ids for each element: vertices that were added before, counted from 0.
  /// Errors: INVALID_ARGUMENT BAD_ELEMENT_TYPE, BAD_ARRAY_LENGTH; NOT_FOUND UNKNOWN_ENTITY (no such vertex);
  /// RESOURCE_EXHAUSTED. Nothing was added then.
  absl::Status AddElements(ElementType type, absl::Span<const VertexId> vertices);

  /// Bytes that the mesh takes so far.
  size_t memory_bytes() const { return mesh_.memory_bytes(); }

  /// Errors: INVALID_ARGUMENT DUPLICATE_ELEMENT (if so opted; metadata position: which of the elements of its
  /// kind); RESOURCE_EXHAUSTED; those of the progress function.
  absl::StatusOr<BulkResult> Finish() &&;

 private:
  /// Room for as many new rows as 1 in kHeadroom before an array moves. Untouched pages cost nothing.
  static constexpr size_t kHeadroom = 16;

  using EdgeNames = std::array<EdgeId, kMaxElementEdges>;

  // bulk_build.cc: input, order, and what follows from the topology
  void AppendElement(ElementType type, const VertexId* vertices);
  Slot NumElements(EntityKind kind) const { return counts_[Dimension(kind)]; }
  absl::Status Tick(uint64_t items);
  void SortItems();
  void SortElements(EntityKind kind, const Permutation& ranks);
  void ChooseWalk();
  absl::Status CheckRoom() const;
  void CountElements();
  void FillEdgeFaces();
  void FillVertexEdges();
  void IndexHubs();
  void MarkBoundary();
  absl::Status ReportElements();
  bool HasLowerTwin(CellId c) const;
  absl::Status RefuseDuplicate(EntityId id) const;
  /// Which of the elements of its kind that were put in it is.
  Slot PlaceOf(EntityId element) const;

  // bulk_topology.cc: which faces and edges there are
  absl::Status MatchFaces();
  template <int Words>
  absl::Status MatchFaceKeys();
  absl::Status ScanFaces();
  absl::Status ScanCells();
  void ScanFaceElement(FaceId f);
  void ScanCell(CellId c);
  void PrefetchUses(Slot c) const;
  void PrefetchFaces(Slot c, uint32_t known) const;
  OrientedFace OrientFace(FaceId f, absl::Span<const VertexId> vertices, bool degenerate) const;
  FaceId NewFace(absl::Span<const VertexId> vertices, absl::Span<const EdgeId> names);
  EdgeId NewName(VertexId a, VertexId b);
  void AddFaceCell(FaceId f, CellId c);
  void MatchEdges();
  uint32_t UseOf(Slot c) const { return NumElements(EntityKind::kFace) + c * mesh_.cell_face_stride_; }

  BulkOptions options_;
  Mesh mesh_;
  BulkResult result_;
  std::array<Slot, kNumEntityKinds> counts_ = {};  ///< vertices and elements put in
  uint64_t done_ = 0, total_ = 0;
  Permutation walk_;  ///< spatial order of the cells of scattered input, else empty

  /// For each use of a face: first the first equal use; once scanned, the face. Face elements come first,
  /// then the faces of cell 0, of cell 1, ... at a stride.
  std::vector<uint32_t> uses_;
  /// Names of edges: a name for each occurrence that no known face explains. Wire edges come first.
  std::vector<std::array<VertexId, 2>> names_;
  std::vector<uint32_t> num_edge_faces_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_BULK_BUILD_H_

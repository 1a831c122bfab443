#ifndef DYNMESH_CORE_MESH_MESH_H_
#define DYNMESH_CORE_MESH_MESH_H_

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/container/flat_hash_map.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/mesh/attributes.h"
#include "core/mesh/batch_image.h"
#include "core/mesh/bit_set.h"
#include "core/mesh/checksum.h"
#include "core/mesh/element_type.h"
#include "core/mesh/error.h"
#include "core/mesh/ids.h"
#include "core/mesh/incidence_lists.h"
#include "core/mesh/journal.h"
#include "core/mesh/mesh_options.h"
#include "core/mesh/new_element.h"
#include "core/mesh/oriented_face.h"
#include "core/mesh/slots.h"
#include "core/mesh/stamps.h"
#include "core/mesh/stored_relations.h"
#include "core/mesh/vertex_cycle.h"
#include "core/mesh/work_meter.h"

namespace dynmesh {

/// Slots of each kind.
using EntitySlots = std::array<std::vector<Slot>, kNumEntityKinds>;

/// A dynamic mesh of vertices, edges, faces and cells of every kind, manifold or not.
///
/// Users insert *elements* (wire edges, dangling faces, cells); the faces and edges below them are derived,
/// shared, and live while something needs them:
///
///     Mesh mesh;
///     auto a = *mesh.AddVertex({0, 0, 0}); ...
///     auto tet = *mesh.AddElement(ElementType::kTetrahedron, {a, b, c, d});  // + 4 faces, 6 edges
///     mesh.Commit();                                                        // revision 1
///     mesh.RemoveElement(tet);                                              // the faces and edges go too
///
/// Stored relations: downwards cell->vertices, cell->faces, face->vertices, face->edges, edge->vertices;
/// upwards vertex->edges, edge->faces, face->cells. The other nine: relations.h. Upward lists hold an
/// entry for each use, in arbitrary order: a face that uses an edge twice is in its list twice.
///
/// Invariants (Validate() in validate.h checks them all):
///  - each vertex pair has exactly one edge that faces may use, each vertex cycle exactly one face that cells
///    may use (the primary); other edges and faces there are duplicate elements, used by nobody;
///  - a derived entity is used by something; a face or edge is on the boundary bit sets and counters
///    exactly as its number of uses says;
///  - checksum, counts and stamps are those of the present content.
///
/// Revisions: edits are stamped revision() + 1, which becomes the revision at Commit(). Between
/// BeginBatch() and Commit() a journal allows Rollback() to the exact state of BeginBatch().
///
/// Errors: a call that returns an error has changed nothing. Entities passed by id must be live: else
/// NOT_FOUND with UNKNOWN_ENTITY or ENTITY_REMOVED. Accessors by id (not returning a status)
/// REQUIRE live ids and check nothing.
/// Cost: adding or removing an element is linear in its own size and in the lengths of the shortest
/// lists round its edges (paper, section 3: smart edges and smart vertices).
/// Thread safety: that of std::vector. Source: "Considerations toward a Dynamic Mesh Data Structure".
class Mesh {
 public:
  explicit Mesh(const MeshOptions& options = {});
  Mesh(Mesh&&) = default;
  Mesh& operator=(Mesh&&) = default;
  /// An equal mesh, to the last id and stamp. Explicit, because it takes as much memory again.
  /// REQUIRES: no batch is open. Cost: copying memory_bytes().
  Mesh Clone() const { return Mesh(*this); }

  // ---- Size, liveness, revisions ----

  const MeshOptions& options() const { return options_; }
  /// From now on as many slots are used at most; those in use stay, be they more.
  void SetLimits(const MeshLimits& limits) { options_.limits = limits; }
  int64_t revision() const { return revision_; }
  const Slots& slots(EntityKind kind) const { return slots_[Dimension(kind)]; }
  uint32_t NumLive(EntityKind kind) const { return slots(kind).num_live(); }
  /// Live elements of a kind; 0 for vertices.
  uint32_t NumElements(EntityKind kind) const { return num_elements_[Dimension(kind)]; }
  bool IsLive(EntityId id) const { return slots(id.kind).IsLive(id.slot); }

  /// NOT_FOUND unless `id` is live and its occupant was born at or before `as_of_revision`.
  absl::Status CheckLive(EntityId id, int64_t as_of_revision = std::numeric_limits<int64_t>::max()) const;

  /// Revision that last changed: the position of a vertex, or the element at a slot (added, removed).
  /// Derived faces and edges have none.
  const StampColumn& changed(EntityKind kind) const { return changed_[Dimension(kind)]; }

  // ---- Reading ----

  const Point& Position(VertexId v) const { return positions_[v.slot()]; }
  ElementType Type(EntityId id) const { return static_cast<ElementType>(flags(id) & kTypeMask); }
  bool IsElement(EntityId id) const { return id.kind != EntityKind::kVertex && flags(id) & kElementFlag; }
  /// A kept element that stands where another element of the same vertices stood already. Cells never are.
  bool IsDuplicate(EntityId id) const { return id.kind != EntityKind::kVertex && flags(id) & kDuplicateFlag; }
  /// An element that names a vertex twice.
  bool IsDegenerate(EntityId id) const {
    return id.kind != EntityKind::kVertex && flags(id) & kDegenerateFlag;
  }
  /// Whether no element is degenerate.
  bool IsPlain() const { return num_degenerate_ == 0; }
  /// Whether any edge or face IsDuplicate.
  bool HasDuplicates(EntityKind kind) const { return !duplicates_[Dimension(kind)].empty(); }

  absl::Span<const VertexId> Vertices(EdgeId e) const { return edge_vertices_[e.slot()]; }
  absl::Span<const VertexId> Vertices(FaceId f) const {
    return absl::MakeConstSpan(&face_vertices_[size_t{f.slot()} * face_stride_], FaceSize(f));
  }
  absl::Span<const VertexId> Vertices(CellId c) const {
    return absl::MakeConstSpan(&cell_vertices_[size_t{c.slot()} * cell_vertex_stride_], NumVertices(Type(c)));
  }
  /// Of an edge, face or cell. REQUIRES: id.kind is not kVertex.
  absl::Span<const VertexId> VerticesOf(EntityId id) const;

  /// edges[k] joins vertices k and k + 1 of the face.
  absl::Span<const EdgeId> Edges(FaceId f) const {
    return absl::MakeConstSpan(&face_edges_[size_t{f.slot()} * face_stride_], FaceSize(f));
  }
  /// In template order.
  absl::Span<const OrientedFace> Faces(CellId c) const {
    return absl::MakeConstSpan(&cell_faces_[size_t{c.slot()} * cell_face_stride_],
                               TemplateOf(Type(c)).num_faces);
  }
  /// Edge of the cell that its template calls `local_edge`: two table look-ups.
  EdgeId Edge(CellId c, int local_edge) const;
  /// A live cell other than `c` of the same type with the same faces, or an invalid id.
  CellId FindTwin(CellId c) const;

  /// Incident entities of the next dimension, once for each use; ascending where there are at most
  /// kSortedIncident. Valid until the next edit.
  static constexpr size_t kSortedIncident = IncidenceLists<EdgeId>::kIndexedLength;
  absl::Span<const EdgeId> IncidentEdges(VertexId v) const { return vertex_edges_.Of(v.slot()); }
  absl::Span<const FaceId> IncidentFaces(EdgeId e) const { return edge_faces_.Of(e.slot()); }
  absl::Span<const CellId> IncidentCells(FaceId f) const {
    const auto& uses = face_cells_[f.slot()];
    if (uses[1] == kOverflow) return face_overflow_.Of(uses[0].slot());
    return absl::MakeConstSpan(uses.data(), uses[1].valid() ? 2 : uses[0].valid() ? 1 : 0);
  }

  /// The edge (not a duplicate) between two vertices in either direction, or an invalid id.
  /// Cost: the smaller of the two vertices' degrees.
  EdgeId FindEdge(VertexId a, VertexId b) const;
  /// The face (not a duplicate) with this vertex cycle, in any rotation and either direction.
  FaceId FindFace(absl::Span<const VertexId> vertices) const;

  /// The rows of a relation as one array: the row of a live slot is ids[stride * slot .. stride * (slot +
  /// 1)).
  struct FixedRows {
    const Slot* ids = nullptr;
    size_t stride = 0;
  };
  /// Of edge->vertices; face->vertices and ->edges where all faces are triangles; cell->vertices where all
  /// cells are tetrahedra; cell->edges where it is stored and all cells have as many. Else no ids. Valid
  /// until the next edit.
  FixedRows FixedRowsOf(Relation relation) const;
  /// Vertices(f) and Edges(f) of faces stand so many entries apart.
  size_t FaceStride() const { return face_stride_; }
  /// The same of Vertices(c) and Faces(c) of cells.
  size_t CellVertexStride() const { return cell_vertex_stride_; }
  size_t CellFaceStride() const { return cell_face_stride_; }
  /// Whether no cell of another type was ever there.
  bool IsTetrahedral() const { return cell_vertex_stride_ == NumVertices(ElementType::kTetrahedron); }

  /// Asks memory for what an operator at an edge will read: its star and what is incident to that. Each stage
  /// needs what the one before asked for, so they are to be called in turn, other edges in between. Any slot
  /// may be named, also of none. Changes nothing but time.
  static constexpr int kPrefetchStages = 7;
  void PrefetchStar(EdgeId e, int stage) const;
  void PrefetchStar(FaceId f, int stage) const;
  void PrefetchStar(VertexId v, int stage) const;

  // ---- Boundary: known at any moment, listed without a traversal ----

  /// Faces with exactly one cell use; edges of such faces, and edges with exactly one face use; vertices of
  /// such edges. Empty for cells.
  const BitSet& Boundary(EntityKind kind) const { return boundary_[Dimension(kind)]; }
  bool IsOnBoundary(EntityId id) const { return Boundary(id.kind).Test(id.slot); }

  // ---- Primitive edits ----

  /// Errors: INVALID_ARGUMENT NON_FINITE_VALUE, RESOURCE_EXHAUSTED.
  absl::StatusOr<VertexId> AddVertex(const Point& position);
  /// Errors: FAILED_PRECONDITION VERTEX_IN_USE while it has incident edges.
  absl::Status RemoveVertex(VertexId v);
  /// Errors: INVALID_ARGUMENT NON_FINITE_VALUE.
  absl::Status MoveVertex(VertexId v, const Point& position);

  /// Adds an element; a derived face or edge with the same vertices becomes it and takes its vertex order
  /// (but a face of more than 64 cells that lies otherwise stays, and the element becomes a duplicate of it).
  /// Degenerate elements (a vertex named twice) are kept.
  /// Errors: INVALID_ARGUMENT BAD_ELEMENT_TYPE, BAD_ARRAY_LENGTH, DUPLICATE_ELEMENT (if so opted);
  /// RESOURCE_EXHAUSTED.
  absl::StatusOr<EntityId> AddElement(ElementType type, absl::Span<const VertexId> vertices);
  /// A face or edge that cells or faces still use stays as a derived one.
  /// Errors: FAILED_PRECONDITION NOT_AN_ELEMENT.
  absl::Status RemoveElement(EntityId id);

  /// AddElement for NumVertices(type) ids an element, in spatial order when there are many, so that new slots
  /// are handed out along a Hilbert curve; equal elements keep their order. Calls added(i, id) after each.
  /// Errors: those of AddElement, with metadata index. REQUIRES: a batch is open, and is rolled back after an
  /// error.
  absl::Status AddElements(ElementType type, absl::Span<const VertexId> vertices,
                           absl::FunctionRef<void(size_t, EntityId)> added);
  /// RemoveElement for each of `elements`, in ascending order; none may be named twice.
  /// Errors: those of RemoveElement, with metadata index; nothing was changed then.
  absl::Status RemoveElements(EntityKind kind, absl::Span<const Slot> elements);

  /// Removes elements and adds others in their place: faces and edges that both use live on, with their ids
  /// and attributes. Calls replaced(i, id) for each of `added`.
  /// Errors: those of RemoveElement and AddElement. REQUIRES: no element is named twice; a batch is open, and
  /// is rolled back, to a savepoint before at least, after an error.
  absl::Status ReplaceElements(absl::Span<const EntityId> removed, absl::Span<const NewElement> added,
                               absl::FunctionRef<void(size_t, EntityId)> replaced);

  // ---- Attributes ----

  const std::vector<AttributeColumn>& attributes() const { return attributes_; }
  /// Index into attributes(), or -1.
  int FindAttribute(absl::string_view name, EntityKind kind) const;
  /// Adds a column of default rows. Errors: those of CheckAttributeSpec; ALREADY_EXISTS ATTRIBUTE_EXISTS;
  /// RESOURCE_EXHAUSTED.
  absl::Status AddAttribute(const AttributeSpec& spec);
  /// Sets the row of a live entity. Errors: INVALID_ARGUMENT BAD_ARRAY_LENGTH, NON_FINITE_VALUE.
  /// REQUIRES: 0 <= column < attributes().size().
  absl::Status SetAttribute(int column, Slot slot, absl::Span<const uint8_t> row);

  // ---- Stored relations ----

  const StoredRelations& stored() const { return stored_; }
  /// Keeps a table of the relation current from now on, or forgets it. Answers are the same either way.
  /// Errors: INVALID_ARGUMENT BAD_ARGUMENT unless it is one of kStorableRelations; RESOURCE_EXHAUSTED; those
  /// of `meter`, which is charged the table's bytes before they are taken. Nothing changed then. Cost: to
  /// switch on, all rows.
  absl::Status StoreRelation(Relation relation, bool on, WorkMeter& meter = WorkMeter::Unlimited());

  // ---- Batches ----

  /// Starts the journal. REQUIRES: no edit since the last Commit, no batch open.
  void BeginBatch();
  /// Makes the edits since the last Commit revision() + 1; freed slots may be used again.
  /// Errors: RESOURCE_EXHAUSTED after 2^32 - 2 revisions; the batch stays open then.
  absl::Status Commit();
  /// Puts everything back to BeginBatch(), to the last id, stamp and list length. REQUIRES: a batch is open.
  void Rollback();
  /// A point within the batch to which RollbackTo() puts everything back. REQUIRES: a batch is open.
  using Savepoint = size_t;
  Savepoint MakeSavepoint() const { return journal_.entries.size(); }
  void RollbackTo(Savepoint savepoint);
  /// Live entities whose shape, incidences or elements the open batch may have changed, ascending: what it
  /// made or removed, what that is made of, and the stars of moved vertices. Errors: those of `meter`.
  /// REQUIRES: a batch is open. Cost: linear in the journal and in these stars, and sorting them.
  absl::StatusOr<EntitySlots> Touched(WorkMeter& meter) const;
  /// The steps of the open batch so far.
  const Journal& journal() const { return journal_; }
  /// What takes the mesh back to where it was at `savepoint` (0: at BeginBatch()) when it is as it is now.
  /// REQUIRES: a batch is open. Cost: O(n log n) steps since, less where they ascend.
  BatchImage ImageSince(Savepoint savepoint) const;
  /// Puts back what a batch changed, as edits of the open batch; returns what takes that back in turn. Many
  /// may follow each other in one batch.
  /// Errors: INTERNAL when the mesh is seen not to be as that batch left it; RESOURCE_EXHAUSTED when lists of
  /// incident entities are full. REQUIRES: a batch is open, and is rolled back, to a savepoint before at
  /// least, after an error. Cost: of the entities in the image, their lists included.
  absl::StatusOr<BatchImage> Restore(const BatchImage& image);
  /// What BatchImage::fit says of images that fit the mesh as it is now.
  BatchImage::Fit FitNow() const;

  // ---- Upkeep ----

  /// Makes room for as many entities of each kind. Never fails; call it with counts that were checked.
  void Reserve(const std::array<uint64_t, kNumEntityKinds>& counts);
  const Checksum& checksum() const { return checksum_; }
  /// Bytes of each array, and all of them.
  std::vector<std::pair<std::string, size_t>> MemoryByArray() const;
  size_t memory_bytes() const;

 private:
  friend class BatchImageBuilder;
  friend class BatchRestorer;
  friend class BulkBuilder;
  friend class MeshValidator;
  friend class Rebuilder;
  friend class RowKernels;
  friend class MeshTestPeer;

  Mesh(const Mesh&) = default;

  static constexpr uint8_t kTypeMask = 7;
  static constexpr uint8_t kElementFlag = 8;
  static constexpr uint8_t kDuplicateFlag = 16;
  static constexpr uint8_t kDegenerateFlag = 32;
  static constexpr CellId kOverflow{kNoSlot - 1};
  /// Vertices of more edges find them through hub_edges_, edges of more faces through hub_faces_.
  static constexpr uint32_t kHubDegree = 512;
  static constexpr uint32_t kMaxReorderedCells = 64;

  using VertexSpan = absl::Span<const VertexId>;

  /// A face that was found, and how it lies against the vertices that were asked for.
  struct FaceMatch {
    FaceId face;
    FaceCode code;
  };
  using FaceEdges = std::array<EdgeId, kMaxFaceVertices>;
  struct CellParts;  // cell_parts.h
  class Nearby;      // nearby.h
  /// Of the edges that ElementTemplate::smart_edges names those that were found already; others are invalid.
  using SmartEdges = std::array<EdgeId, 3>;

  uint8_t& flags(EntityId id) { return flags_[Dimension(id.kind)][id.slot]; }
  uint8_t flags(EntityId id) const { return flags_[Dimension(id.kind)][id.slot]; }
  int FaceSize(FaceId f) const {
    return face_stride_ == kMaxFaceVertices && Type(f) == ElementType::kQuad ? 4 : 3;
  }
  Stamp next_stamp() const { return static_cast<Stamp>(revision_ + 1); }
  bool journaling() const { return batch_open_; }
  Slots& mutable_slots(EntityKind kind) { return slots_[Dimension(kind)]; }

  // mesh_edits.cc: checks, and the hierarchical creation behind the public edits
  absl::Status CheckVertices(ElementType type, VertexSpan vertices) const;
  absl::Status CheckRoom(ElementType type) const;
  absl::Status CheckRoom(const std::array<uint32_t, kNumEntityKinds>& needed) const;
  /// The part of it that speaks of incidence lists.
  absl::Status CheckListRoom(const std::array<uint32_t, kNumEntityKinds>& needed) const;
  absl::Status CheckRemovable(EntityId id) const;
  /// What AddElement does after CheckVertices; the boundary of a cell is left to be settled.
  absl::StatusOr<EntityId> AddChecked(ElementType type, VertexSpan vertices, const SmartEdges& known);
  absl::StatusOr<EntityId> AddWireEdge(VertexSpan vertices);
  absl::StatusOr<EntityId> AddFaceElement(VertexSpan vertices);
  absl::StatusOr<EntityId> AddFaceElement(VertexSpan vertices, FaceEdges& edges, const FaceMatch& match);
  absl::StatusOr<EntityId> AddCell(ElementType type, VertexSpan vertices, const SmartEdges& known);
  absl::StatusOr<EntityId> AddCell(ElementType type, VertexSpan vertices, CellParts& parts);
  absl::Status RefuseDuplicate(EntityId existing) const;
  CellId FindCell(ElementType type, const CellParts& parts) const;
  CellId FindCellButNot(CellId c, ElementType type, const CellParts& parts) const;
  bool HasFaces(CellId c, ElementType type, const CellParts& parts) const;
  void FindCellParts(const ElementTemplate& shape, VertexSpan vertices, const SmartEdges& known,
                     CellParts& parts) const;
  FaceMatch FindFaceAround(EdgeId e, VertexSpan vertices) const;
  EdgeId LeastUsed(absl::Span<const EdgeId> edges) const;
  FaceMatch FindCellFace(const ElementTemplate& shape, int local_face, VertexSpan vertices,
                         CellParts& parts) const;
  EdgeId EnsureEdge(VertexId a, VertexId b);
  void EnsureCellParts(const ElementTemplate& shape, VertexSpan vertices, CellParts& parts);

  // mesh_prefetch.cc
  void PrefetchVertex(VertexId v, int step) const;
  void PrefetchEdge(EdgeId e, int step) const;
  void PrefetchFace(FaceId f) const;
  void PrefetchCell(CellId c) const;
  void PrefetchEdges(FaceId f, int step) const;
  void PrefetchNeighbors(VertexId v) const;
  void PrefetchRound(FaceId f, int stage) const;
  template <typename Lower, typename Upper>
  VertexId OppositeOf(Lower lower, Upper upper) const;

  // mesh_replace.cc
  absl::StatusOr<EntityId> AddNear(const NewElement& element, Nearby& nearby);
  absl::StatusOr<EntityId> AddFaceNear(VertexSpan vertices, Nearby& nearby);
  absl::StatusOr<EntityId> AddCellNear(ElementType type, VertexSpan vertices, Nearby& nearby);

  // mesh_batches.cc
  std::vector<uint32_t> OrderOfElements(absl::Span<const VertexId> vertices, size_t size) const;
  void RemoveAll(EntityKind kind, absl::Span<const Slot> elements);
  void RemoveCells(absl::Span<const Slot> cells);
  void ReleaseFaces(absl::Span<const FaceId> faces);  ///< settles them, destroys those that nothing needs
  void ReleaseEdges(absl::Span<const EdgeId> edges);
  void SettleBoundaries(absl::Span<const Slot> cells);
  absl::Status AddScattered(const ElementTemplate& shape, size_t count,
                            absl::FunctionRef<VertexSpan(size_t)> element,
                            absl::FunctionRef<absl::Status(size_t, const SmartEdges&)> add);
  SmartEdges FindSmartEdges(const ElementTemplate& shape, VertexSpan vertices) const;

  // mesh_links.cc: creating and destroying single entities with their links, counters and journal
  void FillVertex(VertexId v, const Point& position);
  void MoveTo(VertexId v, const Point& position);
  EdgeId CreateEdge(VertexId a, VertexId b, uint8_t extra_flags);
  FaceId CreateFace(VertexSpan vertices, absl::Span<const EdgeId> edges, uint8_t extra_flags);
  CellId CreateCell(ElementType type, VertexSpan vertices, absl::Span<const OrientedFace> faces);
  /// Make what was allocated an entity, and link it.
  void FillEdge(EdgeId e, const std::array<VertexId, 2>& ends, uint8_t extra_flags);
  void FillFace(FaceId f, VertexSpan vertices, absl::Span<const EdgeId> edges, uint8_t extra_flags);
  void FillCell(CellId c, ElementType type, VertexSpan vertices, absl::Span<const OrientedFace> faces);
  void DestroyVertex(VertexId v);
  void DestroyEdge(EdgeId e);
  void DestroyFace(FaceId f);
  void EndEdge(EdgeId e);  ///< DestroyEdge, but no duplicate becomes primary
  void EndFace(FaceId f);
  void DestroyCell(CellId c);
  bool IsUnneeded(EdgeId e) const;
  bool IsUnneeded(FaceId f) const;

  void CountElement(EntityId id, int change);
  void IndexHubEdges(VertexId v);
  void IndexHubEdge(EdgeId e);
  void ForgetHubEdge(EdgeId e);
  void IndexHubFaces(EdgeId e);
  void IndexHubFace(FaceId f);
  void ForgetHubFace(FaceId f);
  bool IsLastBetweenEnds(EdgeId e) const;
  /// Vertices and edges of solids have more neighbours than those of surfaces.
  bool IsSolid() const { return NumLive(EntityKind::kCell) > 0; }
  void LinkEdge(EdgeId e);
  void UnlinkEdge(EdgeId e);
  void LinkFace(FaceId f);
  void UnlinkFace(FaceId f);
  void LinkCell(CellId c);
  void UnlinkCell(CellId c);
  void AddFaceCell(FaceId f, CellId c);
  void RemoveFaceCell(FaceId f, CellId c);
  uint32_t NumFaceCells(FaceId f) const;
  void AddEdgeFace(EdgeId e, FaceId f);
  void RemoveEdgeFace(EdgeId e, FaceId f);
  /// Puts a face, or those of a cell, onto the boundary or off it as their uses say. Whoever links or unlinks
  /// cells owes it: many at once pass on what cancels out.
  bool IsSettled(FaceId f) const;
  void SettleBoundary(FaceId f);
  void SettleBoundary(CellId c);
  void SetFaceOnBoundary(FaceId f, int change);
  void CountBoundary(EdgeId e, int change);

  void SetElementFlag(EntityId id);
  void ClearElementFlag(EntityId id);
  void FlipEdge(EdgeId e);
  void ReorderFace(FaceId f, FaceCode code);
  void RecodeFace(CellId c, FaceId f);
  FaceCode CodeInCell(CellId c, int local_face, FaceId f) const;

  // mesh_duplicates.cc: keeping one primary for each vertex pair or cycle
  void CountDuplicate(EntityId id, int change);
  void SetDuplicateFlag(EntityId id, bool duplicate);
  void PassOnPrimary(EntityId ended);

  uint64_t ElementTerm(EntityId id) const;
  void Touch(EntityId id) { changed_[Dimension(id.kind)].Touch(id.slot, next_stamp()); }
  void ResetAttributes(EntityId id);
  void WriteAttribute(int column, Slot slot, absl::Span<const uint8_t> row);

  // mesh_storage.cc: rows by slot
  Slot NewSlot(EntityKind kind, JournalEntry& entry);
  /// Allocates a slot that had an occupant before, also one that the batch has freed: what it holds is saved.
  void RetakeSlot(EntityId id, JournalEntry& entry);
  void SaveContent(EntityId id);
  void EnsureRow(EntityKind kind, Slot slot);
  void WidenFaces(int stride);
  void WidenCells(int vertex_stride, int face_stride);

  // mesh_rollback.cc
  void Record(const JournalEntry& entry) {
    if (batch_open_) journal_.entries.push_back(entry);
  }
  void Undo(const JournalEntry& entry);
  void UndoRecycle(EntityId id);
  void UndoCreate(const JournalEntry& entry);
  void UndoDestroy(const JournalEntry& entry);
  void UndoMove(const JournalEntry& entry);
  void UndoSetAttribute(const JournalEntry& entry);

  MeshOptions options_;
  int64_t revision_ = 0;
  std::array<Slots, kNumEntityKinds> slots_;
  std::array<StampColumn, kNumEntityKinds> changed_;
  std::array<std::vector<uint8_t>, kNumEntityKinds>
      flags_;  ///< type | element | duplicate | degenerate; none for vertices
  std::array<uint32_t, kNumEntityKinds> num_elements_ = {};
  uint32_t num_degenerate_ = 0;  ///< elements
  /// Slots of duplicate edges and faces, by their vertices.
  std::array<absl::flat_hash_map<CycleKey, absl::btree_set<Slot>>, kNumEntityKinds> duplicates_;

  std::vector<Point> positions_;
  std::vector<std::array<VertexId, 2>> edge_vertices_;
  int face_stride_ = 3;  ///< vertices and edges of a face: 3, or 4 once there was a quad
  std::vector<VertexId> face_vertices_;
  std::vector<EdgeId> face_edges_;
  int cell_vertex_stride_ = 4;  ///< widest cell type so far
  int cell_face_stride_ = 4;
  std::vector<VertexId> cell_vertices_;
  std::vector<OrientedFace> cell_faces_;

  IncidenceLists<EdgeId> vertex_edges_;
  IncidenceLists<FaceId> edge_faces_;
  /// The uses of a face, or {index of a list in face_overflow_, kOverflow} when there are more than two.
  std::vector<std::array<CellId, 2>> face_cells_;
  IncidenceLists<CellId> face_overflow_;
  std::vector<Slot> free_overflow_lists_;
  Slot num_overflow_lists_ = 0;
  /// Edges between two vertices that both have very many, by vertex pair, lower first.
  absl::flat_hash_map<std::pair<VertexId, VertexId>, EdgeId> hub_edges_;
  /// Primary faces all of whose edges have very many, by CanonicalCycle.
  absl::flat_hash_map<CycleKey, FaceId> hub_faces_;

  StoredRelations stored_;

  std::array<BitSet, kNumEntityKinds> boundary_;
  /// Of an edge: its faces on the boundary, and one more if it has exactly one face. Of a vertex: ends of its
  /// edges on the boundary.
  std::array<std::vector<uint32_t>, 2> boundary_uses_;

  std::vector<AttributeColumn> attributes_;
  Checksum checksum_;
  bool batch_open_ = false;
  Journal journal_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_MESH_H_

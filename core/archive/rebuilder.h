#ifndef DYNMESH_CORE_ARCHIVE_REBUILDER_H_
#define DYNMESH_CORE_ARCHIVE_REBUILDER_H_

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/archive/column_rows.h"
#include "core/archive/dirty_pages.h"
#include "core/archive/head.h"
#include "core/archive/page.h"
#include "core/archive/record.h"
#include "core/archive/slot_rows.h"
#include "core/codec/bytes.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

struct RebuildOptions {
  /// About how many bytes the mesh may take; one that says it is larger is refused before they are taken.
  uint64_t max_memory_bytes = std::numeric_limits<uint64_t>::max();
  /// Asked before so many bytes more are taken, if there is one: what it refuses is not taken, and all ends
  /// with its error. The sum of what it was asked is memory_bytes().
  std::function<absl::Status(uint64_t bytes)> charge = {};
};

/// Makes a mesh of an archive: of a head, the pages that go with it, and the records of the batches since.
///
///     Rebuilder rebuilder = *Rebuilder::Start(head);
///     for (page : pages) rebuilder.AddPage(page);          // in any order; ascending is fastest
///     for (record : records) rebuilder.AddRecord(record);  // in order
///     Mesh mesh = *std::move(rebuilder).Finish();
///
/// Law: the mesh equals the one that was kept, to the last id, stamp, flag and order of vertices, and the
/// same edits give both the same ids from then on; only lists of incident entities longer than
/// Mesh::kSortedIncident may stand in another order. Relations are not stored.
/// Pages may have been taken at any revision from the head's to the last record's.
///
/// The bytes may be anything: what cannot be a mesh is refused, by Finish() at the latest, which checks all
/// invariants of Mesh. After an error nothing but destroying it is of use.
///
/// Errors of all: FAILED_PRECONDITION ARCHIVE_FORMAT_NEWER; DATA_LOSS ARCHIVE_DAMAGED, with metadata kind and
/// page or ids where these are known; RESOURCE_EXHAUSTED.
/// Cost: linear, by passes over the arrays; some 0.6 us a tetrahedron. Thread safety: that of std::vector.
class Rebuilder {
 public:
  static absl::StatusOr<Rebuilder> Start(absl::string_view head, const RebuildOptions& options = {});

  /// One that lies beyond the slots of the head is passed over: records tell what it holds. REQUIRES: no
  /// record was added.
  absl::Status AddPage(absl::string_view page);
  /// Records up to the head's revision are passed over; then each must be of the revision after the last.
  absl::Status AddRecord(absl::string_view record);
  /// The same of a record that the caller has read for its note.
  absl::Status AddRecord(const RecordView& record);
  /// Pages that are not as they were added, because of records: what the next checkpoint has to write.
  const DirtyPages& changed_pages() const { return changed_pages_; }
  /// About what the mesh takes so far.
  uint64_t memory_bytes() const { return memory_bytes_; }
  /// Of the head, or of the last record.
  int64_t revision() const { return mesh_.revision_; }
  absl::StatusOr<Mesh> Finish() &&;

 private:
  Rebuilder(ArchiveHead head, const RebuildOptions& options);

  /// Where rows lie: slots from `begin` to before `end`, told at `revision`.
  struct Range {
    Slot begin;
    Slot end;
    int64_t revision;
  };

  // rebuilder.cc: what slots hold
  absl::Status Begin();
  absl::Status ReadPage(absl::string_view bytes);
  absl::Status ReadPageRows(PageId page, const Range& range, ByteReader& in);
  absl::Status ReadNextRecord(const RecordView& record);
  absl::Status ReadRuns(EntityKind kind, int64_t revision, ByteReader& in);
  absl::Status AddColumns(absl::Span<const ColumnHead> columns);
  bool ReadPageColumns(EntityKind kind, const Range& range, ByteReader& in);
  bool ReadRecordColumns(int64_t revision, ByteReader& in);
  bool ReadColumn(const ColumnSection& section, const Range& range, DirtyPages* changed);
  absl::Status EnsureRows(EntityKind kind, Slot end);
  absl::Status Charge(uint64_t bytes);
  void Widen(const RowWidths& widths);
  void Put(EntityId id, const SlotRow& row);
  void PutContent(EntityId id, const SlotRow& row);
  void PutNothing(EntityId id);

  // rebuild_links.cc: what follows from that
  absl::Status Complete();
  absl::Status LinkEdges();
  absl::Status LinkFaces();
  absl::Status LinkFace(FaceId f, std::vector<uint32_t>& lengths);
  void PrefetchEdges(FaceId f, const std::vector<uint32_t>& lengths) const;
  absl::Status LinkCells();
  absl::Status LinkCell(CellId c);
  void PrefetchFaces(CellId c) const;
  void MarkBoundary();
  void IndexHubs();
  void CountElements();

  // rebuild_checks.cc: what must hold
  absl::Status CheckSlots(EntityKind kind) const;
  absl::Status CheckColumn(const AttributeColumn& column) const;
  absl::Status CheckUses() const;
  absl::Status CheckPrimaryEdges() const;
  absl::Status CheckPrimaryFaces() const;
  template <int Words>
  absl::Status CheckPrimaryFaceKeys() const;
  absl::Status IndexDuplicates(EntityKind kind);
  absl::Status CheckFit() const;

  Slot Limit(EntityKind kind) const { return mesh_.slots(kind).limit(); }
  /// Whether an edge or higher lives at a slot below the limit: dead ones have no type here.
  bool Lives(EntityId id) const { return mesh_.flags(id) != 0; }

  ArchiveHead head_;
  RebuildOptions options_;
  Mesh mesh_;
  BatchImage::Fit fit_;      ///< of the head or the last record
  int64_t newest_page_ = 0;  ///< revision
  DirtyPages changed_pages_;
  uint64_t memory_bytes_ = 0;  ///< charged so far
  std::array<Slot, kNumEntityKinds> charged_slots_ = {};
  absl::Status out_of_memory_;  ///< why a column's rows were refused, if so
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ARCHIVE_REBUILDER_H_

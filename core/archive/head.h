#ifndef DYNMESH_CORE_ARCHIVE_HEAD_H_
#define DYNMESH_CORE_ARCHIVE_HEAD_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/codec/bytes.h"
#include "core/mesh/batch_image.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// For the rows of how wide faces and cells a mesh has room: of the widest that it ever had.
struct RowWidths {
  size_t face = 3;
  size_t cell_vertices = 4;
  size_t cell_faces = 4;

  static RowWidths Of(const Mesh& mesh) {
    return {mesh.FaceStride(), mesh.CellVertexStride(), mesh.CellFaceStride()};
  }
};

/// An attribute column without its rows.
struct ColumnHead {
  AttributeSpec spec;
  Stamp born = 0;
};

/// What a mesh is at one revision, but for what its slots hold.
struct ArchiveHead {
  int64_t revision = 0;
  MeshOptions options;
  RowWidths widths;
  std::array<Slot, kNumEntityKinds> slot_limits = {};  ///< so many slots of each kind were ever used
  BatchImage::Fit fit;                                 ///< checksum and counts
  std::vector<ColumnHead> columns;

  /// How many pages of a kind go with it.
  uint32_t num_pages(EntityKind kind) const;
};

/// The head of an archive that is begun now: pages are taken after it, records kept from the next batch on.
/// REQUIRES: no batch is open.
std::string EncodeHead(const Mesh& mesh);

/// Errors: FAILED_PRECONDITION ARCHIVE_FORMAT_NEWER; DATA_LOSS ARCHIVE_DAMAGED.
absl::StatusOr<ArchiveHead> DecodeHead(absl::string_view bytes);

// Parts that records have, too. What reads returns whether the bytes were such a part.
void WriteFit(const BatchImage::Fit& fit, ByteWriter& out);
bool ReadFit(ByteReader& in, BatchImage::Fit& fit);
void WriteWidths(const RowWidths& widths, ByteWriter& out);
bool ReadWidths(ByteReader& in, RowWidths& widths);
/// Columns of a mesh from `first` on.
void WriteColumnHeads(const Mesh& mesh, size_t first, ByteWriter& out);
bool ReadColumnHeads(ByteReader& in, std::vector<ColumnHead>& columns);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ARCHIVE_HEAD_H_

#ifndef DYNMESH_SERVER_SESSION_EXPORT_H_
#define DYNMESH_SERVER_SESSION_EXPORT_H_

#include <cstdint>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "server/session/query_budget.h"
#include "server/session/selection.h"
#include "server/session/session.h"

namespace dynmesh {

struct ExportedVertices {
  std::vector<Slot> ids;
  std::vector<Point> positions;
};
struct ExportedElements {
  ElementType type = ElementType::kUnspecified;
  std::vector<Slot> ids;
  std::vector<VertexId> vertices;
};
struct ExportedRows {
  AttributeSpec spec;
  std::vector<Slot> ids;
  std::vector<uint8_t> rows;
};
using ExportChunk = std::variant<ExportedVertices, ExportedElements, ExportedRows>;

/// A whole session: vertices, then elements type by type, then attributes column by column (a column without
/// rows as one empty chunk); ids ascend within a type or column. Rows are those of vertices and elements,
/// and of derived entities where they were set.
struct ExportAnswer {
  int64_t revision = 0;
  std::vector<ExportChunk> chunks;
};

/// Gathered under one reader lock. Errors: those of QueryBudget; beyond max_query_bytes subscribe instead,
/// which has no such limit.
absl::StatusOr<ExportAnswer> ExportSession(const Session& session, const QueryTerms& terms = {});

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_EXPORT_H_
